"""Covariance intersection by consensus: never surer than the estimates allow, whatever they share.

Source: Julier & Uhlmann, "A non-divergent estimation algorithm in the presence of unknown correlations" (ACC
1997), p⁻¹ = Σ ωⱼ pⱼ⁻¹ and p⁻¹u = Σ ωⱼ pⱼ⁻¹uⱼ with Σ ωⱼ = 1. The weights that minimise the trace of p need all
estimates in one place; those of Niehsen, "Information fusion based on fast covariance intersection filtering"
(FUSION 2002), ωⱼ ∝ 1 / tr(pⱼ), need each camera's own and their sum, which is one more number to average.
Equal weights would be the Kullback-Leibler average (Battistelli & Chisci, Automatica 50, 2014).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from network.wire.codec import pack_symmetric
from nodes.filtering.gaussian import Moments, to_moments
from nodes.filtering.rules.rule import LocalEstimate, joined, split_information, triangle


@dataclass(frozen=True, slots=True)
class CovarianceIntersection:
    """Weighted by the traces of the positions' covariances, which have one unit."""

    def size(self, n_states: int) -> int:
        """One Gaussian of the state, and the weight."""
        return triangle(n_states) + n_states + 1

    def pack(self, local: LocalEstimate, n_cameras: int) -> Float[np.ndarray, "*C K"]:
        """ω p⁻¹, ω p⁻¹u and ω = 1 / tr(p) of the position."""
        weight = 1 / np.trace(local.posterior.position().covariance, axis1=-2, axis2=-1)
        weight = np.asarray(weight)[..., None]
        return joined(weight * pack_symmetric(local.after.matrix), weight * local.after.vector, weight)

    def unpack(self, average: Float[np.ndarray, "*C K"], n_cameras: int, n_states: int) -> Moments:
        """The sums over the sum of the weights."""
        return to_moments(split_information(average[..., :-1] / average[..., -1:], n_states))
