"""The information-weighted consensus filter (ICF).

Source: Kamal, Farrell & Roy-Chowdhury, "Information weighted consensus filters and their application in
distributed camera networks" (IEEE TAC 58, 2013): every camera brings an N-th of its prediction and all that
it measured, V = J / N + Λ and v = J x / N + η; after the rounds x = V⁻¹ v, with information N V. Where all
agree on the prediction, that is the centralised Kalman filter.

With γ = N, hybrid consensus is the same sum in two parts: it sends more numbers and gets the same.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from network.wire.codec import pack_symmetric
from nodes.filtering.gaussian import Information, Moments, to_moments
from nodes.filtering.rules.rule import LocalEstimate, joined, plus_on_position, split_information, triangle


@dataclass(frozen=True, slots=True)
class InformationWeighted:
    """Prediction and measurement in one Gaussian of the state."""

    def size(self, n_states: int) -> int:
        """One Gaussian of the state."""
        return triangle(n_states) + n_states

    def pack(self, local: LocalEstimate, n_cameras: int) -> Float[np.ndarray, "*C K"]:
        """V and v."""
        before = local.before
        share = Information(before.matrix / n_cameras, before.vector / n_cameras)
        whole = plus_on_position(share, local.measured)
        return joined(pack_symmetric(whole.matrix), whole.vector)

    def unpack(self, average: Float[np.ndarray, "*C K"], n_cameras: int, n_states: int) -> Moments:
        """N V and N v."""
        return to_moments(split_information(n_cameras * average, n_states))
