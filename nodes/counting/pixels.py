"""Counting every pixel of each box: from integral images, or one box after the other where that is less.

Source: Porikli, "Integral histogram" (CVPR 2005), on the boxes' region and for the reference's colours only.
"""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from jaxtyping import Float, Int, Integer, UInt8

from nodes.counting.codebook import PLACES, Block, Codebook, Images

FOUR_TIMES = np.uint32(0x01010101)
CHUNK_BYTES = 350_000
"""Integral images that are made at once: what stays in a core's cache. Everything at once is half as fast."""
JOINED_ROWS = 8
"""Rows of pixels that are compared at once: NumPy takes its time between one piece of memory and the next."""
BOX_COST, PIXEL_COST = 3000, 2
"""What one box costs directly, and each of its pixels, in units of one colour in one pixel of an integral."""


@dataclass(frozen=True, slots=True, eq=False)
class PixelBoxes:
    """Boxes as the whole pixels whose centres lie in them.

    Attributes:
        sides: left and right of each.
        bounds: Where each part of each begins, and where the last one ends.
        region: left, top, right, bottom of what they cover, in the picture; at least one pixel.
        rows: The first row of each part, and the one after its last.
        book: The colours that are told apart.
    """

    sides: Int[np.ndarray, "2 N"]
    bounds: Int[np.ndarray, "P1 N"]
    region: tuple[int, int, int, int]
    rows: tuple[tuple[int, int], ...]
    book: Codebook

    def count(
        self, bins: Integer[np.ndarray, "C h w"]
    ) -> tuple[Int[np.ndarray, "K N"], Int[np.ndarray, "P N"]]:
        """Counts the colours of their pixels.

        Args:
            bins: Bin indices of the pixels of the region.

        Returns:
            Counts of each code, and pixels in each part.
        """
        book, (left, top, _, _) = self.book, self.region
        n_codes, (n_channels, height, width) = len(book.part), bins.shape
        sides, bounds = self.sides - left, self.bounds - top
        pixels = (bounds[1:] - bounds[:-1]) * (sides[1] - sides[0])
        # one row more, for places that no code has
        counts = np.zeros((n_codes + 1, sides.shape[1]), dtype=np.int32)
        left_for_pixels = n_codes * height * width - n_channels * BOX_COST * pixels.size
        if left_for_pixels > 0 and n_channels * PIXEL_COST * int(pixels.sum()) < left_for_pixels:
            _one_by_one(bins, sides, bounds, book, counts)
        else:
            for part, images in enumerate(book.images):
                first, last = self.rows[part]
                of_part = bins[:, first - top : last - top]
                _from_integrals(of_part, sides, self.bounds[part : part + 2] - first, images, counts)
        return counts[:n_codes], pixels


def pixel_boxes(boxes: Float[np.ndarray, "N 4"], size_px: tuple[int, int], book: Codebook) -> PixelBoxes:
    """Finds the pixels of boxes.

    Args:
        boxes: left, top, right, bottom in pixels; NaN where there is none.
        size_px: Width and height of the picture.
        book: The colours that are told apart.
    """
    # A pixel belongs to a box that holds its centre; NaN becomes an empty box.
    edges, (width, height) = np.add(boxes.T, 0.5, order="C"), size_px
    cells = _whole_pixels(edges, np.array([[width], [height], [width], [height]], float))
    sides, bounds = cells[::2], cells[1::2]
    low = np.minimum.reduce(cells, axis=1, initial=max(size_px)).tolist()
    high = np.maximum.reduce(cells, axis=1, initial=0).tolist()
    region = _at_least_one_pixel(min(low[0], width - 1), min(low[1], height - 1), high[2], high[3])
    rows: tuple[tuple[int, int], ...] = ((region[1], region[3]),)
    inner = book.part_edges[1:-1, None]
    if len(inner):
        top, bottom = boxes.T[1::2]
        between = _whole_pixels(top + inner * (bottom - top) + 0.5, height)
        bounds = np.concatenate([bounds[:1], between, bounds[1:]])
        rows = tuple(
            (int(begin.min(initial=height - 1)), int(end.max(initial=0))) for begin, end in pairwise(bounds)
        )
    return PixelBoxes(sides, bounds, region, rows, book)


def _at_least_one_pixel(left: int, top: int, right: int, bottom: int) -> tuple[int, int, int, int]:
    return left, top, max(right, left + 1), max(bottom, top + 1)


def _whole_pixels(
    edges: Float[np.ndarray, "E N"], sizes: int | Float[np.ndarray, "E 1"]
) -> Int[np.ndarray, "E N"]:
    """Whole pixels within the picture, 0 for NaN; writes into its argument."""
    np.floor(edges, out=edges)
    np.fmax(edges, 0, out=edges)
    np.minimum(edges, sizes, out=edges)
    return edges.astype(np.intp)


