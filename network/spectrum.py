"""The spectrum of a graph's Laplacian: what the fast averaging algorithms are tuned by.

It is a property of the whole graph, which no node can see from its place. The scenario knows the graph, so
that each node is given these numbers before the start.
"""

from dataclasses import dataclass

import numpy as np

from network.graph import Graph

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


def spectrum_of(graph: Graph) -> Spectrum:
    """The spectrum of a connected graph, by O(N³) steps for N nodes.

    Raises:
        ValueError: The graph is not connected.
    """
    graph.require_connected()
    values = np.linalg.eigvalsh(graph.laplacian())[1:]
    if not values.size:
        return Spectrum(())
    # each group of equal ones by its mean
    groups = np.split(values, np.flatnonzero(np.diff(values) > _SAME * values[-1]) + 1)
    return Spectrum(tuple(float(group.mean()) for group in groups))
