"""Averaging algorithms in a whole network: the real rounds against theory, on the graphs they must master."""

import itertools

import numpy as np
import pytest
from scipy import sparse

from network.averaging import matrices
from network.averaging.best_constant import BestConstant
from network.averaging.chebyshev import Chebyshev
from network.averaging.constant import ConstantWeights
from network.averaging.finite_time import FiniteTime, leja_order
from network.averaging.metropolis import MetropolisWeights
from network.averaging.ratio import Ratio
from network.graphs import graph
from network.graphs.spectrum import spectrum_of


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


@pytest.mark.parametrize("name", [*THEORY, "finite_time"])
@pytest.mark.parametrize("dense", [0, np.inf])
def test_all_rounds_at_once_are_the_rounds_one_by_one(monkeypatch, net, name, dense):
    monkeypatch.setattr(matrices, "_DENSE", dense)
    # information and its vector: numbers of all sizes
    scale = [1e-3, 1.0, 1e6]
    values = scale * np.random.default_rng(3).normal(size=(len(net.names), 3))
    made = THEORY[name][0](net) if name in THEORY else FiniteTime()
    for iterations in (0, 1, 12, 33):
        expected = next(itertools.islice(matrix_rounds(name, net, values), iterations, None))
        found = matrices.averaging(made, net, iterations)(values)
        np.testing.assert_allclose(found / scale, expected / scale, atol=1e-13)


def test_a_large_network_takes_its_rounds_one_by_one_however_many_they_are(monkeypatch, net):
    monkeypatch.setattr(matrices, "_SMALL", len(net.names) - 1)
    monkeypatch.setattr(np, "eye", lambda _: pytest.fail("a full matrix was made"))
    matrices.averaging(MetropolisWeights(), net, 1000)


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
    many = np.random.default_rng(3).normal(size=(2, 5, 4, 3))
    expected = [
        np.linalg.norm(x - x0.mean(axis=0)) / np.linalg.norm(x0 - x0.mean(axis=0))
        for x, x0 in zip(*many, strict=True)
    ]
    np.testing.assert_allclose(matrices.residual(*many), expected)