def _one_by_one(
    bins: Integer[np.ndarray, "C h w"],
    sides: Int[np.ndarray, "2 N"],
    bounds: Int[np.ndarray, "P1 N"],
    book: Codebook,
    counts: Int[np.ndarray, "K1 N"],
) -> None:
    n_kinds = len(counts)
    for box, ((left, right), edges) in enumerate(zip(sides.T, bounds.T, strict=True)):
        for part, channels in enumerate(book.codes):
            for codes, channel_bins in zip(channels, bins, strict=True):
                region = channel_bins[edges[part] : edges[part + 1], left:right]
                counts[:, box] += np.bincount(codes.take(region).ravel(), minlength=n_kinds)


def _from_integrals(
    bins: Integer[np.ndarray, "C h w"],
    sides: Int[np.ndarray, "2 N"],
    bounds: Int[np.ndarray, "2 N"],
    of_part: tuple[Images, ...],
    counts: Int[np.ndarray, "K1 N"],
) -> None:
    """Counts one part's codes from integral images.

    Args:
        bins: Of the part's rows of the region.
        sides: Of the boxes, from the region's left side.
        bounds: Where the part begins and ends in each box, from its first row.
        of_part: What is counted.
        counts: Where the counts are put.
    """
    (_, height, width), n_boxes = bins.shape, sides.shape[1]
    # Integrals lie one below the other, at least a row apart: each has rows and columns from 0 to its height
    # and width.
    n_pieces = height // JOINED_ROWS + 1
    n_rows, piece = n_pieces * JOINED_ROWS, JOINED_ROWS * width * PLACES
    at_once = max(1, CHUNK_BYTES // (4 * PLACES * n_rows * (width + 1)))
    # Where a box's corners lie in an integral image: I(t, l), I(t, r), I(b, l), I(b, r)
    corners = ((bounds * (width + 1))[:, None] + sides).reshape(4, n_boxes)
    planes = np.empty((at_once, n_pieces, piece), bool)
    integrals = np.empty((at_once * n_rows + 1, width + 1, PLACES), np.int32)
    for images in of_part:
        pixels = _numbers(bins, images.block, n_rows).reshape(n_pieces, piece)
        n_images = len(images.numbers)
        fours = images.numbers.view(np.uint32).repeat(piece // PLACES)
        alike = fours.view(np.uint8).reshape(n_images, 1, piece)
        found = np.empty((n_images, 4, n_boxes), np.complex128)
        for first in range(0, n_images, at_once):
            n = min(at_once, n_images - first)
            np.equal(pixels, alike[first : first + n], out=planes[:n])
            marked = planes[:n].view(np.uint8).reshape(n * n_rows, width, PLACES)
            # four sums side by side are one entry of 16 bytes
            entries = cv2.integral(marked, integrals[: n * n_rows + 1]).view(np.complex128).ravel()
            by_image = entries[: n * n_rows * (width + 1)].reshape(n, -1)
            by_image.take(corners, axis=1, mode="clip", out=found[first : first + n])
        sums = found.view(np.int32).reshape(n_images, 4, n_boxes * PLACES)
        # bottom right, less what is left of the box, less what is above it, and what is both
        total = sums[:, 3] - sums[:, 2]
        total -= sums[:, 1]
        total += sums[:, 0]
        counts[images.codes] = total.reshape(n_images, n_boxes, PLACES).swapaxes(1, 2)
    counts[-1] = 0


def _numbers(
    bins: Integer[np.ndarray, "C h w"], block: Block | None, n_rows: int
) -> UInt8[np.ndarray, "n_rows w4"]:
    """Four numbers of each pixel side by side: its three bins and one to spare, or four times the same.

    Below them are rows of whatever number, to be `n_rows` in all.
    """
    _, height, width = bins.shape
    numbers = np.zeros((n_rows, width, PLACES), np.uint8)
    if block is None:
        beside = bins.transpose(1, 2, 0)
        if beside.strides[1:] == (PLACES, 1):  # as `quantize` leaves them in memory
            beside = np.lib.stride_tricks.as_strided(beside, (height, width, PLACES))
        numbers[:height, :, : beside.shape[2]] = beside
    elif bins.dtype == np.uint8:
        np.multiply(bins[0], FOUR_TIMES, out=numbers.view(np.uint32)[:height, :, 0])
    else:
        (block.table * FOUR_TIMES).take(bins[0], out=numbers.view(np.uint32)[:height, :, 0], mode="clip")
    return numbers.reshape(n_rows, width * PLACES)
