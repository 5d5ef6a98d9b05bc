"""The interface of all averaging algorithms: a node's state, what it says of it, and one round's step.

An algorithm is a frozen value, the same in all nodes, of pure functions: it knows no neighbour that a message
does not name and no network but the one it was tuned to. Rounds, deadlines and who takes part are the affair
of `network.rounds`. What an algorithm sends may be rounded on its way: in a step, a node's own message
stands for its state as the others know it, so that both ends of a link move by the same amount.
"""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol, TypeVar, runtime_checkable

from network.graphs.graph import Graph
from network.options import Options
from network.wire.messages import ConsensusMessage

Vector = tuple[float, ...]
"""Numbers as messages carry them; of a handful, sums take half the time that they take as arrays."""


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """What a node carries from round to round; algorithms that remember more extend it.

    Attributes:
        value: Its estimate of the average.
    """

    value: Vector


_State = TypeVar("_State", bound="State")


@runtime_checkable
class Algorithm(Protocol[_State]):
    """A way to average. All methods are pure."""

    @property
    def uses_late(self) -> bool:
        """Whether a message that comes after its round still serves."""

    def begin(self, value: Vector, last: _State | None) -> _State:
        """The state in which a node begins a frame.

        Args:
            value: The node's own value.
            last: Its state at the end of the frame before, None before the first.
        """

    def payload(self, state: _State, degree: int) -> Vector:
        """What the node sends in the round that it enters; its length depends on the algorithm.

        Args:
            state: The node's state.
            degree: How many neighbours it has in this round.
        """

    def fits(self, state: _State, message: ConsensusMessage) -> bool:
        """Whether a neighbour's message can be used in this frame."""

    def step(self, state: _State, own: ConsensusMessage, received: Sequence[ConsensusMessage]) -> _State:
        """One round.

        Args:
            state: The node's state.
            own: What it said in this round.
            received: What its neighbours said, in the order of their names; some may be missing.
        """


class AlgorithmOptions(Options):
    """What a scenario says of an algorithm: its name and its options."""

    def require_convergence(self, max_degree: int) -> None:
        """Checks that the rounds converge to the average on every connected graph of this largest degree.

        Raises:
            ValueError: They may not; the message states the bound.
        """

    @abstractmethod
    def tuned(self, graph: Graph, iterations: int) -> Algorithm[Any]:
        """The algorithm with what it needs to know of the graph.

        Args:
            graph: The network, connected.
            iterations: Rounds in each frame.

        Raises:
            ValueError: The algorithm needs more rounds.
        """


@lru_cache
def metropolis_weight(own_degree: int, neighbor_degree: int) -> float:
    """w_lj = 1 / (1 + max(d_l, d_j)) (Xiao, Boyd & Kim 2007)."""
    return 1.0 / (1 + max(own_degree, neighbor_degree))
