"""Consensus weights: how far a node moves towards a neighbour in one round.

A rule of weights knows the two degrees only, so that each node can work with what its neighbours' messages
carry. Rules are options: a scenario names one in ``network.consensus``.
"""

from abc import abstractmethod
from typing import Annotated, Literal

from pydantic import Field

from network.options import Options


class Weights(Options):
    """A rule for w_lj in a_l(t) = a_l(t-1) + Σ_j w_lj (a_j(t-1) - a_l(t-1))."""

    @abstractmethod
    def weight(self, own_degree: int, neighbor_degree: int) -> float:
        """The weight w_lj between a node and its neighbour, from how many neighbours each has.

        It must not change when the two are swapped: only then do the rounds preserve the average.
        """

    def require_convergence(self, max_degree: int) -> None:
        """Checks that the rounds converge to the average on every connected graph of this largest degree.

        Raises:
            ValueError: They may not; the message states the bound.
        """


class ConstantWeights(Weights):
    """The same weight ε for all neighbours (Eq. 3 of Jing & Chen)."""

    algorithm: Literal["constant"] = "constant"
    """Every neighbour has the same weight."""
    epsilon: float = Field(gt=0, allow_inf_nan=False)
    """Step towards each neighbour in a round, no unit; below 1 / (largest number of neighbours)."""

    def weight(self, own_degree: int, neighbor_degree: int) -> float:  # noqa: ARG002 - the rule that ignores them
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


class MetropolisWeights(Weights):
    """Weights from local degrees only (Xiao, Boyd & Kim 2007): they converge on every connected graph."""

    algorithm: Literal["metropolis"] = "metropolis"
    """Weights follow the number of neighbours at both ends of each link."""

    def weight(self, own_degree: int, neighbor_degree: int) -> float:
        """w_lj = 1 / (1 + max(d_l, d_j))."""
        return 1.0 / (1 + max(own_degree, neighbor_degree))


ConsensusOptions = Annotated[ConstantWeights | MetropolisWeights, Field(discriminator="algorithm")]
"""The choice of weights in a scenario; further algorithms join this union from modules of their own."""
