"""The Laplacian of a large graph, as a sparse matrix. It needs SciPy, which node processes do not import."""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from network.graphs.graph import Graph


def laplacian(graph: Graph, weight: Callable[[int, int], float] = lambda *_: 1.0) -> sparse.csr_array:
    """The Laplacian of a graph whose edges are weighted by the degrees at their ends.

    Args:
        graph: The graph.
        weight: An edge's weight, from the degrees at its ends.
    """
    row = {name: index for index, name in enumerate(graph.names)}
    degrees = [graph.degree(name) for name in graph.names]
    edges = np.array([(row[a], row[b]) for a, b in sorted(graph.edges)], dtype=int).reshape(-1, 2)
    weights = np.array([weight(degrees[i], degrees[j]) for i, j in edges])
    n = len(row)
    across = sparse.coo_array((weights, edges.T), shape=(n, n)).tocsr()
    across = across + across.T
    return sparse.csr_array(sparse.diags_array(across.sum(axis=1)) - across)
