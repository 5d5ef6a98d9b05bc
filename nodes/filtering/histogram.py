"""Counting: how often each colour of the reference occurs in each of many boxes.

Only the colours that the reference holds are told apart; the Bhattacharyya coefficient needs no others. Two
ways to count: every pixel of a box, from integral images (Porikli 2005), or a fixed grid of samples, whose
cost does not depend on the box and which a processor of fixed cycles can follow.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, Integer
from pydantic import Field, PositiveInt

from network.options import Options


class SamplingOptions(Options):
    """Which pixels of a box are counted."""

    grid: tuple[PositiveInt, PositiveInt] | None = (15, 15)
    """Columns and rows of the grid of samples; null counts every pixel of the box."""
    kernel: Literal["uniform", "epanechnikov"] = "uniform"
    """`epanechnikov` samples the middle of the box more densely than its border; without a grid, all pixels
    count alike."""
    min_visible: float = Field(default=0.5, ge=0, le=1)
    """Part of a box that must lie inside the picture for the camera to say anything about it."""


@dataclass(frozen=True, slots=True, eq=False)
class Codebook:
    """The colours that are told apart.

    Attributes:
        codes: For each part, channel and bin its code: 0 to K - 1, or K for every other colour.
        part: The part that each of the K codes belongs to.
        n_channels: Histograms of a part.
        part_heights: Heights of the parts as fractions of the box, from the top.
    """

    codes: Integer[np.ndarray, "P C B"]
    part: Int[np.ndarray, " K"]
    n_channels: int
    part_heights: tuple[float, ...]

    @property
    def part_edges(self) -> Float[np.ndarray, " P1"]:
        """Where the parts begin and end, 0 at the top of the box and 1 at its bottom."""
        return np.concatenate([[0.0], np.cumsum(self.part_heights)])


def codebook(used: Bool[np.ndarray, "P C B"], part_heights: tuple[float, ...]) -> Codebook:
    """Gives a code to each bin that is used.

    Args:
        used: Whether a bin is told apart from the rest.
        part_heights: Heights of the P parts.
    """
    n_channels = used.shape[1]
    codes = np.full(used.shape, np.count_nonzero(used), dtype=np.uint16)
    codes[used] = np.arange(np.count_nonzero(used))
    return Codebook(codes, np.nonzero(used)[0].astype(np.intp), n_channels, part_heights)


def count(
    bins: Integer[np.ndarray, "C h w"],
    boxes: Float[np.ndarray, "N 4"],
    book: Codebook,
    sampling: SamplingOptions,
) -> tuple[Int[np.ndarray, "N K"], Int[np.ndarray, "N P"]]:
    """Counts the colours in boxes.

    Args:
        bins: Bin indices of the pixels (of the region that the boxes need, or of the whole picture).
        boxes: left, top, right, bottom relative to `bins`, in pixels; they may reach over the border.
        book: The colours that are told apart.
        sampling: Which pixels count.

    Returns:
        Counts of each code, and pixels (of one channel) in each part; pixels outside count nowhere.
    """
    boxes = np.where(np.isnan(boxes), -1e6, boxes)
    if sampling.grid is None:
        return _count_every_pixel(bins, boxes, book)
    return _count_samples(bins, boxes, book, sampling.grid, sampling.kernel)


def _count_samples(
    bins: Integer[np.ndarray, "C h w"],
    boxes: Float[np.ndarray, "N 4"],
    book: Codebook,
    grid: tuple[int, int],
    kernel: str,
) -> tuple[Int[np.ndarray, "N K"], Int[np.ndarray, "N P"]]:
    n_parts, n_codes = len(book.part_heights), len(book.part)
    height, width = bins.shape[1] + 2, bins.shape[2] + 2
    columns, rows = sample_positions(grid[0], kernel, 1.0), sample_positions(grid[1], kernel, 0.5)
    row_part = np.clip(np.searchsorted(book.part_edges, rows, side="right") - 1, 0, n_parts - 1).astype(
        np.int32
    )
    # Samples outside fall on a border one pixel wide, which has a code of its own: n_codes + 1.
    # Particles are the last axis, the longest, which is what this function's time depends on.
    left, top, right, bottom = boxes.T
    x = np.clip(np.floor(left + columns[:, None] * (right - left)), -1, width - 2).astype(np.int32) + 1
    y = np.clip(np.floor(top + rows[:, None] * (bottom - top)), -1, height - 2).astype(np.int32) + 1
    index = ((row_part[:, None] * height + y) * width)[:, None] + x
    offset = (n_codes + 2) * np.arange(len(boxes))
    total = np.zeros((len(boxes), n_codes + 2), dtype=np.intp)
    for channel, channel_bins in enumerate(bins):
        coded = np.full((n_parts, height, width), n_codes + 1, dtype=np.uint16)
        for part in range(n_parts):
            coded[part, 1:-1, 1:-1] = book.codes[part, channel].take(channel_bins)
        sampled = coded.take(index, mode="clip") + offset
        total += np.bincount(sampled.ravel(), minlength=total.size).reshape(total.shape)
    # Samples of a part that lie inside, from the separable grid
    inside_x = ((x > 0) & (x < width - 1)).sum(axis=0)
    inside_y = (y > 0) & (y < height - 1)
    of_part = row_part == np.arange(n_parts)[:, None]
    pixels = inside_x[:, None] * (of_part[:, :, None] & inside_y).sum(axis=1).T
    return total[:, :n_codes], pixels


def _count_every_pixel(
    bins: Integer[np.ndarray, "C h w"], boxes: Float[np.ndarray, "N 4"], book: Codebook
) -> tuple[Int[np.ndarray, "N K"], Int[np.ndarray, "N P"]]:
    height, width = bins.shape[1:]
    # A pixel belongs to a box that holds its centre.
    sides = np.clip(np.floor(boxes[:, [0, 2]] + 0.5), 0, width).astype(np.intp)
    tops = boxes[:, 1:2] + book.part_edges * (boxes[:, 3:4] - boxes[:, 1:2])
    edges = np.clip(np.floor(tops + 0.5), 0, height).astype(np.intp)
    pixels = np.diff(edges, axis=1) * np.diff(sides, axis=1)
    # One box after the other where that touches fewer pixels than an image for every code.
    count_them = _one_by_one if pixels.sum() < len(book.part) * height * width else _from_integrals
    return count_them(bins, sides, edges, book), pixels


def _one_by_one(
    bins: Integer[np.ndarray, "C h w"],
    sides: Int[np.ndarray, "N 2"],
    edges: Int[np.ndarray, "N P1"],
    book: Codebook,
) -> Int[np.ndarray, "N K"]:
    n_codes = len(book.part)
    counts = np.zeros((len(sides), n_codes + 1), dtype=np.intp)
    for row, (left, right), bounds in zip(counts, sides, edges, strict=True):
        for part, (top, bottom) in enumerate(pairwise(bounds)):
            for channel, codes in enumerate(book.codes[part]):
                region = bins[channel, top:bottom, left:right]
                np.add(row, np.bincount(codes.take(region).ravel(), minlength=n_codes + 1), out=row)
    return counts[:, :n_codes]


def _from_integrals(
    bins: Integer[np.ndarray, "C h w"],
    sides: Int[np.ndarray, "N 2"],
    edges: Int[np.ndarray, "N P1"],
    book: Codebook,
) -> Int[np.ndarray, "N K"]:
    """From one integral image a code (Porikli 2005)."""
    left, right = sides.T
    counts = np.empty((len(sides), len(book.part)), dtype=np.intp)
    for code, (part, channel, bin_) in enumerate(np.argwhere(book.codes < len(book.part))):
        integral = cv2.integral((bins[channel] == bin_).view(np.uint8))
        top, bottom = edges[:, part], edges[:, part + 1]
        counts[:, code] = (
            integral[bottom, right] - integral[top, right] - integral[bottom, left] + integral[top, left]
        )
    return counts


@lru_cache
def sample_positions(n: int, kernel: str, curvature: float) -> Float[np.ndarray, " n"]:
    """Where n samples lie along a box, 0 to 1.

    The kernel is the density of the samples, so that all count alike and counts stay whole numbers: the
    samples are the quantiles (i + ½)/n of 1 - curvature·u², u from -1 to 1.
    """
    quantiles = (np.arange(n) + 0.5) / n
    if kernel == "uniform":
        return quantiles
    u = np.linspace(-1, 1, 2001)
    # ∫ 1 - c u² du = u - c u³/3
    cumulative = u - curvature * u**3 / 3
    cumulative = (cumulative - cumulative[0]) / (cumulative[-1] - cumulative[0])
    return (np.interp(quantiles, cumulative, u) + 1) / 2
