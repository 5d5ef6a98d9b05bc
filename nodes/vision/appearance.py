"""What the target looks like to one camera: the reference histograms and their update.

Sources: Jing & Chen, Eq. 4 (update) and 11 (normalisation).
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int, Integer
from pydantic import Field

from network.options import Options
from nodes.vision.color import ColorOptions


class ModelUpdateOptions(Options):
    """How the reference follows the target's looks (Eq. 4)."""

    alpha: float = Field(default=0.0, ge=0, le=1)
    """Speed of the update: 0 keeps the first reference."""
    gated: bool = True
    """Whether only a good sight of the target updates the reference; ungated, it drifts under occlusion."""
    min_visible: float = Field(default=0.9, ge=0, le=1)
    """Part of the estimate's box that must lie inside the picture, for a gated update."""
    max_distance: float = Field(default=0.7, gt=0)
    """Largest d² of a gated update, as a multiple of the miss distance d₀²."""
    anchor: float = Field(default=0.03, ge=0, le=1)
    """Part of the first reference that a gated update keeps mixing in."""


@dataclass(frozen=True, slots=True, eq=False)
class Appearance:
    """A camera's reference.

    Attributes:
        histograms: Each of the P x C adds up to 1, or to 0 where the part was not seen.
        first: The histograms that it started from.
        distinctness: How much each bin tells the target from what surrounds it, 0 to 1.
        miss_distance: d₀², the distance at which the target counts as not seen.
        variance: σ² of the likelihood.
        own: Whether the camera saw it with its own eyes; else its neighbours described it.
        good_sights: How often the camera has seen it well since its neighbours described it.
        doubted: Whether the camera saw something else where the target was said to be.
    """

    histograms: Float[np.ndarray, "P C B"]
    first: Float[np.ndarray, "P C B"]
    distinctness: Float[np.ndarray, "P C B"]
    miss_distance: float
    variance: float
    own: bool
    good_sights: int = 0
    doubted: bool = False


def normalize_counts(
    counts: Integer[np.ndarray, "N K"], pixels: Int[np.ndarray, "N P"], options: ColorOptions
) -> Float[np.ndarray, "N P C B"]:
    """Takes hist / sum(hist) of each part and channel (Eq. 11), from counts of every bin."""
    shape = (len(counts), len(options.parts), options.n_channels, options.n_bins)
    return counts.reshape(shape) / np.maximum(pixels, 1)[:, :, None, None]


def distinctness_of(
    target: Float[np.ndarray, "P C B"], surroundings: Float[np.ndarray, "P C B"]
) -> Float[np.ndarray, "P C B"]:
    """ω = max(0, 1 - o/q): the share of a bin in the target's box that its surroundings do not explain.

    Comaniciu, Ramesh & Meer (2003), section 6.1, weight bins by the background, and Ning et al. (2012) the
    reference's only. A reference that is taken a little beside the target holds floor and wall on one side;
    weighted, they count for nothing, and the best box is the one that holds most of the target.

    Args:
        target: q, what the target's box shows.
        surroundings: o, the mean of what boxes around it show.
    """
    return np.where(target > 0, np.maximum(1 - surroundings / np.maximum(target, 1e-12), 0.0), 0.0)


def distance_to(
    histograms: Float[np.ndarray, "P C B"], reference: Appearance, options: ColorOptions
) -> float:
    """The distance d² of `nodes.vision.pattern`, from normalised histograms."""
    weights = np.array(options.part_weights)[:, None, None] / options.n_channels
    omega, q = reference.distinctness, reference.histograms
    perfect = (weights * omega * q).sum()
    return float(1 - (weights * omega * np.sqrt(histograms * q)).sum() / perfect) if perfect > 0 else 1.0


def settled(own: Appearance | None, told: Appearance | None, options: ColorOptions) -> Appearance | None:
    """What a camera starts with: its own look at the start, or the network's mean.

    Its own, unless it has none, or has seen something else than the others: a pillar in front of the target
    lies as well in the picture as the target would. Or its calibration is wrong: it is doubted until it has
    seen the target where the others do.
    """
    if own is None or told is None:
        return own or told
    differs = distance_to(own.histograms, told, options) > told.miss_distance
    return replace(told, doubted=True) if differs else own


def update_appearance(
    appearance: Appearance,
    histograms: Float[np.ndarray, "P C B"],
    squared_distance: float,
    visible: float,
    options: ModelUpdateOptions,
) -> Appearance:
    """Moves the reference towards what the estimate's box shows (Eq. 4), if the sight is good enough."""
    if options.alpha == 0 or visible == 0:
        return appearance
    if options.gated and (
        visible < options.min_visible or squared_distance > options.max_distance * appearance.miss_distance
    ):
        return appearance
    # hist(k+1) = (1 - α) hist(k) + α hist_E[x](k)
    updated = (1 - options.alpha) * appearance.histograms + options.alpha * histograms
    if options.gated:
        updated = (1 - options.anchor) * updated + options.anchor * appearance.first
    return replace(appearance, histograms=updated)


def pack_looks(appearance: Appearance | None, options: ColorOptions) -> Float[np.ndarray, " K"]:
    """The vector whose average over the network tells a camera that sees nothing what the target looks like.

    Returns:
        Histograms q, what is distinct in them ω q, d₀², σ² and a 1; all zeros from a camera that has not seen
        the target.
    """
    n = len(options.parts) * options.n_channels * options.n_bins
    if appearance is None:
        return np.zeros(2 * n + 3)
    distinct = appearance.histograms * appearance.distinctness
    constants = [appearance.miss_distance, appearance.variance, 1.0]
    return np.concatenate([appearance.histograms.ravel(), distinct.ravel(), constants])


def unpack_looks(average: Float[np.ndarray, " K"], options: ColorOptions) -> Appearance | None:
    """The mean of the cameras that saw the target, from the average over all; None if there was none."""
    share = average[-1]
    if share <= 1e-12:
        return None
    # Σ seen / Σ 1: the ratio is a weighted mean even where consensus is not complete
    mean = average / share
    shape = (2, len(options.parts), options.n_channels, options.n_bins)
    # an average that is not reached yet can lie beside all that was averaged, and below 0
    histograms, distinct = np.maximum(mean[:-3], 0.0).reshape(shape)
    distinctness = np.divide(distinct, histograms, out=np.zeros_like(distinct), where=histograms > 0)
    return Appearance(histograms, histograms, distinctness, float(mean[-3]), float(mean[-2]), own=False)
