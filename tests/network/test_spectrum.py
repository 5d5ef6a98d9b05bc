"""Spectra against closed forms, and against networkx' numbers."""

import networkx as nx
import numpy as np
import pytest

from network.averaging.finite_time import leja_order
from network.graphs import graph
from network.graphs.graph import Graph
from network.graphs.spectrum import LARGEST_DENSE, extremes_of, spectrum_of

NAMES = tuple(f"{i:02}" for i in range(12))


@pytest.mark.parametrize("n", [3, 4, 7, 12])
def test_eigenvalues_are_the_closed_forms(n):
    names, k = NAMES[:n], np.arange(n)
    for made, known in (
        (graph.ring, 2 - 2 * np.cos(2 * np.pi * k / n)),
        (graph.path, 2 - 2 * np.cos(np.pi * k / n)),
        (graph.star, np.array([1.0, n])),
        (graph.complete, np.array([float(n)])),
    ):
        distinct = np.unique(known[known > 1e-9].round(12))
        np.testing.assert_allclose(spectrum_of(made(names)).eigenvalues, distinct, atol=1e-9)


def test_the_ends_are_those_of_networkx(net):
    known = nx.laplacian_spectrum(nx.Graph(sorted(net.edges)))
    spectrum = spectrum_of(net)
    np.testing.assert_allclose(spectrum.step, 2 / (known[1] + known[-1]))
    contraction = np.abs(1 - spectrum.step * known[1:]).max()
    np.testing.assert_allclose(spectrum.contraction, contraction, atol=1e-12)


def test_one_node_has_no_eigenvalue():
    spectrum = spectrum_of(graph.path("A"))
    assert (spectrum.eigenvalues, spectrum.contraction) == ((), 0.0)
    assert spectrum.step > 0


def test_a_graph_in_parts_has_no_average():
    with pytest.raises(ValueError, match=r"2 parts, A \| B"):
        spectrum_of(Graph.from_edges("AB", []))


def test_leja_order_takes_the_farthest_next():
    points = np.array([1.0, 2.0, 3.0, 4.0])
    # 4; then 2, since 2 |2-4| > 1 |1-4| = 3 |3-4|; then the first of 1 |1-4| |1-2| = 3 |3-4| |3-2|
    np.testing.assert_array_equal(leja_order(points), [4, 2, 1, 3])
    many = np.random.default_rng(0).random(12) + 0.01
    chosen = [0.0]
    while len(chosen) < 13:
        left = [point for point in many if point not in chosen]
        chosen.append(max(left, key=lambda point: np.prod(np.abs(point - np.array(chosen)))))
    np.testing.assert_array_equal(leja_order(many), chosen[1:])


def test_the_ends_of_a_large_grid_are_the_closed_form():
    n = 50
    names = [f"{i:04}" for i in range(n * n)]
    assert len(names) > LARGEST_DENSE
    found = extremes_of(graph.grid(names))
    largest = 4 - 4 * np.cos(np.pi * (n - 1) / n)
    np.testing.assert_allclose(found.eigenvalues, [2 - 2 * np.cos(np.pi / n), largest], rtol=1e-9)
    assert extremes_of(graph.grid(names)) == found


def test_the_ends_of_a_small_graph_are_those_of_its_spectrum():
    assert extremes_of(graph.ring(NAMES)) == spectrum_of(graph.ring(NAMES))


def test_all_eigenvalues_of_a_large_graph_are_refused():
    names = [f"{i:04}" for i in range(LARGEST_DENSE + 1)]
    with pytest.raises(ValueError, match="choose an algorithm that needs two of them"):
        spectrum_of(graph.path(names))
