"""Chebyshev-accelerated averaging: the best polynomial in L that knows λ₂ and λ_N only.

Source: the Chebyshev semi-iteration (Golub & Varga 1961), for averaging e.g. Montijano, Montijano & Sagues
2013. After t rounds the error is 1 / T_t(1/ρ) at the most, ρ = (λ_N - λ₂) / (λ_N + λ₂). The three-term form
is optimal after *every* round: cutting it short costs nothing but the rounds.

It is written for the flows over the links, as the second-order scheme of load balancing (Muthukrishnan, Ghosh
& Schultz 1998): whatever the two ends of a link know they know alike, and a flow is given and taken in equal
parts. A link that goes takes its momentum with it and the average stays.

Nodes or links that go cannot raise λ_N. On [0, λ_N] the polynomials are 1 at the most, so that a network that
has become smaller still converges, if more slowly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from network.averaging.algorithm import Algorithm, AlgorithmOptions, State, Vector
from network.graphs.graph import Graph
from network.graphs.spectrum import Spectrum, extremes_of
from network.wire.messages import ConsensusMessage


class Chebyshev(AlgorithmOptions):
    """Chebyshev acceleration, from the smallest and the largest eigenvalue of the scenario's graph."""

    algorithm: Literal["chebyshev"] = "chebyshev"
    """Accelerated by the momentum that is best for this graph's λ₂ and λ_N."""

    def tuned(self, graph: Graph, iterations: int) -> Algorithm[Any]:
        """Chebyshev acceleration on this graph."""
        return TunedChebyshev(extremes_of(graph))


@dataclass(frozen=True, slots=True, eq=False)
class Flowing(State):
    """A state with momentum.

    Attributes:
        relaxation: ω of the last round, 0 before the first.
        flows: What came over each link in the last round.
    """

    relaxation: float
    flows: Mapping[str, Float[np.ndarray, " K"]]


@dataclass(frozen=True, slots=True)
class TunedChebyshev:
    """Chebyshev acceleration on one graph.

    Attributes:
        spectrum: Of the graph.
    """

    spectrum: Spectrum
    uses_late: ClassVar[bool] = False

    def begin(self, value: Vector, last: Flowing | None) -> Flowing:
        """The node's own value, at rest."""
        return Flowing(value, 0.0, {})

    def payload(self, state: Flowing, degree: int) -> Vector:
        """The value."""
        return state.value

    def fits(self, state: Flowing, message: ConsensusMessage) -> bool:
        """Whether it is as long as the node's own."""
        return len(message.payload) == len(state.value)

    def step(self, state: Flowing, own: ConsensusMessage, received: Sequence[ConsensusMessage]) -> Flowing:
        """A step over every link, and on in the direction of the last one."""
        omega = next_relaxation(state.relaxation, self.spectrum.contraction)
        value, said = np.array(state.value), np.array(own.payload)
        flows = {}
        for message in received:
            # f_lj(t) = ω ε (a_j - a_l) + (ω - 1) f_lj(t-1);  a_l(t) = a_l(t-1) + Σ_j f_lj(t)
            flow = omega * self.spectrum.step * (np.array(message.payload) - said)
            if message.sender in state.flows:
                flow += (omega - 1) * state.flows[message.sender]
            value += flow
            flows[message.sender] = flow
        return Flowing(tuple(value.tolist()), omega, flows)


def next_relaxation(relaxation: float, contraction: float) -> float:
    """ω of the next round: ω₁ = 1, ω₂ = 1 / (1 - ρ²/2), ω = 1 / (1 - ρ²ω/4).

    Args:
        relaxation: That of this round, 0 before the first.
        contraction: ρ.
    """
    if relaxation == 0:
        return 1.0
    if relaxation == 1:
        return 1 / (1 - contraction**2 / 2)
    return 1 / (1 - contraction**2 * relaxation / 4)
