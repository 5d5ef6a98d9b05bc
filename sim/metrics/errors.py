"""How far an estimate was from the truth, and whether it knew.

Lengths are in the unit of the target's space: metres, or pixels in the image plane. Frame 0 is the
initialisation and does not count.
"""

import numpy as np
from jaxtyping import Float

LOST_ERROR = 0.8
"""Mean error of a run's last frames above which the target counts as lost, m."""
LOST_DIAGONALS = 0.5
"""The same in the image plane, in diagonals of the target's box: beyond it, an estimate is outside the circle
around the true box."""
LOST_FRAMES = 5
"""How many last frames that mean is over."""


def position_errors(
    means: Float[np.ndarray, "T D"], truth: Float[np.ndarray, "T D"]
) -> Float[np.ndarray, " T"]:
    """Distance between estimate and truth in each frame; NaN where there is no estimate."""
    n_axes = truth.shape[1] // 2
    return np.linalg.norm(means[:, :n_axes] - truth[:, :n_axes], axis=1)


def rmse(errors: Float[np.ndarray, "..."]) -> float:
    """Root mean square of errors, over everything that is there; NaN if nothing is."""
    known = errors[~np.isnan(errors)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")


def is_lost(errors: Float[np.ndarray, " T"], limit: float = LOST_ERROR) -> bool:
    """Whether the mean error of the last frames says that the target was lost, or nothing is there."""
    last = errors[-LOST_FRAMES:]
    known = last[~np.isnan(last)]
    return not known.size or float(known.mean()) > limit


def anees(
    means: Float[np.ndarray, "T D"],
    covariances: Float[np.ndarray, "T D D"],
    truth: Float[np.ndarray, "T D"],
) -> float:
    """Average normalised estimation error squared of the position, over its axes: 1 if the filter knows.

    Bar-Shalom, Li & Kirubarajan (2001), section 5.4: e^T P^-1 e has the position's number of axes as mean.

    Returns:
        NaN without any estimate, infinity where a covariance is singular: that filter claims no doubt.
    """
    n_axes = truth.shape[1] // 2
    there = ~np.isnan(means[:, 0])
    error = (means - truth)[there, :n_axes]
    P = covariances[there, :n_axes, :n_axes]
    if not len(P):
        return float("nan")
    if np.linalg.matrix_rank(P, hermitian=True).min() < n_axes:
        return float("inf")
    whitened = np.linalg.solve(P, error[:, :, None])[:, :, 0]
    return float(np.mean(np.sum(error * whitened, axis=1)) / n_axes)


def disagreement(means: Float[np.ndarray, "C T D"]) -> float:
    """Mean distance between the estimates of two nodes of the same frame, over all pairs; 0 for one node."""
    n_axes = means.shape[2] // 2
    positions = means[:, :, :n_axes]
    i, j = np.triu_indices(len(positions), k=1)
    if not len(i):
        return 0.0
    distances = np.linalg.norm(positions[i] - positions[j], axis=2)
    return float(np.nanmean(distances)) if not np.isnan(distances).all() else float("nan")
