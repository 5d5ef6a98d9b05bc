"""Event-triggered averaging: a node says its value only when it has moved since it last did.

Source: Seyboth, Dimarogonas & Johansson 2013. Both ends of a link use the values last said, so that they move
alike and the average stays, whoever is silent. The steps are Metropolis steps; the error shrinks like theirs
down to a floor that the threshold sets. A link whose ends have said nothing new and are near each other
rests: without that, what little they differ by would move them on, round by round, until they have to speak.

The distance of two vectors is the root mean square over their places, each relative to the largest magnitude
that has been said there in this frame: places may differ in their units. For information matrices on A axes,
that is an equivalent of a threshold on the Kullback-Leibler divergence: between Gaussians with Λ and (1 + δ)Λ
it is ½ A (δ - ln(1 + δ)), about A δ² / 4.

A silent round is a message without numbers, since only a message tells silence from loss. A node whose value
is zero, such as a camera that sees nothing, has nothing to say until it hears something. Where a message with
numbers is lost, the two ends differ until the next one: on links that lose, take `ratio`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from network.averaging.algorithm import Algorithm, AlgorithmOptions, State, Vector, metropolis_weight
from network.graphs.graph import Graph
from network.wire.messages import ConsensusMessage

_REST = 2.0
"""Thresholds by which the ends of a link that rests may differ."""


@dataclass(frozen=True, slots=True, eq=False)
class Voice:
    """What a node has said in this frame.

    Attributes:
        last: Its value as it last said it; zeros before.
        peak: The largest magnitude that it has said, place by place.
    """

    last: Float[np.ndarray, " K"]
    peak: Float[np.ndarray, " K"]

    def after(self, payload: Vector) -> "Voice":
        """The same after a message, which may be silent."""
        if not payload:
            return self
        last = np.array(payload)
        return Voice(last, np.maximum(self.peak, np.abs(last)))


@dataclass(frozen=True, slots=True, eq=False)
class Talk(State):
    """A state with what has been said of it, and heard.

    Attributes:
        own: What the node has said.
        heard: What each neighbour has said.
    """

    own: Voice
    heard: Mapping[str, Voice]


class EventTriggered(AlgorithmOptions):
    """Metropolis steps on values that are sent only when they have moved."""

    algorithm: Literal["event_triggered"] = "event_triggered"
    """A node sends its value only when it has moved; weights as in `metropolis`."""
    threshold: float = Field(default=0.2, gt=0, lt=1)
    """How far a value must have moved to be sent, relative to the largest said or heard in this frame; for an
    information matrix on A axes about A threshold² / 4 nats."""

    uses_late: ClassVar[bool] = False

    def tuned(self, graph: Graph, iterations: int) -> Algorithm[Any]:
        """The algorithm itself."""
        return self

    def begin(self, value: Vector, last: Talk | None) -> Talk:
        """The node's own value, of which nobody has heard."""
        return Talk(value, _silent(value), {})

    def payload(self, state: Talk, degree: int) -> Vector:
        """The value if it has moved, nothing otherwise."""
        value = np.array(state.value)
        peaks = [np.abs(value), state.own.peak, *(voice.peak for voice in state.heard.values())]
        moved = distance(value, state.own.last, np.max(peaks, axis=0)) > self.threshold
        return state.value if moved else ()

    def fits(self, state: Talk, message: ConsensusMessage) -> bool:
        """Whether it is as long as the node's own, or empty."""
        return len(message.payload) in (len(state.value), 0)

    def step(self, state: Talk, own: ConsensusMessage, received: Sequence[ConsensusMessage]) -> Talk:
        """A step towards what every neighbour last said, over the links that do not rest."""
        here = state.own.after(own.payload)
        value, heard = np.array(state.value), dict(state.heard)
        for message in received:
            there = heard.get(message.sender, _silent(state.value)).after(message.payload)
            heard[message.sender] = there
            news = own.payload or message.payload
            apart = distance(there.last, here.last, np.maximum(there.peak, here.peak))
            if news or apart > _REST * self.threshold:
                # a_l(t) = a_l(t-1) + Σ_j w_lj (â_j - â_l)
                value += metropolis_weight(own.degree, message.degree) * (there.last - here.last)
        return Talk(tuple(value.tolist()), here, heard)


def distance(
    one: Float[np.ndarray, " K"], other: Float[np.ndarray, " K"], scale: Float[np.ndarray, " K"]
) -> float:
    """Root mean square of the differences relative to a scale; places whose scale is 0 hold nothing but 0."""
    relative = (one - other) / np.where(scale > 0, scale, 1.0)
    return float(np.sqrt(np.mean(relative**2))) if relative.size else 0.0


def _silent(value: Vector) -> Voice:
    return Voice(np.zeros(len(value)), np.zeros(len(value)))
