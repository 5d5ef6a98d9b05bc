"""Convergence on a scenario's graph: the real rounds over the network in memory, against theory."""

import itertools

import numpy as np
import pytest

from network.averaging import matrices
from network.averaging.metropolis import MetropolisWeights
from network.graphs import graph
from network.rounds.consensus import Consensus
from network.wire.messages import EstimateMessage
from sim.pictures.convergence import plot_convergence
from sim.results.convergence import ALGORITHMS, EXACT, average, converge
from sim.scenario.loading import load_scenario


def found(small, *overrides, algorithms=ALGORITHMS, rounds=None):
    return dict(converge(load_scenario(small, overrides), algorithms, rounds))


@pytest.mark.parametrize("shape", ["ring", "path", "star", "complete"])
def test_what_is_measured_is_theory(small, shape):
    for name, each in found(small, ("network.graph", shape), rounds=12).items():
        assert len(each.residual) == 12
        if each.expected is not None:
            np.testing.assert_allclose(each.residual, each.expected, rtol=1e-3, atol=1e-12)
        if name != "event_triggered" and each.residual[3] > 1e-9:
            assert each.rate == pytest.approx(each.theory, rel=0.02, abs=0.02)


def test_finite_time_has_the_rounds_that_it_needs(small):
    path = ("network.graph", "path")
    assert all(len(each.residual) == 3 for each in found(small, path).values())
    one = found(small, path, ("network.iterations", "1"))
    assert all(len(each.residual) == 3 for each in one.values())
    assert one["finite_time"].residual[-1] < 1e-12
    assert one["finite_time"].rate == 0
    assert len(found(small, path, ("network.iterations", "1"), algorithms=("ratio",))["ratio"].residual) == 1
    # those of a whole run, of which one is looked at
    assert found(small, path, algorithms=("finite_time",), rounds=1)["finite_time"].residual[0] > 0.1


@pytest.mark.parametrize(("encoding", "unit"), [("float16", 2.0**-11), ("float32", 2.0**-24)])
@pytest.mark.parametrize("shape", ["ring", "path"])
def test_rounded_payloads_converge_as_theory_down_to_their_rounding(small, shape, encoding, unit):
    """On unit vectors of a ring, whose numbers are powers of two, float16 rounds nothing: of no others."""
    rounded = found(
        small,
        ("network.graph", shape),
        ("network.payload.encoding", encoding),
        algorithms=("metropolis", "best_constant", "chebyshev", "finite_time"),
        rounds=120,
    )
    for name, each in rounded.items():
        assert each.expected is None
        assert EXACT < each.residual[-1] < 4 * unit
        if name == "finite_time":
            assert each.rate < 0.1
        else:
            assert each.rate == pytest.approx(each.theory, rel=0.05)


def test_bytes_are_counted_on_the_scenarios_own_vectors(small):
    eight = found(small, algorithms=("metropolis", "ratio"))
    # four nodes with two neighbours each; 24 bytes and five numbers, one more for ratio's weight
    assert eight["metropolis"].bytes_per_round == 8 * (24 + 5 * 8)
    assert eight["ratio"].bytes_per_round == 8 * (24 + 6 * 8)
    four = found(small, ("network.payload.encoding", "float32"), algorithms=("metropolis",))
    assert four["metropolis"].bytes_per_round == 8 * (24 + 5 * 4)
    two = found(small, ("network.payload.encoding", "float16"), algorithms=("metropolis",))
    assert two["metropolis"].bytes_per_round == 8 * (24 + 2 + 5 * 2)
    paper = found(small, ("preset", "paper"), algorithms=("constant",))
    assert paper["constant"].bytes_per_round == 8 * (24 + 28 * 8)


