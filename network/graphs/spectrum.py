"""The spectrum of a graph's Laplacian: what the fast averaging algorithms are tuned by.

It is a property of the whole graph, which no node can see from its place. The scenario knows the graph, so
that each node is given these numbers before the start.
"""

from dataclasses import dataclass

import numpy as np

from network.graphs.graph import Graph

LARGEST_DENSE = 1500
"""Nodes up to which all eigenvalues are worked out, in some seconds."""
_SAME = 1e-9  # of the largest eigenvalue: closer ones are one, split by rounding


@dataclass(frozen=True, slots=True)
class Spectrum:
    """The distinct non-zero eigenvalues of a connected graph's Laplacian.

    Attributes:
        eigenvalues: In rising order; none where there is one node only.
    """

    eigenvalues: tuple[float, ...]

    @property
    def step(self) -> float:
        """2 / (λ₂ + λ_N): the constant weight under which the error shrinks fastest (Xiao & Boyd 2004)."""
        if not self.eigenvalues:
            return 1.0  # nobody to step towards
        return 2 / (self.eigenvalues[0] + self.eigenvalues[-1])

    @property
    def contraction(self) -> float:
        """(λ_N - λ₂) / (λ_N + λ₂): what that weight leaves of the error in a round."""
        if not self.eigenvalues:
            return 0.0
        smallest, largest = self.eigenvalues[0], self.eigenvalues[-1]
        return (largest - smallest) / (largest + smallest)


def extremes_of(graph: Graph) -> Spectrum:
    """The smallest non-zero and the largest eigenvalue, all that a step and its contraction follow from.

    Of many nodes by Lanczos iterations on the sparse matrix, which takes about O(N) steps.

    Raises:
        ValueError: The graph is not connected.
    """
    if len(graph.names) <= LARGEST_DENSE:
        return spectrum_of(graph)
    graph.require_connected()
    # SciPy takes its time to import, and node processes do without.
    from scipy.sparse.linalg import eigsh  # noqa: PLC0415 - see above

    from network.graphs.laplacian import laplacian  # noqa: PLC0415 - so does this

    L = laplacian(graph)
    start = np.cos(np.arange(len(graph.names)))  # any fixed one, so that the numbers repeat
    (largest,) = eigsh(L, k=1, which="LA", v0=start, return_eigenvectors=False)
    # λ₂ lies next to the 0 of the constant vector: both are the nearest to a point just below
    _, smallest = np.sort(
        eigsh(L.tocsc(), k=2, sigma=-1e-3 * largest / len(graph.names), v0=start, return_eigenvectors=False)
    )
    return Spectrum((float(smallest), float(largest)))


def spectrum_of(graph: Graph) -> Spectrum:
    """The whole spectrum of a connected graph, by O(N³) steps for N nodes.

    Raises:
        ValueError: The graph is not connected, or too large.
    """
    graph.require_connected()
    if len(graph.names) > LARGEST_DENSE:
        raise ValueError(
            f"all eigenvalues of {len(graph.names)} nodes, more than {LARGEST_DENSE}, take too long:"
            " choose an algorithm that needs two of them, such as chebyshev"
        )
    values = np.linalg.eigvalsh(graph.laplacian())[1:]
    if not values.size:
        return Spectrum(())
    # each group of equal ones by its mean
    groups = np.split(values, np.flatnonzero(np.diff(values) > _SAME * values[-1]) + 1)
    return Spectrum(tuple(float(group.mean()) for group in groups))
