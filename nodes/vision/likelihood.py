"""From distances to log-likelihoods, with a floor for a target that is not seen.

Source: the Gaussian in the Bhattacharyya distance of Pérez et al. (2002), which Jing & Chen's Eq. 12 leaves
open. Taken literally, a camera that cannot see the target drags everybody away; the miss floor lets it say
"I do not know" instead.
"""

from typing import Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from network.options import Options

INDISTINCT = 1e-3
"""d² below which two histograms of a few hundred samples are the same."""


class LikelihoodOptions(Options):
    """How much a distance between histograms weighs."""

    form: Literal["literal", "miss_floor"] = "miss_floor"
    """`literal`: exp(-d²/2σ²) whatever the camera sees; `miss_floor`: never below that of a missed target."""
    calibration: Literal["fixed", "background"] = "background"
    """`fixed`: the two constants below; `background`: set at start-up from what surrounds the target."""
    sigma: float = Field(default=0.1, ge=1e-3)
    """σ of the likelihood, in units of d (fixed)."""
    miss_distance: float = Field(default=0.12, gt=0)
    """d₀²: the squared distance at which the target counts as not seen (fixed)."""
    background_fraction: float = Field(default=0.5, gt=0)
    """d₀² as a fraction of the median d² of the target's surroundings (background)."""
    background_ratio: float = Field(default=48.0, gt=0)
    """d₀²/σ² (background)."""


def log_gaussian(squared_distance: Float[np.ndarray, " N"], variance: float) -> Float[np.ndarray, " N"]:
    """ℓ of each box, taken literally: -d²/2σ²."""
    return squared_distance / (-2 * variance)


def with_miss_floor(
    log_match: Float[np.ndarray, " N"],
    visible: Float[np.ndarray, " N"],
    miss_distance: float,
    variance: float,
    min_visible: float,
) -> Float[np.ndarray, " N"]:
    """ℓ of each box, never below that of a missed target.

    Args:
        log_match: Taken literally.
        visible: Part of the box inside the picture.
        miss_distance: d₀².
        variance: σ².
        min_visible: Below this part inside the picture the camera has nothing to say.
    """
    # ℓ = log(exp(-d²/2σ²) + exp(-d₀²/2σ²)), the larger one taken out, which no exponential exceeds
    floor = -miss_distance / (2 * variance)
    larger, ratio = np.maximum(log_match, floor), np.minimum(log_match, floor)
    ratio -= larger
    np.exp(ratio, out=ratio)
    ratio += 1
    larger += np.log(ratio, out=ratio)
    # and the second alone where the box is hardly visible
    hidden = visible < min_visible
    if hidden.any():
        larger[hidden] = floor
    return larger


def background_constants(
    surroundings: Float[np.ndarray, " N"], options: LikelihoodOptions
) -> tuple[float, float]:
    """d₀² and σ² from the distances of boxes around the target, which show what it is not.

    Constants tuned on one scene fail on the next; these follow the scene. Where fewer than four boxes can
    be seen, or they look like the target, the fixed constants serve.
    """
    fixed = options.calibration == "fixed" or len(surroundings) < 4
    if fixed or np.median(surroundings) < INDISTINCT:
        return options.miss_distance, options.sigma**2
    # d₀² = 0.5 median d², σ² = d₀² / 48
    miss_distance = options.background_fraction * float(np.median(surroundings))
    return miss_distance, miss_distance / options.background_ratio
