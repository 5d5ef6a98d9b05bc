"""Counting a fixed grid of samples of each box: the cost does not depend on the box.

A processor of fixed cycles cannot do otherwise, and a frame costs the same at any distance.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise, starmap

import cv2
import numpy as np
from jaxtyping import Float, Int, Integer

from nodes.counting.codebook import OTHER, Block, Codebook, counting_type, part_edges

WORD_BITS = 64
MANY_WORDS = 4
"""Machine words of codes a block beyond which they are not packed."""
_ONE = np.uint64(1)


@dataclass(frozen=True, slots=True, eq=False)
class GridSamples:
    """A grid of samples of each box, as pixels of the picture.

    Attributes:
        x: Column of each of the c columns of samples, from 1; 0 and the width + 1 are outside.
        y: Row of each of the r rows of samples, likewise.
        region: left, top, right, bottom of what they cover, in the picture; at least one pixel.
        parts: Which rows of samples lie in each part.
        book: The colours that are told apart.
    """

    x: Int[np.ndarray, "c N"]
    y: Int[np.ndarray, "r N"]
    region: tuple[int, int, int, int]
    parts: tuple[slice, ...]
    book: Codebook

    def count(
        self, bins: Integer[np.ndarray, "C h w"]
    ) -> tuple[Integer[np.ndarray, "K N"], Int[np.ndarray, "P N"]]:
        """Counts the colours of the samples.

        Args:
            bins: Bin indices of the pixels of the region.

        Returns:
            Counts of each code, and samples in each part that lie inside the picture.
        """
        (n_columns, n_boxes), book, (_, height, width) = self.x.shape, self.book, bins.shape
        # Boxes are the last axis, the longest, which is what this function's time depends on.
        x, y = self.x - self.region[0], self.y - self.region[1]
        # Samples of a part that lie inside, from the separable grid
        inside_x = ((x > 0) & (x <= width)).sum(axis=0)
        inside_y = (y > 0) & (y <= height)
        pixels = np.stack([inside_x * inside_y[rows].sum(axis=0) for rows in self.parts])
        # Samples outside fall on a border one pixel wide, of a colour that nobody tells apart.
        bordered = [_bordered(channel, book.codes.shape[2]) for channel in bins]
        index = ((y * (width + 2))[:, None] + x).reshape(len(y) * n_columns, n_boxes)
        counts = np.zeros((len(book.part), n_boxes), counting_type(len(index)))
        for block in book.blocks:
            rows = self.parts[block.part]
            of_part = index[rows.start * n_columns : rows.stop * n_columns]
            _count_block(bordered[block.channel], of_part, block, counts[block.codes])
        return counts, pixels


def grid_samples(
    boxes: Float[np.ndarray, "N 4"],
    size_px: tuple[int, int],
    book: Codebook,
    grid: tuple[int, int],
    kernel: str,
) -> GridSamples:
    """Finds the samples of boxes.

    Args:
        boxes: left, top, right, bottom in pixels; NaN where there is none.
        size_px: Width and height of the picture.
        book: The colours that are told apart.
        grid: Columns and rows.
        kernel: The density of the samples; see `sample_positions`.
    """
    left, top, right, bottom = boxes.T
    x = cells(left, right, sample_positions(grid[0], kernel, 1.0), size_px[0])
    y = cells(top, bottom, sample_positions(grid[1], kernel, 0.5), size_px[1])
    # where there is a sample outside, the region reaches to that border
    first = [max(int(where.min(initial=size)) - 1, 0) for where, size in ((x, size_px[0]), (y, size_px[1]))]
    last = [
        min(int(where.max(initial=low + 1)), size)
        for where, low, size in zip((x, y), first, size_px, strict=True)
    ]
    return GridSamples(
        x, y, (first[0], first[1], last[0], last[1]), rows_of_parts(grid[1], kernel, book.part_heights), book
    )


def _bordered(bins: Integer[np.ndarray, "h w"], other: int) -> Integer[np.ndarray, "h2 w2"]:
    """A picture with a border of a colour of its own."""
    dtype = np.uint8 if other <= np.iinfo(np.uint8).max else np.uint16
    return cv2.copyMakeBorder(bins.astype(dtype, copy=False), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=other)


def _count_block(
    bins: Integer[np.ndarray, "h w"],
    index: Int[np.ndarray, "S N"],
    block: Block,
    counts: Integer[np.ndarray, "k N"],
) -> None:
    """Counts as many codes at once as fit into one machine word, each in bits of its own."""
    n_samples, n_boxes = index.shape
    bits = n_samples.bit_length()
    per_word = WORD_BITS // max(bits, 1)
    table = np.append(block.table, np.uint8(OTHER))
    if block.size > MANY_WORDS * per_word:
        # So many colours that one `bincount` over them all is less work
        kinds = table.take(bins.take(index)) + (OTHER + 1) * np.arange(n_boxes)
        found = np.bincount(kinds.ravel(), minlength=(OTHER + 1) * n_boxes)
        counts[:] = found.reshape(n_boxes, OTHER + 1)[:, : block.size].T
        return
    for first in range(0, block.size, per_word):
        shifts = np.arange(min(per_word, block.size - first), dtype=np.uint64) * np.uint64(bits)
        # a word for each bin, with a 1 in its code's bits; none for the other bins and the border
        words = np.zeros(OTHER + 1, np.uint64)
        words[first : first + len(shifts)] = _ONE << shifts
        total = np.add.reduce(words.take(table).take(bins).take(index), axis=0)
        counts[first : first + len(shifts)] = (total >> shifts[:, None]) & ((_ONE << np.uint64(bits)) - _ONE)


def cells(
    low: Float[np.ndarray, " N"], high: Float[np.ndarray, " N"], fractions: Float[np.ndarray, " n"], size: int
) -> Int[np.ndarray, "n N"]:
    """The pixel of each sample along one axis, from 1; 0 and `size` + 1 are the border."""
    position = fractions[:, None] * (high - low)
    position += low
    np.floor(position, out=position)
    position += 1
    np.fmax(position, 0, out=position)  # NaN is outside
    np.minimum(position, size + 1, out=position)
    return position.astype(np.intp)


@lru_cache
def rows_of_parts(n: int, kernel: str, part_heights: tuple[float, ...]) -> tuple[slice, ...]:
    """Which of n rows of samples lie in each part."""
    inner = part_edges(part_heights)[1:-1]
    ends = np.searchsorted(sample_positions(n, kernel, 0.5), inner, side="left").tolist()
    return tuple(starmap(slice, pairwise([0, *ends, n])))


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
