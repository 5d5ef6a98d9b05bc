"""Ratio consensus with running sums: right in the limit whatever the links lose.

Source: Hadjicostis, Vaidya & Domínguez-García 2016, *Robust distributed average consensus via exchange of
running sums*; the ratio is push-sum's (Kempe, Dobra & Gehrke 2003), the robust version also in Silvestre et
al. Every node keeps a mass, its value with a weight of 1, and gives equal shares to itself and its
neighbours. It does not send shares but the sum of all that it has given so far in the frame: what a lost
message would have brought comes with the next one. Mass is neither made nor lost, only late, and value by
weight tends to the average.

Without losses the error shrinks by the second largest |eigenvalue| of the matrix of shares a round.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from network.averaging.algorithm import Algorithm, AlgorithmOptions, State, Vector
from network.graphs.graph import Graph
from network.wire.messages import ConsensusMessage


@dataclass(frozen=True, slots=True, eq=False)
class Masses(State):
    """A node's mass, and the running sums of its links; each vector ends in the weight.

    Attributes:
        mass: What the node holds.
        given: What it has given to each neighbour.
        taken: What it has taken from each neighbour.
    """

    mass: Float[np.ndarray, " M"]
    given: Float[np.ndarray, " M"]
    taken: Mapping[str, Float[np.ndarray, " M"]]


class Ratio(AlgorithmOptions):
    """Ratio consensus with running sums; it needs no knowledge of the graph."""

    algorithm: Literal["ratio"] = "ratio"
    """Shares with running sums: lost messages delay the average and do not change it."""

    uses_late: ClassVar[bool] = True

    def tuned(self, graph: Graph, iterations: int) -> Algorithm[Any]:
        """The algorithm itself."""
        return self

    def begin(self, value: Vector, last: Masses | None) -> Masses:
        """The node's own value with a weight of 1."""
        mass = np.append(value, 1.0)
        return Masses(value, mass, np.zeros_like(mass), {})

    def payload(self, state: Masses, degree: int) -> Vector:
        """All that each neighbour has been given, with this round's share."""
        return tuple((state.given + state.mass / (degree + 1)).tolist())

    def fits(self, state: Masses, message: ConsensusMessage) -> bool:
        """Whether it is as long as the node's own, and its weight has not shrunk."""
        sums, taken = message.payload, state.taken.get(message.sender)
        least = 0.0 if taken is None else taken[-1]
        return len(sums) == len(state.mass) and bool(sums[-1] >= least)

    def step(self, state: Masses, own: ConsensusMessage, received: Sequence[ConsensusMessage]) -> Masses:
        """Gives this round's shares, and takes what the sums have grown by."""
        given = np.array(own.payload)
        mass = state.mass - own.degree * (given - state.given)
        taken = dict(state.taken)
        for message in received:
            # ρ_lj(t) = σ_j; what was lost on the way is in it
            sums = np.array(message.payload)
            mass += sums - taken.get(message.sender, 0.0)
            taken[message.sender] = sums
        return Masses(tuple((mass[:-1] / mass[-1]).tolist()), mass, given, taken)
