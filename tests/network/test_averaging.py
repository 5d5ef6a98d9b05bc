"""All averaging algorithms: the real rounds against theory, on the graphs that they must master."""

import itertools

import numpy as np
import pytest
from scipy import sparse

from network import graph
from network.averaging import matrices
from network.averaging.best_constant import BestConstant
from network.averaging.chebyshev import Chebyshev
from network.averaging.constant import ConstantWeights
from network.averaging.event_triggered import EventTriggered
from network.averaging.finite_time import FiniteTime, leja_order
from network.averaging.metropolis import MetropolisWeights
from network.averaging.ratio import Ratio
from network.consensus import Consensus
from network.graph import Graph
from network.messages import ConsensusMessage
from network.quantization import PayloadOptions
from network.spectrum import spectrum_of


def eigenvalues(net):
    """Of the Laplacian, the zero left out."""
    return np.linalg.eigvalsh(net.laplacian())[1:]


def metropolis_matrix(net):
    """W, from the definition."""
    A = np.abs(net.laplacian()) - np.diag(net.laplacian().diagonal())
    d = A.sum(axis=0)
    W = A / (1 + np.maximum(d[:, None], d[None]))
    return W + np.diag(1 - W.sum(axis=1))


def chebyshev_bound(net, rounds):
    """1 / T_t((λN + λ2) / (λN - λ2)): what Chebyshev's polynomial leaves at the ends of the spectrum."""
    low, high = eigenvalues(net)[[0, -1]]
    return 1 / np.cosh(rounds * np.arccosh((high + low) / (high - low)))


def shares_matrix(net):
    """P of equal shares."""
    A = np.diag(net.laplacian().diagonal()) - net.laplacian()
    d = A.sum(axis=0)
    return (A + np.eye(len(d))) / (1 + d)


def ratio_after(net, rounds):
    power = np.linalg.matrix_power(shares_matrix(net), rounds)
    return power / power.sum(axis=1, keepdims=True) - 1 / len(power)


THEORY = {
    "constant": (
        lambda net: ConstantWeights(epsilon=0.9 / net.max_degree),
        lambda net, t: np.abs(1 - 0.9 / net.max_degree * eigenvalues(net)).max() ** t,
    ),
    "metropolis": (
        lambda _: MetropolisWeights(),
        lambda net, t: np.sort(np.abs(np.linalg.eigvalsh(metropolis_matrix(net))))[-2] ** t,
    ),
    "best_constant": (
        lambda _: BestConstant(),
        lambda net, t: np.abs(1 - 2 / eigenvalues(net)[[0, -1]].sum() * eigenvalues(net)).max() ** t,
    ),
    "chebyshev": (lambda _: Chebyshev(), chebyshev_bound),
    "ratio": (lambda _: Ratio(), lambda net, t: np.linalg.norm(ratio_after(net, t), 2)),
}


@pytest.mark.parametrize("name", THEORY)
def test_the_worst_residual_after_twelve_rounds_is_theory_s(rounds, net, name):
    made, theory = THEORY[name]
    algorithm = made(net).tuned(net, 12)
    history, _ = rounds(net, algorithm, 12, np.eye(len(net.names)))
    residuals = [matrices.worst_residual(values) for values in history]
    for t in (1, 5, 12):
        assert residuals[t] == pytest.approx(theory(net, t), rel=0.01, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "digits", "limit"),
    [
        ("ring-4", 1, 1e-9),
        ("path-4", 1, 5e-5),
        ("ring-8", 1, 1e-4),
        ("ring-12", 2, 0.35e-2),
        ("grid-16", 2, 0.14e-2),
    ],
)
def test_chebyshev_after_twelve_rounds_in_figures(rounds, nets, name, digits, limit):
    """The limits are theory's residuals to as many digits as they have."""
    net = nets[name]
    history, _ = rounds(net, Chebyshev().tuned(net, 12), 12, np.eye(len(net.names)))
    assert float(f"{matrices.worst_residual(history[-1]):.{digits - 1}e}") <= limit


