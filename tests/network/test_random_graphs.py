"""Graphs by range and by chance, against networkx."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from network.graphs.random_graphs import geometric, watts_strogatz

NAMES = tuple(f"C{i}" for i in range(20))


def as_sets(edges):
    return {frozenset(edge) for edge in edges}


def renamed(known):
    return as_sets(nx.relabel_nodes(known, dict(enumerate(NAMES))).edges)


@given(st.integers(0, 2**32), st.floats(0.01, 1.5), st.integers(1, 3))
def test_who_is_within_range_is_linked(seed, range_m, n_axes):
    positions = np.random.default_rng(seed).random((20, n_axes))
    places = {i: tuple(place) for i, place in enumerate(positions)}
    known = nx.random_geometric_graph(20, range_m, pos=places)
    assert as_sets(geometric(NAMES, positions, range_m).edges) == renamed(known)


@pytest.mark.parametrize("neighbors", [2, 4, 6])
def test_a_small_world_without_chance_is_networkxs(neighbors):
    made = watts_strogatz(NAMES, neighbors, 0.0, np.random.default_rng(0))
    assert as_sets(made.edges) == renamed(nx.watts_strogatz_graph(20, neighbors, 0.0))


@given(st.integers(0, 2**32), st.floats(0, 1))
def test_chance_moves_links_and_makes_or_loses_none(seed, rewiring):
    made = watts_strogatz(NAMES, 4, rewiring, np.random.default_rng(seed))
    assert len(made.edges) == 40
    assert watts_strogatz(NAMES, 4, rewiring, np.random.default_rng(seed)) == made


def test_the_share_of_moved_links_and_the_clustering_are_networkxs():
    """Means over many draws, each within four standard errors of the other."""
    names = [f"N{i}" for i in range(60)]
    lattice = watts_strogatz(names, 4, 0.0, np.random.default_rng(0)).edges
    drawn = [watts_strogatz(names, 4, 0.2, np.random.default_rng(seed)) for seed in range(60)]
    moved = np.array([len(made.edges - lattice) for made in drawn])
    # a link in five, but for those few that come back to a place in the lattice
    assert abs(moved.mean() - 0.2 * 120) < 4 * np.sqrt(0.2 * 0.8 * 120 / 60) + 1
    ours = np.array([nx.average_clustering(nx.Graph(list(made.edges))) for made in drawn])
    known = [nx.average_clustering(nx.watts_strogatz_graph(60, 4, 0.2, seed)) for seed in range(60)]
    error = np.sqrt((ours.var() + np.var(known)) / 60)
    assert abs(ours.mean() - np.mean(known)) < 4 * error


def test_where_everybody_is_linked_nothing_can_move():
    made = watts_strogatz(NAMES[:3], 2, 1.0, np.random.default_rng(0))
    assert len(made.edges) == 3


@pytest.mark.parametrize("neighbors", [0, 3, 20, 22])
def test_neighbours_that_cannot_be_are_refused(neighbors):
    with pytest.raises(ValueError, match=f"cannot have {neighbors} nearest .* an even number from 2 to 19"):
        watts_strogatz(NAMES, neighbors, 0.1, np.random.default_rng(0))
