"""What the target looks like to one camera: the reference histograms, the distance to them, their update.

Sources: Jing & Chen, Eq. 4 (update) and 11 (normalisation); the Bhattacharyya distance d² = 1 - Σ √(h q),
averaged over the channels, each normalised, and over the parts of the target by their weights.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field

from network.options import Options
from nodes.filtering.color import ColorOptions
from nodes.filtering.histogram import Codebook, codebook


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
        miss_distance: d₀², the distance at which the target counts as not seen.
        variance: σ² of the likelihood.
        own: Whether the camera saw it with its own eyes; else its neighbours described it.
    """

    histograms: Float[np.ndarray, "P C B"]
    first: Float[np.ndarray, "P C B"]
    miss_distance: float
    variance: float
    own: bool


def normalize_counts(
    counts: Int[np.ndarray, " K"], pixels: Int[np.ndarray, " P"], options: ColorOptions
) -> Float[np.ndarray, "P C B"]:
    """Takes hist / sum(hist) of each part and channel (Eq. 11), from counts of every bin."""
    shape = (len(options.parts), options.n_channels, options.n_bins)
    return counts.reshape(shape) / np.maximum(pixels, 1)[:, None, None]


def full_codebook(options: ColorOptions) -> Codebook:
    """A codebook that tells every bin apart."""
    return codebook(np.ones((len(options.parts), options.n_channels, options.n_bins), bool), options.parts)


def reference_codebook(histograms: Float[np.ndarray, "P C B"], options: ColorOptions) -> Codebook:
    """A codebook of the bins that the reference holds."""
    return codebook(histograms > 0, options.parts)


def squared_distances(
    counts: Int[np.ndarray, "N K"],
    pixels: Int[np.ndarray, "N P"],
    reference: Float[np.ndarray, "P C B"],
    book: Codebook,
    options: ColorOptions,
) -> Float[np.ndarray, " N"]:
    """The Bhattacharyya distance d² of each box to the reference.

    Parts of which nothing is in the picture, or in the reference, do not count; a box with none at all has
    distance 1.
    """
    weights = np.array(options.part_weights) * reference.any(axis=(1, 2))
    # h = counts / pixels; Σ_b √(h q), mean over channels, weighted mean over parts
    told_apart = reference[book.codes < len(book.part)]
    scale = np.sqrt(told_apart) * weights[book.part] / book.n_channels
    inverse_root = 1 / np.sqrt(np.maximum(pixels, 1))
    coefficient = np.einsum("nk,k,nk->n", np.sqrt(counts), scale, inverse_root[:, book.part])
    seen = (pixels > 0) @ weights
    similarity = np.divide(coefficient, seen, out=np.zeros_like(seen), where=seen > 0)
    return np.maximum(1 - similarity, 0.0)  # a perfect match is below zero by rounding


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
        Histograms, d₀², σ² and a 1; all zeros from a camera that has not seen the target.
    """
    n = len(options.parts) * options.n_channels * options.n_bins
    if appearance is None:
        return np.zeros(n + 3)
    return np.concatenate(
        [appearance.histograms.ravel(), [appearance.miss_distance, appearance.variance, 1.0]]
    )


def unpack_looks(average: Float[np.ndarray, " K"], options: ColorOptions) -> Appearance | None:
    """The mean of the cameras that saw the target, from the average over all; None if there was none."""
    share = average[-1]
    if share <= 1e-12:
        return None
    # Σ seen / Σ 1: the ratio is a weighted mean even where consensus is not complete
    mean = average / share
    shape = (len(options.parts), options.n_channels, options.n_bins)
    histograms = mean[:-3].reshape(shape)
    return Appearance(histograms, histograms, float(mean[-3]), float(mean[-2]), own=False)