def test_finite_time_is_exact_after_as_many_rounds_as_there_are_distinct_eigenvalues(rounds, net):
    distinct = np.unique(eigenvalues(net).round(9)).size
    with pytest.raises(
        ValueError, match=f"{distinct - 1} is too few for finite_time, which needs {distinct} "
    ):
        FiniteTime().tuned(net, distinct - 1)
    history, _ = rounds(net, FiniteTime().tuned(net, distinct + 2), distinct + 2, np.eye(len(net.names)))
    residuals = [matrices.worst_residual(values) for values in history]
    assert residuals[distinct] < 1e-10
    assert residuals[-1] < 1e-10
    if distinct < 16:  # of so many roots the last ones find nothing left
        assert min(residuals[:distinct]) > 1e-3
    # the order of the roots keeps the errors on the way small
    assert max(residuals) < 1 + 1e-9


def first_below(rounds, net, options, limit, iterations):
    history, _ = rounds(net, options.tuned(net, iterations), iterations, np.eye(len(net.names)))
    return next(t for t, values in enumerate(history) if matrices.worst_residual(values) < limit)


@pytest.mark.usefixtures("unchecked")
def test_rounds_to_a_thousandth_on_a_ring_of_thirty_two(rounds):
    net = graph.ring([f"{i:02}" for i in range(32)])
    assert first_below(rounds, net, Chebyshev(), 1e-3, 40) <= 40
    assert first_below(rounds, net, FiniteTime(), 1e-3, 16) <= 16
    assert first_below(rounds, net, BestConstant(), 1e-3, 360) <= 360


def matrix_rounds(name, net, values):
    spectrum, L = spectrum_of(net), matrices.laplacian(net)
    match name:
        case "constant":
            return matrices.linear(L, values, 0.9 / net.max_degree)
        case "metropolis":
            return matrices.linear(matrices.metropolis_laplacian(net), values)
        case "best_constant":
            return matrices.linear(L, values, spectrum.step)
        case "chebyshev":
            return matrices.chebyshev(L, values, spectrum)
        case "finite_time":
            return matrices.finite_time(L, values, leja_order(np.array(spectrum.eigenvalues)))
        case _:
            return matrices.ratio(L, values)


@pytest.mark.parametrize("name", [*THEORY, "finite_time"])
def test_the_rounds_equal_their_matrices(rounds, net, name):
    values = np.random.default_rng(3).normal(size=(len(net.names), 3))
    made = THEORY[name][0] if name in THEORY else lambda _: FiniteTime()
    history, _ = rounds(net, made(net).tuned(net, 33), 33, values)
    expected = np.array(list(itertools.islice(matrix_rounds(name, net, values), 34)))
    np.testing.assert_allclose(history, expected, atol=1e-10)


@pytest.mark.parametrize("name", THEORY)
def test_the_average_stays(rounds, net, name):
    values = np.random.default_rng(3).normal(size=(len(net.names), 3))
    history, nodes = rounds(net, THEORY[name][0](net).tuned(net, 12), 12, values)
    if name == "ratio":  # the masses' does
        masses = np.array([node._state.mass for node in nodes.values()])
        np.testing.assert_allclose(masses.sum(axis=0), [*values.sum(axis=0), len(net.names)])
    else:
        means = np.broadcast_to(values.mean(axis=0), (13, 3))
        np.testing.assert_allclose(history.mean(axis=1), means, atol=1e-12)


def test_laplacians_are_those_of_the_graph(net):
    L = matrices.laplacian(net)
    assert isinstance(L, sparse.csr_array)
    np.testing.assert_array_equal(L.toarray(), net.laplacian())
    expected = np.eye(len(net.names)) - metropolis_matrix(net)
    np.testing.assert_allclose(matrices.metropolis_laplacian(net).toarray(), expected, atol=1e-15)


def test_residuals():
    start = np.array([[1.0], [3.0]])
    assert matrices.residual(start, start) == 1
    assert matrices.residual(np.array([[2.0], [3.0]]), start) == pytest.approx(np.sqrt(0.5))
    assert matrices.residual(start, np.ones((2, 1))) == 0


ALL = {**{name: made for name, (made, _) in THEORY.items()}, "finite_time": lambda _: FiniteTime(),
       "event_triggered": lambda _: EventTriggered()}  # fmt: skip


