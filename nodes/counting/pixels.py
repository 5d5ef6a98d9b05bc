"""Counting every pixel of each box: from integral images, or one box after the other where that is less.

Source: Porikli, "Integral histogram" (CVPR 2005), on the boxes' region and for the reference's colours only.
"""

from collections.abc import Iterator

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, Integer

from nodes.counting.codebook import Block, Codebook

LANES = 4
"""Colours in an integral image: OpenCV has a fast path for four channels, and one look-up serves them all."""
CHUNK_BYTES = 640_000
"""Integral images that are made at once: what stays in a core's cache. Everything at once is half as fast."""
BOX_COST, PIXEL_COST = 3000, 2
"""What one box costs directly, and each of its pixels, in units of one colour in one pixel of an integral."""


def count_pixels(
    bins: Integer[np.ndarray, "C h w"], boxes: Float[np.ndarray, "N 4"], book: Codebook
) -> tuple[Int[np.ndarray, "K N"], Int[np.ndarray, "P N"]]:
    """Counts the colours of all pixels whose centres lie in a box.

    Args:
        bins: Bin indices of the pixels.
        boxes: left, top, right, bottom in pixels of `bins`.
        book: The colours that are told apart.

    Returns:
        Counts of each code, and pixels in each part.
    """
    _, height, width = bins.shape
    left, right = _centers(boxes[:, 0], width), _centers(boxes[:, 2], width)
    heights = boxes[:, 3] - boxes[:, 1]
    edges = _centers(boxes[:, 1] + book.part_edges[:, None] * heights, height)
    pixels = np.diff(edges, axis=0) * (right - left)
    touched = int(pixels.sum()) * book.n_channels
    n_counts = len(boxes) * len(book.part_heights) * book.n_channels
    direct = BOX_COST * n_counts + PIXEL_COST * touched
    counts = np.zeros((len(book.part), len(boxes)), dtype=np.int32)
    if direct < len(book.part) * height * width:
        _one_by_one(bins, (left, right), edges, book, counts)
    else:
        for block in book.blocks:
            _from_integrals(
                bins[block.channel], (left, right), edges[block.part : block.part + 2], block, counts
            )
    return counts, pixels


def _centers(coordinates: Float[np.ndarray, "*A N"], size: int) -> Int[np.ndarray, "*A N"]:
    """The first pixel whose centre lies beyond a coordinate, within 0 and the size."""
    return np.clip(np.floor(coordinates + 0.5), 0, size).astype(np.intp)


def _one_by_one(
    bins: Integer[np.ndarray, "C h w"],
    sides: tuple[Int[np.ndarray, " N"], Int[np.ndarray, " N"]],
    edges: Int[np.ndarray, "P1 N"],
    book: Codebook,
    counts: Int[np.ndarray, "K N"],
) -> None:
    n_codes = len(book.part)
    for box, (left, right, bounds) in enumerate(zip(*sides, edges.T, strict=True)):
        for part, channels in enumerate(book.codes):
            for codes, channel_bins in zip(channels, bins, strict=True):
                region = channel_bins[bounds[part] : bounds[part + 1], left:right]
                counts[:, box] += np.bincount(codes.take(region).ravel(), minlength=n_codes + 1)[:n_codes]


def _from_integrals(
    bins: Integer[np.ndarray, "h w"],
    sides: tuple[Int[np.ndarray, " N"], Int[np.ndarray, " N"]],
    bounds: Int[np.ndarray, "2 N"],
    block: Block,
    counts: Int[np.ndarray, "K N"],
) -> None:
    left, right = sides
    first_row, last_row = int(bounds[0].min()), int(bounds[1].max())
    numbers = block.table.take(bins[first_row:last_row])
    width = numbers.shape[1] + 1
    # Where a box's corners lie in an integral image: I(b, r) + I(t, l) - I(t, r) - I(b, l)
    top, bottom = (bounds - first_row) * width
    corners = np.stack([bottom + right, top + left, top + right, bottom + left])
    n_boxes, first = len(left), block.codes.start
    for integrals in _integrals(numbers, block.size):
        found = integrals.take(corners, axis=1, mode="clip").view(np.int32).reshape(-1, 4, n_boxes, LANES)
        totals = found[:, 0] + found[:, 1] - found[:, 2] - found[:, 3]
        n = min(len(totals) * LANES, block.codes.stop - first)
        counts[first : first + n] = totals.swapaxes(1, 2).reshape(-1, n_boxes)[:n]
        first += n


def _integrals(numbers: Integer[np.ndarray, "h w"], n_codes: int) -> Iterator[np.ndarray]:
    """Integral images of four codes each, some at a time; an entry is their four sums in 16 bytes."""
    height, width = numbers.shape
    n_images = -(-n_codes // LANES)
    at_once = max(1, CHUNK_BYTES // (4 * LANES * (height + 1) * (width + 1)))
    # each pixel four times, beside the four codes that it may have
    repeated = (numbers.astype(np.uint32) * np.uint32(0x01010101)).view(np.uint8)
    codes = np.arange(n_images * LANES, dtype=np.uint8).reshape(n_images, 1, LANES)
    row = np.tile(codes, (1, 1, width))
    # one image below the other, a row apart, so that each has rows and columns from 0 to its height and width
    planes: Bool[np.ndarray, "n h1 w4"] = np.zeros((at_once, height + 1, width * LANES), bool)
    for first in range(0, n_images, at_once):
        n = min(at_once, n_images - first)
        np.equal(repeated, row[first : first + n], out=planes[:n, :height])
        integral = cv2.integral(planes[:n].view(np.uint8).reshape(n * (height + 1), width, LANES))
        entries = integral.view(np.complex128).reshape(-1)
        yield entries[: n * (height + 1) * (width + 1)].reshape(n, -1)