def test_a_chosen_algorithm_keeps_its_options(small):
    chosen = found(
        small, ("network.consensus", "{algorithm: constant, epsilon: 0.1}"), algorithms=("constant",)
    )
    assert chosen["constant"].theory == pytest.approx(0.8)
    papers = found(small, algorithms=("constant",))
    assert papers["constant"].theory == pytest.approx(np.abs(1 - 0.325 * np.array([2, 4])).max())
    # with four neighbours the paper's 0.325 does not converge, 1 / (1 + 4) does
    text = small.read_text()
    line = next(line for line in text.splitlines() if "{name: A," in line)
    small.write_text(text.replace(line, line + "\n" + line.replace("name: A", "name: E").replace("-5", "-4")))
    crowded = found(small, ("network.graph", "star"), algorithms=("constant",))
    assert crowded["constant"].theory == pytest.approx(0.8)


def test_averages_are_those_of_the_matrix():
    net = graph.grid("ABCDEFGH")
    values = np.random.default_rng(0).normal(size=(8, 3))
    nodes = {name: Consensus(name, net.neighbors(name), MetropolisWeights(), 9) for name in net.names}
    history, sent = average("run", net, nodes, values)
    L = matrices.metropolis_laplacian(net)
    expected = list(itertools.islice(matrices.linear(L, values), 10))
    np.testing.assert_allclose(history, expected, atol=1e-12)
    power = np.linalg.matrix_power(np.eye(8) - L.toarray(), 9)
    np.testing.assert_allclose(history[-1], power @ values, atol=1e-12)
    assert sent == 9 * 2 * len(net.edges) * (24 + 3 * 8)


def test_the_figure_tells_of_every_algorithm(small):
    figure = plot_convergence("ring", found(small, rounds=12))
    (axes,) = figure.axes
    labels = axes.get_legend_handles_labels()[1]
    names = [name.replace("_", " ") for name in ALGORITHMS]
    assert [label.splitlines()[0].removesuffix(", one start") for label in labels[:-1]] == names
    assert "theory 0.333" in labels[1]
    low, _ = axes.get_ylim()
    marks = [line for line in axes.get_lines() if line.get_label() in labels[:-1]]
    assert all((line.get_ydata() >= low).all() for line in marks)
    # what is exact lies on the axis' foot
    assert marks[ALGORITHMS.index("finite_time")].get_ydata()[-1] == low
    assert [text.get_text() for text in axes.texts] == ["exact"]


def test_the_figure_calls_nothing_exact_that_was_rounded(small):
    (axes,) = plot_convergence("ring", found(small, ("network.payload.encoding", "float16"))).axes
    assert not axes.texts
    labels = axes.get_legend_handles_labels()[1][:-1]
    assert all(label.splitlines()[0].endswith(", one start") for label in labels)


def test_there_is_no_figure_of_nothing():
    with pytest.raises(ValueError, match="there is no algorithm to plot"):
        plot_convergence("ring", {})


CHOICES = {
    "best_constant": [],
    "chebyshev": [("network.payload.encoding", "float32")],
    "finite_time": [],
    "ratio": [],
    "event_triggered": [("network.payload", "{encoding: float16, rounding: stochastic}")],
}


@pytest.mark.parametrize(("algorithm", "more"), CHOICES.items(), ids=CHOICES)
def test_whole_runs_average_as_they_are_told(small, told, algorithm, more):
    """The nodes of a ring agree after twelve rounds as well as their algorithm can."""
    overrides = [("network.iterations", "12"), ("network.consensus", f"{{algorithm: {algorithm}}}"), *more]

    messages = [each for each in told(small, *overrides) if isinstance(each, EstimateMessage)]

    fused = [each for each in messages if each.estimator == "dcpf"]
    assert len(fused) == 6 * 4
    assert all(each.iterations == 12 for each in fused)
    last = np.array([each.mean[:2] for each in fused if each.frame == 5])
    truth = np.array([0.0, 0.75])
    # each node has particles of its own, forty of them
    assert np.abs(last - truth).max() < 0.5
    again = [each for each in told(small, *overrides) if isinstance(each, EstimateMessage)]
    np.testing.assert_array_equal([each.mean for each in again], [each.mean for each in messages])
