"""Graphs of a shape that chance or places decide: who is near enough, and small worlds."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from network.graphs.graph import Edge, Graph


def geometric(names: Sequence[str], positions: Float[np.ndarray, "C A"], range_m: float) -> Graph:
    """Nodes that hear each other over their radio: those within a range. Nodes at random give a random graph.

    Args:
        names: The nodes.
        positions: Where they are, in metres.
        range_m: The largest distance between two that are linked.
    """
    edges: list[Edge] = []
    for i, name in enumerate(names):
        distances = np.linalg.norm(positions[i + 1 :] - positions[i], axis=1)
        edges += [(name, names[i + 1 + j]) for j in np.flatnonzero(distances <= range_m).tolist()]
    return Graph.from_edges(names, edges)


def watts_strogatz(names: Sequence[str], neighbors: int, rewiring: float, rng: np.random.Generator) -> Graph:
    """A small world: a ring of near neighbours, some links of which lead anywhere (Watts & Strogatz 1998).

    Args:
        names: The nodes, in the order of the ring.
        neighbors: How many of the nearest each is linked to, even and less than the nodes.
        rewiring: The share of links whose far end is drawn anew.
        rng: Where chance comes from.

    Raises:
        ValueError: The neighbours are odd, or as many as the nodes.
    """
    n = len(names)
    if neighbors % 2 or not 0 < neighbors < n:
        raise ValueError(
            f"each of {n} nodes cannot have {neighbors} nearest neighbours on a ring:"
            f" take an even number from 2 to {n - 1}"
        )
    linked = {frozenset((i, (i + step) % n)) for step in range(1, neighbors // 2 + 1) for i in range(n)}
    for step in range(1, neighbors // 2 + 1):
        for i in range(n):
            if rng.random() >= rewiring:
                continue
            # each link keeps its near end; the far one goes to a node that the near one is not linked to
            free = [j for j in range(n) if j != i and frozenset((i, j)) not in linked]
            if free:
                linked.remove(frozenset((i, (i + step) % n)))
                linked.add(frozenset((i, free[rng.integers(len(free))])))
    return Graph.from_edges(names, [(names[min(pair)], names[max(pair)]) for pair in linked])
