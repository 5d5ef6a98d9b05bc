"""Hybrid consensus on measurements and on information (HCMCI).

Source: Battistelli, Chisci, Mugnai, Farina & Graziano, "Consensus-based linear and nonlinear filtering" (IEEE
TAC 60, 2015): the predictions are averaged as covariance intersection does, for they have everything in
common; what was measured is averaged by itself and counts γ times, for it is independent. Wang & Ren (IEEE
TAC 63, 2018) give the conditions under which it converges. γ = N is theirs for rounds that reach everybody.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from network.wire.codec import pack_symmetric
from nodes.filtering.gaussian import Moments, to_moments
from nodes.filtering.rules.rule import (
    LocalEstimate,
    joined,
    plus_on_position,
    split_information,
    triangle,
)


@dataclass(frozen=True, slots=True)
class Hybrid:
    """p⁻¹ = Σ rⱼ⁻¹ / N + γ Σ Λⱼ / N, and p⁻¹u likewise."""

    def size(self, n_states: int) -> int:
        """A Gaussian of the state and one of the position."""
        n_axes = n_states // 2
        return triangle(n_states) + n_states + triangle(n_axes) + n_axes

    def pack(self, local: LocalEstimate, n_cameras: int) -> Float[np.ndarray, "*C K"]:
        """r⁻¹ and r⁻¹v, Λ and η."""
        before, measured = local.before, local.measured
        return joined(
            pack_symmetric(before.matrix), before.vector, pack_symmetric(measured.matrix), measured.vector
        )

    def unpack(self, average: Float[np.ndarray, "*C K"], n_cameras: int, n_states: int) -> Moments:
        """The mean of the predictions, and the sum of what was measured."""
        split = triangle(n_states) + n_states
        before = split_information(average[..., :split], n_states)
        measured = split_information(average[..., split:], n_states // 2)
        return to_moments(plus_on_position(before, measured, n_cameras))
