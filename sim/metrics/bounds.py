"""What no filter can be better than: the posterior Cramér-Rao bound of a linear-Gaussian problem.

Source: Tichavský, Muravchik & Nehorai (1998), Eq. 34-36.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float


def posterior_cramer_rao(
    start: Float[np.ndarray, "D D"],
    transition: Float[np.ndarray, "D D"],
    process: Float[np.ndarray, "D D"],
    information: Sequence[Float[np.ndarray, "D D"]],
) -> Float[np.ndarray, "T D D"]:
    """The smallest error covariance after each frame's measurements.

    Args:
        start: P(0), covariance of the state before the first frame.
        transition: F of the state model x(k) = F x(k-1) + ξ(k).
        process: Q, covariance of ξ.
        information: Hᵀ R⁻¹ H of each frame's measurements, summed over the cameras.
    """
    bounds, P = [], start
    for measured in information:
        # J(k) = (Q + F J(k-1)⁻¹ Fᵀ)⁻¹ + Hᵀ R⁻¹ H
        P = np.linalg.inv(np.linalg.inv(process + transition @ P @ transition.T) + measured)
        bounds.append(P)
    return np.array(bounds)