@pytest.mark.parametrize("name", ALL)
def test_one_node_alone_and_two(rounds, name):
    for names, made in (("A", graph.path("A")), ("AB", graph.path("AB"))):
        algorithm = ALL[name](graph.path("AB")).tuned(made, 40)
        history, _ = rounds(made, algorithm, 40, np.array([[1.0], [3.0]])[: len(names)])
        tolerance = {"event_triggered": 0.11, "constant": 1e-3}.get(name, 1e-9)
        np.testing.assert_allclose(history[-1], history[0].mean(), atol=tolerance)


@pytest.mark.parametrize("name", ALL)
def test_frames_follow_each_other(rounds, nets, name):
    """What one frame leaves behind does not reach the next, and values may change their length."""
    net = nets["ring-4"]
    algorithm = ALL[name](net).tuned(net, 12)
    rng = np.random.default_rng(1)
    _, nodes = rounds(net, algorithm, 12, rng.normal(size=(4, 2)))
    values = rng.normal(size=(4, 3))
    queue = [m for n, v in zip(net.names, values, strict=True) for m in nodes[n].begin(1, v)]
    while queue:
        message = queue.pop(0)
        for receiver in net.neighbors(message.sender):
            queue.extend(nodes[receiver].receive(message))
    expected, _ = rounds(net, algorithm, 12, values)
    np.testing.assert_array_equal([nodes[n].value for n in net.names], expected[-1])


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("name", ALL)
def test_somebody_who_leaves_makes_nothing_diverge(rounds, net, name):
    """A node that falls silent in round 3 for good: the others go on and agree, on something between them."""
    leaving = net.names[1]
    values = np.random.default_rng(4).normal(size=(len(net.names), 2))

    def leave(round_, nodes):
        if round_ != 3:
            return {}
        return {name: nodes[name].drop(leaving) for name in net.neighbors(leaving)}

    algorithm = ALL[name](net).tuned(net, 150)
    history, _ = rounds(net, algorithm, 150, values, during=leave)
    stay = [i for i, each in enumerate(net.names) if each != leaving]
    left = Graph.from_edges([net.names[i] for i in stay], [e for e in net.edges if leaving not in e])
    if len(left.components()) == 1:
        spread = np.ptp(history[-1][stay], axis=0).max()
        assert spread < (0.5 if name == "event_triggered" else 0.02)
    assert np.abs(history[4:]).max() < 10 * np.abs(values).max()
    if name != "ratio":
        means = history[4:, stay].mean(axis=1)
        np.testing.assert_allclose(means, np.broadcast_to(means[0], means.shape), atol=1e-9)


def test_finite_time_falls_back_until_the_network_is_whole(rounds, nets):
    """With somebody missing from the first round on, all rounds are Metropolis rounds; then the alarm ends."""
    net = nets["ring-8"]
    algorithm = FiniteTime().tuned(net, 20)
    values = np.random.default_rng(4).normal(size=(8, 2))
    _, nodes = rounds(net, algorithm, 20, values)
    for name in net.neighbors("A"):
        nodes[name].drop("A")
    stay = Graph.from_edges("BCDEFGH", [e for e in net.edges if "A" not in e])

    def frame(index, present):
        queue = [m for n in present.names for m in nodes[n].begin(index, values[net.names.index(n)])]
        while queue:
            message = queue.pop(0)
            for receiver in present.neighbors(message.sender):
                queue.extend(nodes[receiver].receive(message))
        return np.array([nodes[n].value for n in present.names])

    frame(1, stay)  # the alarm runs through the network
    found = frame(2, stay)
    expected, _ = rounds(stay, MetropolisWeights(), 20, values[1:])
    np.testing.assert_allclose(found, expected[-1], atol=1e-12)
    # everybody is back: the alarm dies out, and the rounds are exact again
    nodes["A"].cut()
    for name in net.neighbors("A"):
        nodes[name].restore("A")
    frame(3, net)
    np.testing.assert_allclose(frame(4, net), np.broadcast_to(values.mean(axis=0), (8, 2)), atol=1e-12)


