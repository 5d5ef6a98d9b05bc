"""Graphs against networkx, which the package itself does without."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from network.graphs import graph
from network.graphs.graph import Graph

NAMES = tuple(f"C{i}" for i in range(12))


def names_of(count):
    return NAMES[:count]


def reference(made):
    known = nx.Graph()
    known.add_nodes_from(made.names)
    known.add_edges_from(made.edges)
    return known


@pytest.mark.parametrize("count", [3, 4, 7])
@pytest.mark.parametrize(
    ("build", "known"),
    [
        (graph.ring, nx.cycle_graph),
        (graph.path, nx.path_graph),
        (graph.star, lambda n: nx.star_graph(n - 1)),
        (graph.complete, nx.complete_graph),
    ],
)
def test_shapes_equal_those_of_networkx(build, known, count):
    made = build(names_of(count))
    expected = nx.relabel_nodes(known(count), dict(enumerate(NAMES)))
    assert {frozenset(edge) for edge in made.edges} == {frozenset(edge) for edge in expected.edges}


def test_grid_equals_that_of_networkx():
    expected = nx.grid_2d_graph(3, 4)
    labels = {(row, column): NAMES[4 * row + column] for row, column in expected}
    made = {frozenset(edge) for edge in graph.grid(NAMES).edges}
    assert made == {frozenset(edge) for edge in nx.relabel_nodes(expected, labels).edges}


@settings(deadline=None)
@given(st.integers(0, 12), st.sampled_from([graph.ring, graph.path, graph.complete, graph.grid]))
def test_shapes_are_connected_whatever_their_size(count, build):
    made = build(names_of(count))
    made.require_connected()
    assert len(made.components()) == min(count, 1)
    assert made.max_degree == max((degree for _, degree in reference(made).degree), default=0)


def test_small_rings_have_no_double_edges():
    assert graph.ring(("A",)).edges == frozenset()
    assert graph.ring(("A", "B")).edges == {("A", "B")}


@settings(deadline=None)
@given(st.sets(st.tuples(st.sampled_from(NAMES), st.sampled_from(NAMES)).filter(lambda e: e[0] != e[1])))
def test_any_graph_against_networkx(edges):
    made = Graph.from_edges(NAMES, edges)
    known = reference(made)
    assert {frozenset(part) for part in made.components()} == {
        frozenset(part) for part in nx.connected_components(known)
    }
    np.testing.assert_array_equal(
        made.laplacian(), nx.laplacian_matrix(known, nodelist=NAMES).toarray().astype(float)
    )
    for name in NAMES:
        assert made.neighbors(name) == tuple(sorted(known.neighbors(name)))
        assert made.degree(name) == known.degree(name)


def test_neighbors_are_sorted_by_name_not_by_place():
    assert Graph.from_edges(["C", "A", "B"], [("B", "C"), ("C", "A")]).neighbors("C") == ("A", "B")


@pytest.mark.parametrize(
    ("names", "edges", "message"),
    [
        (["A", "B"], [("A", "Z")], "edge A-Z names Z, which is no node; nodes: A, B"),
        (["A", "B"], [("A", "A")], "edge A-A joins a node to itself"),
        (["A", "B", "A"], [], "node A is in the graph twice"),
    ],
)
def test_wrong_edges_are_named(names, edges, message):
    with pytest.raises(ValueError, match=message):
        Graph.from_edges(names, edges)


def test_parts_are_named():
    with pytest.raises(ValueError, match=r"2 parts, A, C \| B: add edges"):
        Graph.from_edges(["A", "B", "C"], [("A", "C")]).require_connected()


def test_unknown_node_is_named():
    with pytest.raises(ValueError, match="Z is no node of the graph; nodes: A, B"):
        graph.path(["A", "B"]).neighbors("Z")


def test_of_many_parts_the_first_are_named():
    names = [f"{i:03}" for i in range(300)]
    net = Graph(tuple(names), graph.path(names[:100]).edges)
    with pytest.raises(ValueError, match=r"falls into 201 parts, 000, 001, .*, 011, 88 more") as wrong:
        net.require_connected()
    assert "| 189 more: add edges that join them" in str(wrong.value)
