"""Counting from integral images of marks: four marks a pixel, and one look-up at each corner for all four.

Source: Porikli, "Integral histogram" (CVPR 2005).
"""

from collections.abc import Iterable, Iterator
from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Int, Int32, Integer, UInt8, UInt64

from nodes.counting.codebook import KINDS, PLACES, Block, Images

RARE, COMMON, LOW_BITS = 1, 128, 7
"""Marks of two codes in one place: a sum's lower bits count the rarer one, the others the commoner one.

The upper 25 are enough for boxes of 33 million pixels."""
WORD_BYTES = 8
"""Codes that are counted in one word, a byte each."""
JOINED_ROWS = 8
"""Rows of pixels that are compared at once: NumPy takes its time between one piece of memory and the next."""
MOST_ADDED_UP = 255 // JOINED_ROWS * JOINED_ROWS
"""Rows whose marks can be added up before they are summed up: a byte has to hold what comes out."""
CHUNK_BYTES = 100_000
"""Marks that are made at once: what stays in a core's cache beside an integral image."""


def count_block(
    bins: Integer[np.ndarray, "h w"], block: Block, corners: Int[np.ndarray, "4 N"], most: int
) -> Integer[np.ndarray, "k N"]:
    """Counts the codes of one histogram.

    Args:
        bins: Of the pixels.
        block: The codes.
        corners: Where the boxes' corners lie in an integral image: I(t, l), I(t, r), I(b, l), I(b, r).
        most: Pixels of the largest box.
    """
    numbers = block.numbers(bins)
    if block.size <= WORD_BYTES and most < KINDS:
        return _word_sums(numbers, _words(block), corners)[: block.size]
    if block.size <= 2 * PLACES:
        return _table_sums(numbers, _plain_tables(block), corners)[: block.size]
    # What does not occur here at all needs no place, and what does seldom shares one with what does often.
    n_times = cv2.calcHist([numbers], [0], None, [KINDS], [0, KINDS])[block.keys]
    order = n_times.argsort()
    absent, rare = n_times[order].searchsorted((1, COMMON)).tolist()
    n_rare = min(rare - absent, (block.size - absent) // 2)
    rarer, commoner = order[absent : absent + n_rare], order[absent + n_rare :]
    tables = _tables(len(commoner), (block.keys[commoner], COMMON), (block.keys[rarer], RARE))
    sums = _table_sums(numbers, tables, corners)
    counts = np.zeros((block.size, corners.shape[1]), np.int32)
    counts[commoner] = sums[: len(commoner)].view(np.uint32) >> LOW_BITS
    counts[rarer] = sums[:n_rare] & (COMMON - 1)
    return counts


@lru_cache(maxsize=64)
def _words(block: Block) -> UInt64[np.ndarray, " B"]:
    """From the number of a pixel to a word with a 1 in the byte of its code."""
    marks = np.zeros((KINDS, WORD_BYTES), np.uint8)
    marks[block.keys, np.arange(block.size)] = 1
    return marks.view(np.uint64).ravel()


def _word_sums(
    numbers: UInt8[np.ndarray, "h w"], words: UInt64[np.ndarray, " B"], corners: Int[np.ndarray, "4 N"]
) -> UInt8[np.ndarray, "8 N"]:
    """Adds up the words in each box, of so few pixels that each of the sum's bytes is a count.

    The integral image runs over, from byte to byte and at the top, and its rows go on where those above end:
    the differences are right all the same, modulo 2^64.
    """
    height, width = numbers.shape
    integral = np.zeros((height + 1, width + 1), np.uint64)
    np.add.accumulate(words.take(numbers), axis=0, out=integral[1:, 1:])
    entries = integral.ravel()
    np.add.accumulate(entries, out=entries)
    sums = entries.take(corners).reshape(2, 2, -1)
    above = sums[:, 1] - sums[:, 0]
    return (above[1] - above[0]).view(np.uint8).reshape(-1, WORD_BYTES).T


@lru_cache(maxsize=64)
def _plain_tables(block: Block) -> UInt8[np.ndarray, "n B 4"]:
    """A place for each code."""
    return _tables(block.size, (block.keys, 1))


def _tables(n_places: int, *marked: tuple[Integer[np.ndarray, " _"], int]) -> UInt8[np.ndarray, "n B 4"]:
    """From the number of a pixel to its four marks, for each image; in place i those of the i-th numbers."""
    tables = np.zeros((-(-n_places // PLACES), KINDS, PLACES), np.uint8)
    for numbers, mark in marked:
        image, place = np.divmod(np.arange(len(numbers)), PLACES)
        tables[image, numbers, place] = mark
    return tables


def _table_sums(
    numbers: UInt8[np.ndarray, "h w"], tables: UInt8[np.ndarray, "n B 4"], corners: Int[np.ndarray, "4 N"]
) -> Int32[np.ndarray, "n4 N"]:
    sums = _box_sums(_marks_of_tables(numbers, tables), len(tables), numbers.shape, corners)
    return sums.reshape(-1, corners.shape[1])


def _marks_of_tables(
    numbers: UInt8[np.ndarray, "h w"], tables: UInt8[np.ndarray, "n B 4"]
) -> Iterator[UInt8[np.ndarray, "h w 4"]]:
    """One image after the other, all in the same memory."""
    four_in_one = np.empty(numbers.shape, np.int32)
    marks = four_in_one.view(np.uint8).reshape(*numbers.shape, PLACES)
    for table in tables.view(np.int32):
        cv2.LUT(numbers, table, four_in_one)
        yield marks


def inner_rows(begin: int, end: int) -> tuple[int, int]:
    """Which rows to add up before: of those from `begin` to `end`, which every box holds."""
    n = min(end - begin, MOST_ADDED_UP) // JOINED_ROWS * JOINED_ROWS
    return (begin, begin + n) if n > JOINED_ROWS else (0, 0)


def count_channels(
    bins: UInt8[np.ndarray, "C h w"], images: Images, inner: tuple[int, int], corners: Int[np.ndarray, "4 N"]
) -> Int32[np.ndarray, "n 4 N"]:
    """Counts the codes of three histograms.

    Args:
        bins: Of the pixels.
        images: The codes.
        inner: Rows that every box holds, to be added up to one.
        corners: As for `count_block`, in images in which the inner rows are one.

    Returns:
        The counts of `images.codes`.
    """
    begin, end = inner
    # as they lie in memory
    pixels = bins[::-1].transpose(1, 2, 0)
    held = _fours(pixels[begin:end])
    outer = _fours(np.concatenate((pixels[: begin + 1], pixels[end:])) if end else pixels)
    shape = len(pixels) - max(end - begin - 1, 0), pixels.shape[1]
    marks = _marks_of_channels(outer, held, images.numbers, begin, shape)
    return _box_sums(marks, len(images.numbers), shape, corners)


def _fours(pixels: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "n piece"]:
    """Four numbers of each pixel side by side, its three bins and `OTHER`, in pieces of several rows.

    The last piece has rows of whatever number.
    """
    height, width, _ = pixels.shape
    n_pieces = -(-height // JOINED_ROWS)
    numbers = np.zeros((n_pieces * JOINED_ROWS, width, PLACES), np.uint8)
    if height:
        cv2.cvtColor(pixels, cv2.COLOR_BGR2RGBA, numbers[:height])
    return numbers.reshape(n_pieces, JOINED_ROWS * width * PLACES)


def _marks_of_channels(
    outer: UInt8[np.ndarray, "n piece"],
    held: UInt8[np.ndarray, "m piece"],
    numbers: UInt8[np.ndarray, "k 4"],
    row: int,
    shape: tuple[int, int],
) -> Iterator[UInt8[np.ndarray, "h w 4"]]:
    """Marks of 1 where pixels have the numbers of an image, one image after the other.

    Args:
        outer: The pixels.
        held: Those of more rows, of which the marks are added up.
        numbers: Of each image.
        row: Where the sum comes in place of what is there.
        shape: Height and width of the images.
    """
    n_pieces, piece = outer.shape
    alike = numbers.view(np.uint32).repeat(piece // PLACES).view(np.uint8).reshape(len(numbers), 1, piece)
    at_once = max(1, CHUNK_BYTES // outer.size)
    for first in range(0, len(numbers), at_once):
        these = alike[first : first + at_once]
        marks = (outer == these).view(np.uint8).reshape(len(these), n_pieces * JOINED_ROWS, -1)
        if len(held):
            of_pieces = np.add.reduce((held == these).view(np.uint8), axis=1, dtype=np.uint8)
            of_rows = of_pieces.reshape(len(these), JOINED_ROWS, -1)
            np.add.reduce(of_rows, axis=1, dtype=np.uint8, out=marks[:, row])
        yield from marks[:, : shape[0]].reshape(len(these), *shape, PLACES)


def _box_sums(
    marks: Iterable[UInt8[np.ndarray, "h w 4"]],
    n_images: int,
    shape: tuple[int, ...],
    corners: Int[np.ndarray, "4 N"],
) -> Int32[np.ndarray, "n 4 N"]:
    """Adds up the marks in each box, of the four places of each image."""
    height, width = shape
    n_boxes = corners.shape[1]
    integral = np.empty((height + 1, width + 1, PLACES), np.int32)
    # four sums side by side are one entry of 16 bytes
    entries = integral.view(np.complex128).ravel()
    at_corners = np.empty((4, n_boxes), np.complex128)
    left, right = at_corners.view(np.int32).reshape(2, 2, n_boxes * PLACES).swapaxes(0, 1)
    above = np.empty((2, n_boxes * PLACES), np.int32)
    sums = np.empty((n_images, n_boxes * PLACES), np.int32)
    for of_image, sum_of_image in zip(marks, sums, strict=True):
        cv2.integral(of_image, integral)
        entries.take(corners, mode="clip", out=at_corners)
        # what lies between a box's sides above its bottom, less what does above its top
        np.subtract(right, left, out=above)
        np.subtract(above[1], above[0], out=sum_of_image)
    return sums.reshape(n_images, n_boxes, PLACES).swapaxes(1, 2)
