"""Constant ε: the paper's rule (Eq. 3 of Jing & Chen; Olfati-Saber, Fax & Murray 2007).

On a graph with Laplacian L the error shrinks by max |1 - ελ| a round over L's non-zero eigenvalues λ.
"""

from typing import Literal

from pydantic import Field

from network.averaging.degree_weights import Weights


class ConstantWeights(Weights):
    """The same weight ε for all neighbours (Eq. 3 of Jing & Chen)."""

    algorithm: Literal["constant"] = "constant"
    """Every neighbour has the same weight."""
    epsilon: float = Field(gt=0, allow_inf_nan=False)
    """Step towards each neighbour in a round, no unit; below 1 / (largest number of neighbours)."""

    def weight(self, own_degree: int, neighbor_degree: int) -> float:
        """ε, whatever the degrees."""
        return self.epsilon

    def require_convergence(self, max_degree: int) -> None:
        """ε < 1 / max_degree: each round is then a convex combination that keeps some of a node's own value.

        Raises:
            ValueError: ε is not below the bound, which the message states.
        """
        if self.epsilon * max_degree >= 1:
            raise ValueError(
                f"epsilon = {self.epsilon:g} may not converge where a node has {max_degree} neighbours:"
                f" take it below 1/{max_degree} = {1 / max_degree:.3g}, or the metropolis weights"
            )