@pytest.mark.usefixtures("unchecked")
def test_ratio_consensus_is_right_in_the_limit_under_loss(rounds):
    """Two hundred random graphs whose links lose three messages in ten."""
    rng = np.random.default_rng(12)
    worst = 0.0
    for _ in range(200):
        n = int(rng.integers(4, 11))
        names = [f"N{i}" for i in range(n)]
        tree = [(names[i], names[rng.integers(i)]) for i in range(1, n)]
        extra = [(a, b) for a, b in itertools.combinations(names, 2) if rng.random() < 0.2]
        net = Graph.from_edges(names, [*tree, *extra])
        values = rng.normal(size=(n, 1))
        history, _ = rounds(net, Ratio(), 300, values, loss=0.3, rng=rng)
        worst = max(worst, np.abs(history[-1].mean() - values.mean()))
    assert worst < 1e-6


def test_what_comes_late_serves_ratio_consensus(rounds):
    """A message that misses its round is taken in the next one; elsewhere it is old."""

    def says(round_, *payload):
        return ConsensusMessage("A", 0, round_, 1, np.array(payload))

    for algorithm, value, counted in (
        (Ratio(), 1.5, {"late": 1}),
        (MetropolisWeights(), 1.0, {"late": 1, "old": 1}),
    ):
        node = Consensus("M", ["A"], algorithm, 2)
        node.begin(0, np.array([1.0]))
        (second,) = node.expire()
        assert second.round == 2
        late = (2.0, 1.0) if algorithm == Ratio() else (2.0,)
        node.receive(says(1, *late))
        assert node.waiting_for() == ("A",)
        assert node.expire() == ()
        assert node.done
        assert node.counters["old"] == counted.get("old", 0)
        # M's mass: 1/4 of its own is left, [1, 1] / 4 + [2, 1]
        np.testing.assert_allclose(node.value, [(0.25 + 2) / 1.25] if algorithm == Ratio() else [value])


def test_event_triggered_sends_what_has_moved(rounds, net):
    values = np.random.default_rng(3).normal(size=(len(net.names), 5))
    history, _ = rounds(net, EventTriggered(threshold=1e-12), 12, values)
    plain, _ = rounds(net, MetropolisWeights(), 12, values)
    np.testing.assert_allclose(history, plain, atol=1e-10)
    history, _ = rounds(net, EventTriggered(threshold=0.05), 60, values)
    np.testing.assert_allclose(
        history.mean(axis=1), np.broadcast_to(values.mean(axis=0), (61, 5)), atol=1e-12
    )
    assert matrices.residual(history[-1], values) < 0.35


def test_a_node_that_has_nothing_to_say_says_nothing():
    silent = EventTriggered()
    state = silent.begin(np.zeros(3), None)
    assert silent.payload(state, 2).size == 0
    assert silent.payload(silent.begin(np.ones(3), None), 2).size == 3


@pytest.mark.parametrize("encoding", ["float32", "float16"])
@pytest.mark.parametrize("rounding", ["nearest", "stochastic"])
@pytest.mark.parametrize("name", sorted(ALL))
def test_rounded_payloads_keep_the_average(rounds, nets, name, encoding, rounding):
    net = nets["ring-8"]
    values = np.random.default_rng(3).normal(size=(8, 3)) * [1.0, 1e4, 1e-3]
    options = PayloadOptions(encoding=encoding, rounding=rounding)
    quantizers = {each: options.quantizer(1, each) for each in net.names}
    history, nodes = rounds(net, ALL[name](net).tuned(net, 30), 30, values, quantizers=quantizers)
    error = np.abs(history[-1] - values.mean(axis=0)).max(axis=0) / np.abs(values).max(axis=0)
    if name != "event_triggered":
        assert (error < {"float32": 1e-3, "float16": 0.05}[encoding]).all()
    if name == "ratio":
        masses = np.array([node._state.mass for node in nodes.values()])
        np.testing.assert_allclose(masses.sum(axis=0)[:-1], values.sum(axis=0), rtol=1e-9)
    else:
        np.testing.assert_allclose(history[-1].mean(axis=0), values.mean(axis=0), rtol=1e-9)
