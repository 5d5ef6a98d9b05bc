"""The linear iteration whose weights follow from the two degrees alone, which the messages carry."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

from network.averaging.algorithm import Algorithm, AlgorithmOptions, State, Vector
from network.graphs.graph import Graph
from network.wire.messages import ConsensusMessage


class Weights(AlgorithmOptions):
    """A rule for w_lj in a_l(t) = a_l(t-1) + Σ_j w_lj (a_j(t-1) - a_l(t-1)) (Eq. 3 of Jing & Chen)."""

    uses_late: ClassVar[bool] = False

    @abstractmethod
    def weight(self, own_degree: int, neighbor_degree: int) -> float:
        """The weight w_lj between a node and its neighbour, from how many neighbours each has.

        It must not change when the two are swapped: only then do the rounds preserve the average.
        """

    def tuned(self, graph: Graph, iterations: int) -> Algorithm[Any]:
        """The rule itself: it needs to know nothing of the graph."""
        return self

    def begin(self, value: Vector, last: State | None) -> State:
        """The node's own value."""
        return State(value)

    def payload(self, state: State, degree: int) -> Vector:
        """The value."""
        return state.value

    def fits(self, state: State, message: ConsensusMessage) -> bool:
        """Whether it is as long as the node's own."""
        return len(message.payload) == len(state.value)

    def step(self, state: State, own: ConsensusMessage, received: Sequence[ConsensusMessage]) -> State:
        """A step towards every neighbour."""
        value: Sequence[float] = state.value
        for message in received:
            weight = self.weight(own.degree, message.degree)
            # a_l(t) = a_l(t-1) + Σ_j w_lj (a_j(t-1) - a_l(t-1))
            terms = zip(value, message.payload, own.payload)  # noqa: B905 - of one length, by `fits`
            value = [a + weight * (b - c) for a, b, c in terms]
        return State(tuple(value))
