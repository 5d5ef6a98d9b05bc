"""Counting: how often each colour of the reference occurs in each of many boxes.

Only the colours that the reference holds are told apart; the Bhattacharyya coefficient needs no others. Two
ways to count: every pixel of a box, from integral images (Porikli 2005), or a fixed grid of samples, whose
cost does not depend on the box and which a processor of fixed cycles can follow.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise, starmap
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, Integer
from pydantic import Field, PositiveInt

from network.options import Options

FEW_CODES = 16
"""Codes a histogram up to which comparing all samples with each of them is faster than one `bincount`."""


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
        return part_edges(self.part_heights)


@lru_cache
def part_edges(part_heights: tuple[float, ...]) -> Float[np.ndarray, " P1"]:
    """Where parts of these heights begin and end."""
    return np.concatenate([[0.0], np.cumsum(part_heights)])


def codebook(used: Bool[np.ndarray, "P C B"], part_heights: tuple[float, ...]) -> Codebook:
    """Gives a code to each bin that is used.

    Args:
        used: Whether a bin is told apart from the rest.
        part_heights: Heights of the P parts.
    """
    part = np.nonzero(used)[0]
    n_codes, n_channels = len(part), used.shape[1]
    codes = np.full(used.shape, n_codes, dtype=np.min_scalar_type(n_codes))
    codes[used] = np.arange(n_codes)
    return Codebook(codes, part, n_channels, part_heights)


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
    n_parts, n_channels, _ = book.codes.shape
    n_boxes, n_codes = len(boxes), len(book.part)
    height, width = bins.shape[1] + 2, bins.shape[2] + 2
    # Samples outside fall on a border one pixel wide, which counts as one of the other colours.
    # Boxes are the last axis, the longest, which is what this function's time depends on.
    left, top, right, bottom = boxes.T
    x = _cells(left, right, sample_positions(grid[0], kernel, 1.0), width)
    y = _cells(top, bottom, sample_positions(grid[1], kernel, 0.5), height)
    rows_of_parts = _rows_of_parts(grid[1], kernel, book.part_heights)
    # Samples of a part that lie inside, from the separable grid
    inside_x = _count_true((x > 0) & (x < width - 1))
    inside_y = (y > 0) & (y < height - 1)
    pixels = np.empty((n_boxes, n_parts), dtype=np.intp)
    for part, rows in enumerate(rows_of_parts):
        np.multiply(inside_x, _count_true(inside_y[rows]), out=pixels[:, part], dtype=np.intp)
        y[rows] += part * height  # each part has a coded picture of its own, below that of the one before
    index = ((y * width)[:, None] + x).reshape(grid[0] * grid[1], n_boxes)
    counts = np.zeros((n_boxes, n_codes), dtype=np.intp)
    for codes, channel_bins in zip(book.codes.swapaxes(0, 1), bins.astype(np.intp), strict=True):
        coded = np.full((n_parts, height, width), n_codes, dtype=codes.dtype)
        coded[:, 1:-1, 1:-1] = codes.take(channel_bins, axis=1)
        sampled = coded.take(index)
        if n_codes > FEW_CODES * n_parts * n_channels:
            counts += _histograms(sampled, n_codes)
            continue
        for of_part, rows in zip(codes, rows_of_parts, strict=True):
            sampled_part = sampled[rows.start * grid[0] : rows.stop * grid[0]]
            for code in of_part[of_part < n_codes]:
                counts[:, code] = _count_true(sampled_part == code)
    return counts, pixels


def _count_true(mask: Bool[np.ndarray, "S N"]) -> Integer[np.ndarray, " N"]:
    """Counts in each column, in the smallest integers that can: several times faster than `mask.sum`."""
    return np.add.reduce(mask.view(np.uint8), axis=0, dtype=np.min_scalar_type(len(mask)))


def _histograms(sampled: Integer[np.ndarray, "S N"], n_codes: int) -> Int[np.ndarray, "N K"]:
    """How often each code below `n_codes` occurs in each column."""
    n_kinds, n_boxes = n_codes + 1, sampled.shape[-1]
    kinds = sampled + n_kinds * np.arange(n_boxes)
    counts = np.bincount(kinds.ravel(), minlength=n_kinds * n_boxes)
    return counts.reshape(n_boxes, n_kinds)[:, :n_codes]


def _cells(
    low: Float[np.ndarray, " N"], high: Float[np.ndarray, " N"], fractions: Float[np.ndarray, " n"], size: int
) -> Int[np.ndarray, "n N"]:
    """The pixel of each sample along one axis, from 1; 0 and `size` - 1 are the border."""
    position = fractions[:, None] * (high - low)
    position += low
    np.floor(position, out=position)
    position += 1
    np.maximum(position, 0, out=position)
    np.minimum(position, size - 1, out=position)
    return position.astype(np.intp)


@lru_cache
def _rows_of_parts(n: int, kernel: str, part_heights: tuple[float, ...]) -> tuple[slice, ...]:
    """Which of n rows of samples lie in each part."""
    inner = part_edges(part_heights)[1:-1]
    ends = np.searchsorted(sample_positions(n, kernel, 0.5), inner, side="left").tolist()
    return tuple(starmap(slice, pairwise([0, *ends, n])))


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
