"""Counting how often each colour of the reference occurs in each of many boxes."""

from typing import Literal

import numpy as np
from jaxtyping import Float, Int, Integer
from pydantic import Field, PositiveInt

from network.options import Options
from nodes.counting.codebook import Codebook
from nodes.counting.grid import GridSamples, grid_samples
from nodes.counting.pixels import PixelBoxes, pixel_boxes


class SamplingOptions(Options):
    """Which pixels of a box are counted."""

    grid: tuple[PositiveInt, PositiveInt] | None = (15, 15)
    """Columns and rows of the grid of samples; null counts every pixel of the box."""
    kernel: Literal["uniform", "epanechnikov"] = "uniform"
    """`epanechnikov` samples the middle of the box more densely than its border; without a grid, all pixels
    count alike."""
    min_visible: float = Field(default=0.5, ge=0, le=1)
    """Part of a box that must lie inside the picture for the camera to say anything about it."""


def locate(
    boxes: Float[np.ndarray, "N 4"], size_px: tuple[int, int], book: Codebook, sampling: SamplingOptions
) -> PixelBoxes | GridSamples:
    """Where in a picture to look for what boxes hold: its region, and then how to count in that.

    Args:
        boxes: left, top, right, bottom in pixels; they may reach over the border; NaN where there is none.
        size_px: Width and height of the picture.
        book: The colours that are told apart.
        sampling: Which pixels count.
    """
    if sampling.grid is None:
        return pixel_boxes(boxes, size_px, book)
    return grid_samples(boxes, size_px, book, sampling.grid, sampling.kernel)


def count(
    bins: Integer[np.ndarray, "C H W"],
    boxes: Float[np.ndarray, "N 4"],
    book: Codebook,
    sampling: SamplingOptions,
) -> tuple[Integer[np.ndarray, "N K"], Int[np.ndarray, "N P"]]:
    """Counts the colours in boxes.

    Args:
        bins: Bin indices of the pixels of a picture.
        boxes: As for `locate`.
        book: The colours that are told apart.
        sampling: Which pixels count.

    Returns:
        Counts of each code, and pixels (of one channel) in each part; pixels outside count nowhere.
    """
    where = locate(boxes, (bins.shape[2], bins.shape[1]), book, sampling)
    left, top, right, bottom = where.region
    counts, pixels = where.count(bins[:, top:bottom, left:right])
    return counts.T, pixels.T
