"""Whether a filter knows how wrong it is: NEES and its chi-square band.

Source: Bar-Shalom, Li & Kirubarajan (2001), section 5.4.
"""

import math

import numpy as np
from jaxtyping import Float


def nees(
    means: Float[np.ndarray, "T D"], covariances: Float[np.ndarray, "T D D"], truth: Float[np.ndarray, "T D"]
) -> Float[np.ndarray, " T"]:
    """Normalised estimation error squared of the position, eᵀ P⁻¹ e, in each frame.

    A consistent filter's is χ² distributed with as many degrees of freedom as the position has axes.

    Returns:
        NaN where there is no estimate, infinity where the covariance is singular.
    """
    n_axes = truth.shape[1] // 2
    error = (means - truth)[:, :n_axes]
    P = covariances[:, :n_axes, :n_axes]
    found = np.full(len(error), np.nan)
    there = np.isfinite(error).all(axis=1) & np.isfinite(P).all(axis=(1, 2))
    regular = there.copy()
    regular[there] = np.linalg.matrix_rank(P[there], hermitian=True) == n_axes
    found[there & ~regular] = np.inf
    whitened = np.linalg.solve(P[regular], error[regular, :, None])[:, :, 0]
    found[regular] = np.sum(error[regular] * whitened, axis=1)
    return found


def chi_square_quantile(probability: float, degrees: int) -> float:
    """Where a χ² variable's distribution function reaches a probability, by bisection.

    Args:
        probability: Above 0, below 1.
        degrees: Degrees of freedom k, at least 1.
    """
    low, high = 0.0, 1.0
    while _survival(high, degrees) > 1 - probability:
        high *= 2
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if _survival(middle, degrees) > 1 - probability else (low, middle)
    return high


def _survival(x: float, degrees: int) -> float:
    """P(χ² > x): Q(1) = erfc √(x/2), Q(2) = e^(-x/2), Q(k+2) = Q(k) + (x/2)^(k/2) e^(-x/2) / Γ(k/2 + 1)."""
    half = x / 2
    total = math.erfc(math.sqrt(half)) if degrees % 2 else math.exp(-half)
    for k in range(2 - degrees % 2, degrees, 2):
        total += math.exp(k / 2 * math.log(half) - half - math.lgamma(k / 2 + 1)) if half else 0.0
    return total


def anees_band(n_errors: int, n_axes: int, confidence: float = 0.95) -> tuple[float, float]:
    """Between what the average of so many NEES lies, over the axes, if the filter is consistent.

    Args:
        n_errors: Independent errors in the average: runs, not frames, since a filter's errors last.
        n_axes: Axes of the position.
        confidence: Of the band, two-sided.
    """
    degrees = n_errors * n_axes
    tail = (1 - confidence) / 2
    low, high = (chi_square_quantile(p, degrees) / degrees for p in (tail, 1 - tail))
    return low, high
