"""Counting every pixel of each box: from integral images, or one box after the other where that is less.

Source: Porikli, "Integral histogram" (CVPR 2005), on the boxes' region and for the reference's colours only.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Int, Integer, UInt8

from nodes.counting.codebook import PLACES, Block, Codebook, Images

FOUR_TIMES = np.uint32(0x01010101)
CHUNK_BYTES = 700_000
"""Integral images that are made at once: what stays in a core's cache. Everything at once is half as fast."""
BOX_COST, PIXEL_COST = 3000, 2
"""What one box costs directly, and each of its pixels, in units of one colour in one pixel of an integral."""


@dataclass(frozen=True, slots=True, eq=False)
class PixelBoxes:
    """Boxes as the whole pixels whose centres lie in them.

    Attributes:
        sides: left and right of each.
        bounds: Where each part of each begins, and where the last one ends.
        region: left, top, right, bottom of what they cover, in the picture; at least one pixel.
        book: The colours that are told apart.
    """

    sides: Int[np.ndarray, "2 N"]
    bounds: Int[np.ndarray, "P1 N"]
    region: tuple[int, int, int, int]
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
        direct = n_channels * (BOX_COST * pixels.size + PIXEL_COST * int(pixels.sum()))
        # one row more, for places that no code has
        counts = np.zeros((n_codes + 1, sides.shape[1]), dtype=np.int32)
        if direct < n_codes * height * width:
            _one_by_one(bins, sides, bounds, book, counts)
        else:
            for part, images in enumerate(book.images):
                _from_integrals(bins, sides, bounds[part : part + 2], images, counts)
        return counts[:n_codes], pixels


def pixel_boxes(boxes: Float[np.ndarray, "N 4"], size_px: tuple[int, int], book: Codebook) -> PixelBoxes:
    """Finds the pixels of boxes.

    Args:
        boxes: left, top, right, bottom in pixels; NaN where there is none.
        size_px: Width and height of the picture.
        book: The colours that are told apart.
    """
    # A pixel belongs to a box that holds its centre; NaN becomes an empty box.
    limits = np.array(size_px * 2, float)
    cells = np.minimum(np.fmax(np.floor(boxes + 0.5), 0), limits).astype(np.intp).T
    sides, bounds = cells[::2], cells[1::2]
    inner = book.part_edges[1:-1, None]
    if len(inner):
        top, bottom = boxes.T[1::2]
        between = np.minimum(np.fmax(np.floor(top + inner * (bottom - top) + 0.5), 0), limits[1])
        bounds = np.concatenate([bounds[:1], between.astype(np.intp), bounds[1:]])
    left, top = int(sides[0].min(initial=size_px[0] - 1)), int(bounds[0].min(initial=size_px[1] - 1))
    region = left, top, int(sides[1].max(initial=left + 1)), int(bounds[-1].max(initial=top + 1))
    return PixelBoxes(sides, bounds, region, book)


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
    """Counts one part's codes from integral images."""
    first_row, last_row = int(bounds[0].min()), int(bounds[1].max())
    height, width, n_boxes = last_row - first_row, bins.shape[2], sides.shape[1]
    # Where a box's corners lie in an integral image: I(b, r) + I(t, l) - I(t, r) - I(b, l)
    rows = (bounds - first_row) * (width + 1)
    corners = rows[[1, 0, 0, 1]] + sides[[1, 0, 1, 0]]
    n_rows = height + 1
    at_once = max(1, CHUNK_BYTES // (4 * PLACES * n_rows * (width + 1)))
    # one below the other and a row apart: each integral has rows and columns from 0 to its height and width
    planes = np.empty((at_once, n_rows, width * PLACES), bool)
    integrals = np.empty((at_once * n_rows + 1, width + 1, PLACES), np.int32)
    for images in of_part:
        pixels, n_images = _numbers(bins[:, first_row:last_row], images.block), len(images.numbers)
        fours = np.repeat(images.numbers.view(np.uint32), width)
        alike = fours.view(np.uint8).reshape(n_images, 1, width * PLACES)
        found = np.empty((n_images, 4, n_boxes), np.complex128)
        for first in range(0, n_images, at_once):
            n = min(at_once, n_images - first)
            np.equal(pixels, alike[first : first + n], out=planes[:n, :height])
            marked = planes[:n].view(np.uint8).reshape(n * n_rows, width, PLACES)
            # four sums side by side are one entry of 16 bytes
            entries = cv2.integral(marked, integrals[: n * n_rows + 1]).view(np.complex128).ravel()
            by_image = entries[: n * n_rows * (width + 1)].reshape(n, -1)
            by_image.take(corners, axis=1, mode="clip", out=found[first : first + n])
        sums = found.view(np.int32).reshape(n_images, 4, n_boxes * PLACES)
        total = sums[:, 0] + sums[:, 1]
        total -= sums[:, 2]
        total -= sums[:, 3]
        counts[images.codes] = total.reshape(n_images, n_boxes, PLACES).swapaxes(1, 2)
    counts[-1] = 0


def _numbers(bins: Integer[np.ndarray, "C h w"], block: Block | None) -> UInt8[np.ndarray, "h w4"]:
    """Four numbers of each pixel side by side: its three bins and one to spare, or four times the same."""
    _, height, width = bins.shape
    if block is not None:
        numbers = (bins[0] if bins.dtype == np.uint8 else block.table.take(bins[0])).astype(np.uint32)
        numbers *= FOUR_TIMES
        return numbers.view(np.uint8)
    if bins.strides[0] == 1 and bins.strides[2] == PLACES:  # as `quantize` leaves them in memory
        return np.lib.stride_tricks.as_strided(bins[0], (height, width * PLACES), (bins.strides[1], 1))
    return np.asarray(cv2.merge([*bins, bins[0]]), dtype=np.uint8).reshape(height, width * PLACES)
