"""Event-triggered averaging: a node says its value only when it has moved since it last did.

Source: Seyboth, Dimarogonas & Johansson 2013. Both ends of a link use the values last said, so that they move
alike and the average stays, whoever is silent. The steps are Metropolis steps; the error shrinks like theirs
down to a floor that the threshold sets.

A number has moved when it differs from the one last said by more than a fraction of the largest that the node
has said or heard in this frame, each place of the vector by itself: places may differ in their units. For an
information matrix Λ on A axes, that is an equivalent of a threshold on the Kullback-Leibler divergence:
between Gaussians with Λ and (1 + δ)Λ it is ½ A (δ - ln(1 + δ)), about A δ² / 4.

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
from network.graph import Graph
from network.messages import ConsensusMessage


@dataclass(frozen=True, slots=True, eq=False)
class Said(State):
    """A state with what has been said of it.

    Attributes:
        said: The node's value as it last said it; zeros before.
        heard: Those of its neighbours.
        scale: The largest magnitude said or heard in this frame, place by place.
    """

    said: Float[np.ndarray, " K"]
    heard: Mapping[str, Float[np.ndarray, " K"]]
    scale: Float[np.ndarray, " K"]


class EventTriggered(AlgorithmOptions):
    """Metropolis steps on values that are sent only when they have moved."""

    algorithm: Literal["event_triggered"] = "event_triggered"
    """A node sends its value only when it has moved; weights as in `metropolis`."""
    threshold: float = Field(default=0.05, gt=0, lt=1)
    """How far a number must have moved to be sent, as a fraction of the largest that the node has sent or
    heard in its place in this frame; for an information matrix on A axes about A threshold² / 4 nats."""

    uses_late: ClassVar[bool] = False

    def tuned(self, graph: Graph, iterations: int) -> Algorithm[Any]:  # noqa: ARG002 - degrees are all it needs
        """The algorithm itself."""
        return self

    def begin(self, value: Vector, last: Said | None) -> Said:  # noqa: ARG002 - a frame's value is new
        """The node's own value, of which nobody has heard."""
        return Said(value, np.zeros_like(value), {}, np.abs(value))

    def payload(self, state: Said, degree: int) -> Vector:  # noqa: ARG002 - the same for everybody
        """The value if it has moved, nothing otherwise."""
        moved = np.abs(state.value - state.said) > self.threshold * state.scale
        return state.value if moved.any() else state.value[:0]

    def fits(self, state: Said, message: ConsensusMessage) -> bool:
        """Whether it is as long as the node's own, or empty."""
        return message.payload.shape in (state.value.shape, (0,))

    def step(self, state: Said, own: ConsensusMessage, received: Sequence[ConsensusMessage]) -> Said:
        """A step towards what every neighbour last said."""
        said = own.payload if own.payload.size else state.said
        value, heard, scale = state.value.copy(), dict(state.heard), np.maximum(state.scale, np.abs(said))
        for message in received:
            if message.payload.size:
                heard[message.sender] = message.payload
                scale = np.maximum(scale, np.abs(message.payload))
            # a_l(t) = a_l(t-1) + Σ_j w_lj (â_j - â_l)
            weight = metropolis_weight(own.degree, message.degree)
            value += weight * (heard.get(message.sender, 0.0) - said)
        return Said(value, said, heard, scale)
