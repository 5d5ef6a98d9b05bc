"""Metropolis-Hastings weights: local degrees only (Xiao, Boyd & Kim 2007).

They converge on every connected graph, and go on doing so whoever leaves or comes. The error shrinks by the
second largest |eigenvalue| of W a round.
"""

from typing import Literal

from network.averaging.algorithm import metropolis_weight
from network.averaging.degree_weights import Weights


class MetropolisWeights(Weights):
    """Weights from local degrees only (Xiao, Boyd & Kim 2007): they converge on every connected graph."""

    algorithm: Literal["metropolis"] = "metropolis"
    """Weights follow the number of neighbours at both ends of each link."""

    def weight(self, own_degree: int, neighbor_degree: int) -> float:
        """w_lj = 1 / (1 + max(d_l, d_j))."""
        return metropolis_weight(own_degree, neighbor_degree)
