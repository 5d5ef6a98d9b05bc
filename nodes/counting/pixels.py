"""Counting every pixel of each box: from integral images, or one box after the other where that is less."""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, Integer

from nodes.counting.codebook import Codebook, counting_type
from nodes.counting.integrals import count_block, count_channels, inner_rows

BOX_COST, PIXEL_COST = 30_000, 10
"""What one box costs directly, and each of its pixels, in units of one colour in one pixel of an integral."""


class Rows(NamedTuple):
    """Rows of the picture that one part covers in all boxes.

    Attributes:
        first: The first of them.
        held_from: The first that every box holds.
        held_to: The one after the last that every box holds.
        last: The one after the last of all.
    """

    first: int
    held_from: int
    held_to: int
    last: int


@dataclass(frozen=True, slots=True, eq=False)
class PixelBoxes:
    """Boxes as the whole pixels whose centres lie in them.

    Attributes:
        sides: left and right of each.
        bounds: Where each part of each begins, and where the last one ends.
        region: left, top, right, bottom of what they cover, in the picture; at least one pixel.
        rows: Of each part.
        book: The colours that are told apart.
    """

    sides: Int[np.ndarray, "2 N"]
    bounds: Int[np.ndarray, "P1 N"]
    region: tuple[int, int, int, int]
    rows: tuple[Rows, ...]
    book: Codebook

    def count(
        self, bins: Integer[np.ndarray, "C h w"]
    ) -> tuple[Integer[np.ndarray, "K N"], Int[np.ndarray, "P N"]]:
        """Counts the colours of their pixels.

        Args:
            bins: Bin indices of the pixels of the region.

        Returns:
            Counts of each code, and pixels in each part.
        """
        sides, bounds, n_codes = self.sides, self.bounds, len(self.book.part)
        n_channels, height, width = bins.shape
        pixels = (bounds[1:] - bounds[:-1]) * (sides[1] - sides[0])
        left_for_pixels = n_codes * height * width - n_channels * BOX_COST * pixels.size
        if left_for_pixels > 0 and n_channels * PIXEL_COST * int(pixels.sum()) < left_for_pixels:
            return self._one_by_one(bins), pixels
        # one row more, for places that no code has
        counts = np.zeros((n_codes + 1, sides.shape[1]), counting_type(height * width))
        for part, rows in enumerate(self.rows):
            if rows.first >= rows.last or not pixels.size:
                continue
            of_part = bins[:, rows.first - self.region[1] : rows.last - self.region[1]]
            if n_channels == 1:
                corners, most = self._corners(part, rows, width), int(np.maximum.reduce(pixels[part]))
                for block in self.book.blocks_of[part]:
                    counts[block.codes] = count_block(of_part[0], block, corners, most)
            else:
                images = self.book.images[part]
                inner = inner_rows(rows.held_from - rows.first, rows.held_to - rows.first)
                corners = self._corners(part, rows, width, max(inner[1] - inner[0] - 1, 0))
                counts[images.codes] = count_channels(of_part, images, inner, corners)
        return counts[:n_codes], pixels

    def _corners(self, part: int, rows: Rows, width: int, n_left_out: int = 0) -> Int[np.ndarray, "4 N"]:
        """Where the boxes' corners lie in an integral image: I(t, l), I(t, r), I(b, l), I(b, r).

        Args:
            part: The part.
            rows: Its rows.
            width: Of the region.
            n_left_out: How many rows between tops and bottoms the image does not have.
        """
        stride = width + 1
        begins = self.bounds[part : part + 2] * stride
        begins -= rows.first * stride + self.region[0]
        if n_left_out:
            begins[1] -= n_left_out * stride
        return (begins[:, None] + self.sides).reshape(4, -1)

    def _one_by_one(self, bins: Integer[np.ndarray, "C h w"]) -> Int[np.ndarray, "K N"]:
        (left, top, _, _), n_codes = self.region, len(self.book.part)
        counts = np.zeros((n_codes + 1, self.sides.shape[1]), np.int32)
        boxes = zip((self.sides - left).T, (self.bounds - top).T, strict=True)
        for box, ((begin, end), edges) in enumerate(boxes):
            for part, channels in enumerate(self.book.codes):
                for codes, channel_bins in zip(channels, bins, strict=True):
                    of_box = channel_bins[edges[part] : edges[part + 1], begin:end]
                    counts[:, box] += np.bincount(codes.take(of_box).ravel(), minlength=n_codes + 1)
        return counts[:n_codes]


def pixel_boxes(boxes: Float[np.ndarray, "N 4"], size_px: tuple[int, int], book: Codebook) -> PixelBoxes:
    """Finds the pixels of boxes.

    Args:
        boxes: left, top, right, bottom in pixels; NaN where there is none.
        size_px: Width and height of the picture.
        book: The colours that are told apart.
    """
    # A pixel belongs to a box that holds its centre.
    width, height = size_px
    edges = np.add(boxes.T, 0.5, order="C")
    left, top, held_to, held_from, right, bottom = _extremes(edges, max(size_px))
    if not (left >= 0 and top >= 0 and right <= width and bottom <= height):  # also where one is NaN
        _clip(edges, _limits(size_px))
        left, top, held_to, held_from, right, bottom = _extremes(edges, max(size_px))
    # the floor of what is not negative
    cells = edges.astype(np.intp)
    sides, bounds = cells[::2], cells[1::2]
    # at least one pixel
    left, top = min(int(left), width - 1), min(int(top), height - 1)
    region = left, top, max(int(right), left + 1), max(int(bottom), top + 1)
    rows: tuple[Rows, ...] = (Rows(top, int(held_from), int(held_to), region[3]),)
    if len(book.part_heights) > 1:
        tops, bottoms = boxes.T[1::2]
        between = tops + book.part_edges[1:-1, None] * (bottoms - tops) + 0.5
        _clip(between, height)
        bounds = np.concatenate([bounds[:1], between.astype(np.intp), bounds[1:]])
        low = np.minimum.reduce(bounds, axis=1, initial=height).tolist()
        high = np.maximum.reduce(bounds, axis=1, initial=0).tolist()
        rows = tuple(map(Rows, low, high, low[1:], high[1:]))
    return PixelBoxes(sides, bounds, region, rows, book)


@lru_cache
def _limits(size_px: tuple[int, int]) -> Float[np.ndarray, "4 1"]:
    return np.array([*size_px, *size_px], float)[:, None]


def _extremes(edges: Float[np.ndarray, "4 N"], most: int) -> tuple[float, ...]:
    """Least left, top and bottom, and greatest top, right and bottom; NaN where one is."""
    left, top, _, held_to = np.minimum.reduce(edges, axis=1, initial=most).tolist()
    _, held_from, right, bottom = np.maximum.reduce(edges, axis=1, initial=0).tolist()
    return left, top, held_to, held_from, right, bottom


def _clip(edges: Float[np.ndarray, "E N"], sizes: int | Float[np.ndarray, "E 1"]) -> None:
    """Brings edges into the picture, NaN to 0."""
    np.fmax(edges, 0, out=edges)
    np.minimum(edges, sizes, out=edges)
