"""Histograms of many regions at once: Algorithms 1 and 2 of Medeiros et al. (2008)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Int

from nodes.simd.array import ProcessorArray
from nodes.simd.memory import ExternalMemory, Word


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """Which pixels around a corner are counted, and how often each.

    Attributes:
        columns: Of the samples, from the left corner.
        rows: Of the samples, from the top.
        weights: How much each counts.
        size_px: Width and height of the rectangle that holds them.
    """

    columns: Int[np.ndarray, " S"]
    rows: Int[np.ndarray, " S"]
    weights: Int[np.ndarray, " S"]
    size_px: tuple[int, int]

    @property
    def total(self) -> int:
        """What a histogram of the region adds up to."""
        return int(self.weights.sum())


def region(
    width: int,
    height: int,
    shape: Literal["rectangle", "ellipse"] = "rectangle",
    kernel: Literal["uniform", "epanechnikov"] = "uniform",
) -> Region:
    """A region of this size: all of its rectangle or the ellipse in it, alike or less towards the border.

    The kernel's weights are whole numbers from 1 to 4, so that counts stay in a word.
    """
    rows, columns = (axis.ravel() for axis in np.mgrid[:height, :width])
    u, v = (2 * columns + 1) / width - 1, (2 * rows + 1) / height - 1
    squared_radius = u**2 + v**2
    inside = squared_radius <= 1 if shape == "ellipse" else np.full(len(columns), fill_value=True)
    # k(r) = 1 - r², of the ellipse through the rectangle's corners if all of that counts
    falling = 1 - squared_radius / (1 if shape == "ellipse" else 2)
    weights = np.ceil(4 * falling).clip(1, 4) if kernel == "epanechnikov" else np.ones(len(columns))
    samples = (axis[inside].astype(np.int32) for axis in (columns, rows, weights))
    columns, rows, weights = samples
    return Region(columns, rows, weights, (width, height))


def particles_in_columns(n_particles: int, n_elements: int, size_px: tuple[int, int]) -> bool:
    """Whether one element a particle (Algorithm 2) is the faster way: M > n_x r_y / (r_x + r_y)."""
    width, height = size_px
    return n_particles > n_elements * height / (width + height)


def count_in_columns(
    array: ProcessorArray,
    histogram: Sequence[Word],
    memory: ExternalMemory,
    center: tuple[Word, Word],
    fraction_bits: int,
    sampling: tuple[Word, Word, Word],
    counted: Region,
    active: slice,
    *,
    first_bin: int = 0,
) -> None:
    """Algorithm 2: each active element counts the bins from `first_bin` on in the region of one particle.

    Args:
        array: The processor.
        histogram: A word for each bin that is counted.
        memory: Bins of the pixels.
        center: x and y of each particle.
        fraction_bits: Bits of them after the point.
        sampling: Words for the column, the row and the pixel of a sample.
        counted: Which pixels count.
        active: The elements that have a particle.
        first_bin: Of the histogram.
    """
    for word in histogram:
        array.copy(word, 0)
    column, row, pixel = sampling
    columns, rows = (
        offsets - size // 2
        for offsets, size in zip((counted.columns, counted.rows), counted.size_px, strict=True)
    )
    alike = bool(np.all(counted.weights == 1))
    for sample in array.repeat(len(counted.columns)):
        # read position (x + k, y + j) from the external memory
        array.shift_right(column, center[0], fraction_bits)
        array.add(column, column, columns[sample])
        array.shift_right(row, center[1], fraction_bits)
        array.add(row, row, rows[sample])
        array.fetch(pixel, memory, column, row, active)
        # update the histogram
        for bin_, word in enumerate(histogram, start=first_bin):
            array.accumulate(word, 1 if alike else counted.weights[sample], when=array.equal(pixel, bin_))


def count_side_by_side(
    array: ProcessorArray,
    histogram: Sequence[Word],
    memory: ExternalMemory,
    corners: Int[np.ndarray, "N 2"],
    size_px: tuple[int, int],
    sampling: tuple[Word, Word, Word],
    *,
    first_bin: int = 0,
) -> Int[np.ndarray, "N B"]:
    """Algorithm 1: each element counts one column of a region, then neighbours add up.

    The regions lie side by side in the line memory, over as many passes as they need.

    Args:
        array: The processor.
        histogram: A word for each bin that is counted.
        memory: Bins of the pixels.
        corners: Left and top of each region.
        size_px: Width r_x and height r_y.
        sampling: Words for the column, the row and the pixel of a sample.
        first_bin: Of the histogram.

    Returns:
        The histograms, as the digital output processor takes them from the last element of each region.
    """
    width, height = size_px
    per_pass = array.n // width
    n_passes = -(-len(corners) // per_pass)
    # Places that are left over in the last pass repeat the last region.
    which = np.minimum(np.arange(n_passes * per_pass), len(corners) - 1).reshape(n_passes, per_pass)
    lines = np.repeat(corners[which], width, axis=1)
    used, last = slice(0, per_pass * width), slice(width - 1, per_pass * width, width)
    column, row, pixel = sampling
    counts = []
    with array.using(array.word()) as (place,):
        array.input(place, np.arange(array.n) % width)
        for index in array.repeat(n_passes):
            array.input(column, lines[np.squeeze(index)][..., 0])
            array.input(row, lines[np.squeeze(index)][..., 1])
            array.add(column, column, place)
            for word in histogram:
                array.copy(word, 0)
            for _ in range(height):
                # read position (x + i mod r_x, y + j), update the column histogram
                array.fetch(pixel, memory, column, row, used)
                for bin_, word in enumerate(histogram, start=first_bin):
                    array.add(word, word, 1, when=array.equal(pixel, bin_))
                array.add(row, row, 1)
            for k in range(1, width):
                # add the histogram of the columns before to that of the next one
                turn = array.equal(place, k)
                for word in histogram:
                    array.add(word, word, array.neighbour(word, -1), when=turn)
            counts.append(np.stack([array.collect(word, last) for word in histogram], axis=-1))
    return np.concatenate([each.reshape(-1, len(histogram)) for each in counts])[: len(corners)]


def count_in_passes(
    array: ProcessorArray,
    histogram: Sequence[Word],
    memory: ExternalMemory,
    center: tuple[Word, Word],
    fraction_bits: int,
    sampling: tuple[Word, Word, Word],
    counted: Region,
    active: slice,
    *,
    first_bin: int = 0,
) -> None:
    """Algorithm 1 in the place of `count_in_columns`, for plain rectangles.

    The output processor takes the corners out and the histograms too, the input processor brings the regions'
    columns to their places and the histograms to the elements of the particles.
    """
    corners = []
    with array.using(array.word()) as (corner,):
        for middle, size in zip(center, counted.size_px, strict=True):
            array.shift_right(corner, middle, fraction_bits)
            array.subtract(corner, corner, size // 2)
            corners.append(array.collect(corner, active))
    counts = count_side_by_side(
        array,
        histogram,
        memory,
        np.stack(corners, axis=1).astype(int),
        counted.size_px,
        sampling,
        first_bin=first_bin,
    )
    for word, of_bin in zip(histogram, counts.T, strict=True):
        lanes = np.zeros(array.n, int)
        lanes[active] = of_bin
        array.input(word, lanes)
