"""Finite-time averaging: exact after as many rounds as the Laplacian has distinct non-zero eigenvalues.

Source: Sundaram & Hadjicostis 2007 (the minimal polynomial of the weights); with one eigenvalue a round,
Kibangou 2012. In round k everybody moves by 1/λ_k: Π_k (I - L/λ_k) is the matrix of averaging, since every
eigenvector but that of the average meets its root once. On the way errors may grow, so the order of the roots
counts: Leja's (Reichel 1991) keeps them small.

It knows the whole spectrum, and is worth nothing on another graph. A node notices by the degrees in the
messages where somebody is missing, and says so: the remark runs through the network, a link a round, and
lives as long as its cause is there to repeat it. A link steps by 1/λ_k only where neither end has heard of
it, by the Metropolis weight otherwise. Either way both ends move alike and the average stays. Rounds beyond
those needed are Metropolis rounds, which repair what a change in mid-frame has spoiled.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from network.averaging.algorithm import Algorithm, AlgorithmOptions, State, Vector, metropolis_weight
from network.graphs.graph import Graph
from network.graphs.spectrum import spectrum_of
from network.wire.messages import ConsensusMessage


class FiniteTime(AlgorithmOptions):
    """Exact in finite time, from the whole spectrum of the scenario's graph."""

    algorithm: Literal["finite_time"] = "finite_time"
    """Exact after as many rounds as this graph's Laplacian has distinct non-zero eigenvalues."""

    def tuned(self, graph: Graph, iterations: int) -> Algorithm[Any]:
        """The finite-time rounds of this graph.

        Raises:
            ValueError: There are fewer rounds than the graph needs; unfinished, they promise nothing.
        """
        roots = roots_of(graph)
        if iterations < len(roots):
            raise ValueError(
                f"iterations = {iterations} is too few for finite_time, which needs {len(roots)} rounds on"
                " this graph: take as many or more, or the algorithm chebyshev"
            )
        degrees = {name: graph.degree(name) for name in graph.names}
        return TunedFiniteTime(tuple(roots.tolist()), degrees)


def roots_of(graph: Graph) -> Float[np.ndarray, " K"]:
    """One eigenvalue a round, in their order: as many as there are rounds to go."""
    return leja_order(np.array(spectrum_of(graph).eigenvalues))


@dataclass(frozen=True, slots=True, eq=False)
class Watchful(State):
    """A state that remembers whether the network is whole.

    Attributes:
        alarm: For how many rounds more the node takes it for incomplete, 0 if it is whole.
    """

    alarm: int


@dataclass(frozen=True, slots=True, eq=False)
class TunedFiniteTime:
    """Finite-time rounds on one graph; a payload is the value, and the alarm behind it if there is one.

    Attributes:
        roots: λ of each round.
        degrees: How many neighbours each node has.
    """

    roots: tuple[float, ...]
    degrees: Mapping[str, int]
    uses_late: ClassVar[bool] = False

    def begin(self, value: Vector, last: Watchful | None) -> Watchful:
        """The node's own value; an alarm lives on from frame to frame."""
        return Watchful(value, last.alarm if last else 0)

    def payload(self, state: Watchful, degree: int) -> Vector:
        """The value, and the alarm if there is one."""
        return (*state.value, float(state.alarm)) if state.alarm else state.value

    def fits(self, state: Watchful, message: ConsensusMessage) -> bool:
        """Whether it is as long as the node's own, or longer by an alarm."""
        return 0 <= len(message.payload) - len(state.value) <= 1

    def step(self, state: Watchful, own: ConsensusMessage, received: Sequence[ConsensusMessage]) -> Watchful:
        """A step by the round's root where the network is whole, a Metropolis step where it is not."""
        size = len(state.value)
        value, said = np.array(state.value), np.array(own.payload[:size])
        for message in received:
            # a_l(t) = a_l(t-1) + Σ_j (a_j(t-1) - a_l(t-1)) / λ_t
            if own.round <= len(self.roots) and not (self._alarm(own, size) or self._alarm(message, size)):
                weight = 1 / self.roots[own.round - 1]
            else:
                weight = metropolis_weight(own.degree, message.degree)
            value += weight * (np.array(message.payload[:size]) - said)
        # one round older, unless its cause repeats it
        heard = max((self._alarm(message, size) for message in (own, *received)), default=0)
        missing = len(received) < self.degrees[own.sender]
        return Watchful(tuple(value.tolist()), len(self.degrees) if missing else max(heard - 1, 0))

    def _alarm(self, message: ConsensusMessage, size: int) -> int:
        """How many rounds a message's alarm still lives; N at the most, in which it reaches everybody."""
        n = len(self.degrees)
        if message.degree != self.degrees[message.sender]:
            return n
        return min(max(round(message.payload[-1]), 0), n) if len(message.payload) > size else 0


def leja_order(points: Float[np.ndarray, " K"]) -> Float[np.ndarray, " K"]:
    """Points so that each is farthest from 0 and those before, by the product of distances (Reichel 1991).

    Args:
        points: Positive numbers.
    """
    order: list[int] = []
    # sums of logarithms, since the products leave the range of floats
    score = np.log(points)
    for _ in range(len(points)):
        order.append(int(np.argmax(score)))
        with np.errstate(divide="ignore"):
            score = score + np.log(np.abs(points - points[order[-1]]))
    return points[order]
