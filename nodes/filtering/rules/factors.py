"""Rules that exchange what the measurements told: the sum over the cameras is a factor on the prediction.

Source: Jing & Chen, section 3.2, Eq. 15-17. The average times the number of cameras is the sum: information
adds up. Eq. 17 as printed divides two Gaussians whose ratio need not be a density; the other two send the
net information about the position, which always is one.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from network.wire.codec import pack_symmetric
from nodes.filtering.gaussian import Information
from nodes.filtering.rules.rule import LocalEstimate, joined, split_information, triangle


@dataclass(frozen=True, slots=True)
class Eq17:
    """The ratio N(u, p) / N(v, r) as printed."""

    def size(self, n_states: int) -> int:
        """Two Gaussians of the state."""
        return 2 * (triangle(n_states) + n_states)

    def pack(self, local: LocalEstimate, n_cameras: int) -> Float[np.ndarray, "*C K"]:
        """X_c1, x_c2, X_c3, x_c4: p⁻¹, p⁻¹u, r⁻¹, r⁻¹v."""
        after, before = local.after, local.before
        return joined(
            pack_symmetric(after.matrix), after.vector, pack_symmetric(before.matrix), before.vector
        )

    def unpack(self, average: Float[np.ndarray, "*C K"], n_cameras: int, n_states: int) -> Information:
        """The difference of the two sums."""
        # N(χ; u, p) / N(χ; v, r), with p⁻¹ = N X_c1, p⁻¹u = N x_c2, r⁻¹ = N X_c3, r⁻¹v = N x_c4
        after, before = np.split(n_cameras * average, 2, axis=-1)
        return split_information(after - before, n_states)


@dataclass(frozen=True, slots=True)
class MeasuredSum:
    """The sum of the cameras' information about the position.

    Attributes:
        of: Where a camera's information is taken from: the moments before and after, or the log-likelihood.
    """

    of: Literal["moments", "log_likelihood"]

    def size(self, n_states: int) -> int:
        """One Gaussian of the position: five numbers on a plane."""
        return triangle(n_states // 2) + n_states // 2

    def pack(self, local: LocalEstimate, n_cameras: int) -> Float[np.ndarray, "*C K"]:
        """Λ and η of the position."""
        information = local.measured if self.of == "moments" else local.fitted
        return joined(pack_symmetric(information.matrix), information.vector)

    def unpack(self, average: Float[np.ndarray, "*C K"], n_cameras: int, n_states: int) -> Information:
        """N Λ̄ and N η̄."""
        return split_information(n_cameras * average, n_states // 2)
