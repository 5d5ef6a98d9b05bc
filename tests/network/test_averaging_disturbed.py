"""Averaging algorithms in a network that changes, loses messages, falls silent or rounds its numbers."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from network.averaging import matrices
from network.averaging.best_constant import BestConstant
from network.averaging.chebyshev import Chebyshev
from network.averaging.constant import ConstantWeights
from network.averaging.event_triggered import EventTriggered, distance
from network.averaging.finite_time import FiniteTime
from network.averaging.metropolis import MetropolisWeights
from network.averaging.ratio import Ratio
from network.graphs import graph
from network.graphs.graph import Graph
from network.rounds.consensus import Consensus
from network.wire import codec
from network.wire.messages import ConsensusMessage
from network.wire.quantization import PayloadOptions, Quantizer

ALL = {
    "constant": lambda net: ConstantWeights(epsilon=0.9 / net.max_degree),
    "metropolis": lambda _: MetropolisWeights(),
    "best_constant": lambda _: BestConstant(),
    "chebyshev": lambda _: Chebyshev(),
    "finite_time": lambda _: FiniteTime(),
    "ratio": lambda _: Ratio(),
    "event_triggered": lambda _: EventTriggered(threshold=0.02),
}


def run_frame(nodes, net, index, values):
    """A later frame of nodes, those of a graph among them; nothing is lost."""
    queue = [
        m for name, value in zip(net.names, values, strict=True) for m in nodes[name].begin(index, value)
    ]
    while queue:
        message = queue.pop(0)
        for receiver in net.neighbors(message.sender):
            queue.extend(nodes[receiver].receive(message))
    return np.array([nodes[name].value for name in net.names])


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
    found = run_frame(nodes, net, 1, values)
    expected, _ = rounds(net, algorithm, 12, values)
    np.testing.assert_array_equal(found, expected[-1])


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
    """With somebody missing from the start, all rounds are Metropolis rounds; then the alarm ends."""
    net = nets["ring-8"]
    algorithm = FiniteTime().tuned(net, 20)
    values = np.random.default_rng(4).normal(size=(8, 2))
    _, nodes = rounds(net, algorithm, 20, values)
    for name in net.neighbors("A"):
        nodes[name].drop("A")
    stay = Graph.from_edges("BCDEFGH", [e for e in net.edges if "A" not in e])

    run_frame(nodes, stay, 1, values[1:])  # the alarm runs through the network
    found = run_frame(nodes, stay, 2, values[1:])
    expected, _ = rounds(stay, MetropolisWeights(), 20, values[1:])
    np.testing.assert_allclose(found, expected[-1], atol=1e-12)
    # everybody is back: the alarm dies out, and the rounds are exact again
    for name in net.neighbors("A"):
        nodes[name].restore("A")
    run_frame(nodes, net, 3, values)
    np.testing.assert_allclose(
        run_frame(nodes, net, 4, values), np.broadcast_to(values.mean(axis=0), (8, 2)), atol=1e-12
    )


@pytest.mark.usefixtures("unchecked")
def test_ratio_consensus_is_right_in_the_limit_under_loss(rounds):
    """Two hundred random graphs whose links lose three messages in ten."""
    rng = np.random.default_rng(12)
    worst = 0.0
    for _ in range(200):
        n = int(rng.integers(4, 9))
        names = [f"N{i}" for i in range(n)]
        tree = [(names[i], names[rng.integers(i)]) for i in range(1, n)]
        extra = [(a, b) for a, b in itertools.combinations(names, 2) if rng.random() < 0.2]
        net = Graph.from_edges(names, [*tree, *extra])
        values = rng.normal(size=(n, 1))
        history, _ = rounds(net, Ratio(), 200, values, loss=0.3, rng=rng)
        worst = max(worst, np.abs(history[-1].mean() - values.mean()))
    assert worst < 1e-6


def says(round_, *payload):
    return ConsensusMessage("A", 0, round_, 1, payload)


def test_what_comes_late_serves_ratio_consensus_in_the_next_round():
    node = Consensus("M", ["A"], Ratio(), 2)
    node.begin(0, np.array([1.0]))
    (second,) = node.expire()
    assert second.round == 2
    node.receive(says(1, 2.0, 1.0))
    assert node.waiting_for() == ("A",)
    assert node.expire() == ()
    assert node.done
    assert node.counters == {"missed": 2, "late": 1}
    # a quarter of M's mass [1, 1] is left, and A has given [2, 1]
    np.testing.assert_allclose(node.value, [(0.25 + 2) / (0.25 + 1)])


def test_what_comes_late_is_old_elsewhere():
    node = Consensus("M", ["A"], MetropolisWeights(), 2)
    node.begin(0, np.array([1.0]))
    node.expire()
    node.receive(says(1, 2.0))
    node.receive(says(2, 3.0))
    assert node.done
    assert node.counters == {"missed": 1, "old": 1}
    np.testing.assert_allclose(node.value, [2.0])
    assert node.expire() == ()


def test_a_weight_that_shrinks_is_refused():
    node = Consensus("M", ["A"], Ratio(), 2)
    node.begin(0, np.array([1.0]))
    node.receive(says(1, 2.0, 1.0))
    node.receive(says(2, 2.0, 0.5))
    assert node.counters == {"shape": 1}


def test_event_triggered_steps_are_metropolis_steps_where_everything_is_said(rounds, net):
    values = np.random.default_rng(3).normal(size=(len(net.names), 5))
    history, _ = rounds(net, EventTriggered(threshold=1e-12), 12, values)
    plain, _ = rounds(net, MetropolisWeights(), 12, values)
    np.testing.assert_allclose(history, plain, atol=1e-10)


@pytest.mark.usefixtures("unchecked")
def test_event_triggered_rounds_keep_the_average_and_end_in_silence(rounds, net):
    values = np.random.default_rng(3).normal(size=(len(net.names), 5))
    residuals = []
    for threshold in (0.2, 0.05, 0.01):
        history, nodes = rounds(net, EventTriggered(threshold=threshold), 150, values)
        means = np.broadcast_to(values.mean(axis=0), (151, 5))
        np.testing.assert_allclose(history.mean(axis=1), means, atol=1e-12)
        residuals.append(matrices.residual(history[-1], values))
        assert sum(bool(node._said.payload) for node in nodes.values()) <= 0.25 * len(nodes)
    assert residuals == sorted(residuals, reverse=True)
    assert residuals[-1] < 0.05


def test_distances_are_relative_to_what_was_said():
    one, other, scale = np.array([3.0, 0.0, 10.0]), np.array([1.0, 0.0, 40.0]), np.array([4.0, 0.0, 100.0])
    assert distance(one, other, scale) == pytest.approx(np.sqrt((0.5**2 + 0.3**2) / 3))
    assert distance(one[:0], one[:0], one[:0]) == 0


def test_a_node_that_has_nothing_to_say_says_nothing():
    silent = EventTriggered()
    state = silent.begin((0.0, 0.0, 0.0), None)
    assert silent.payload(state, 2) == ()
    assert silent.payload(silent.begin((1.0, 1.0, 1.0), None), 2) == (1.0, 1.0, 1.0)


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


@pytest.mark.parametrize("name", ALL)
@settings(max_examples=30)
@given(st.data())
def test_nonsense_from_neighbours_breaks_no_node(name, data):
    """Whatever valid numbers come, in whatever order: what the node says can be written."""
    net = graph.star("MAB")
    encoding = data.draw(st.sampled_from(["float64", "float32"]))
    node = Consensus("M", "AB", ALL[name](net).tuned(net, 5), 5, Quantizer(encoding))
    numbers = st.sampled_from([0.0, 1.0, -1e-150, 1e150, -1e150]) | st.floats(-1e150, 1e150)
    said = list(node.begin(0, np.ones(2)))
    for _ in range(20):
        match data.draw(st.integers(0, 5)):
            case 0:
                said += node.expire()
            case 1:
                said += node.drop(data.draw(st.sampled_from("AB")))
            case _:
                payload = tuple(data.draw(st.lists(numbers, max_size=4)))
                at, degree = data.draw(st.integers(1, 6)), data.draw(st.integers(0, 2**16 - 1))
                sender = data.draw(st.sampled_from("AB"))
                said += node.receive(ConsensusMessage(sender, 0, at, degree, payload))
    for message in said:
        assert codec.decode(ConsensusMessage, "run", "M", codec.encode("run", message)) == message
    assert np.isfinite(node.value).all()
