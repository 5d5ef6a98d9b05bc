"""The naive average: the mean of the cameras' estimates, and of their covariances.

Whatever the estimates have in common, the mean of them is never worse than the mean covariance says, since
(Σ eⱼ / N)(Σ eⱼ / N)ᵀ is at most Σ eⱼeⱼᵀ / N. But a camera that sees nothing counts as much as one that does.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from network.wire.codec import pack_symmetric
from nodes.filtering.gaussian import Moments
from nodes.filtering.rules.rule import LocalEstimate, joined, split_information, triangle


@dataclass(frozen=True, slots=True)
class NaiveAverage:
    """Mean Σ uⱼ / N and covariance Σ pⱼ / N."""

    def size(self, n_states: int) -> int:
        """A covariance and a mean."""
        return triangle(n_states) + n_states

    def pack(self, local: LocalEstimate, n_cameras: int) -> Float[np.ndarray, "*C K"]:
        """The camera's p and u."""
        return joined(pack_symmetric(local.posterior.covariance), local.posterior.mean)

    def unpack(self, average: Float[np.ndarray, "*C K"], n_cameras: int, n_states: int) -> Moments:
        """The means of both."""
        # the packed form is the same, of p and u in place of p⁻¹ and p⁻¹u
        mean = split_information(average, n_states)
        return Moments(mean.vector, mean.matrix)
