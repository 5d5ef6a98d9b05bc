"""Counting how often each colour of the reference occurs in each of many boxes."""

from typing import Literal

import numpy as np
from jaxtyping import Float, Int, Integer
from pydantic import Field, PositiveInt

from network.options import Options
from nodes.counting.codebook import Codebook
from nodes.counting.grid import count_samples
from nodes.counting.pixels import count_pixels


class SamplingOptions(Options):
    """Which pixels of a box are counted."""

    grid: tuple[PositiveInt, PositiveInt] | None = (15, 15)
    """Columns and rows of the grid of samples; null counts every pixel of the box."""
    kernel: Literal["uniform", "epanechnikov"] = "uniform"
    """`epanechnikov` samples the middle of the box more densely than its border; without a grid, all pixels
    count alike."""
    min_visible: float = Field(default=0.5, ge=0, le=1)
    """Part of a box that must lie inside the picture for the camera to say anything about it."""


def count(
    bins: Integer[np.ndarray, "C h w"],
    boxes: Float[np.ndarray, "N 4"],
    book: Codebook,
    sampling: SamplingOptions,
) -> tuple[Int[np.ndarray, "N K"], Int[np.ndarray, "N P"]]:
    """Counts the colours in boxes.

    Args:
        bins: Bin indices of the pixels (of the region that the boxes need, or of the whole picture).
        boxes: left, top, right, bottom relative to `bins`, in pixels; they may reach over the border, and are
            NaN where there is none.
        book: The colours that are told apart.
        sampling: Which pixels count.

    Returns:
        Counts of each code, and pixels (of one channel) in each part; pixels outside count nowhere.
    """
    boxes = np.where(np.isnan(boxes), -1e6, boxes)
    if sampling.grid is None:
        counts, pixels = count_pixels(bins, boxes, book)
    else:
        counts, pixels = count_samples(bins, boxes, book, sampling.grid, sampling.kernel)
    return counts.T, pixels.T
