"""The observation of a network's smart camera on the processor array: bins and boxes in, distances out.

A machine of fixed cycles cannot read boxes of any size: each box is sampled on the grid of the options, by
the rule of `nodes.counting.grid`, so that the counts are equal to the last one.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int, Integer

from nodes.counting.grid import rows_of_parts, sample_positions
from nodes.counting.histogram import SamplingOptions
from nodes.simd.array import ProcessorArray
from nodes.simd.cost import Cost
from nodes.simd.memory import Word
from nodes.simd.options import SimdOptions
from nodes.simd.programs.binning import BinningOptions, channel_bins, hue_bins, joint_bins
from nodes.simd.programs.boxes import (
    BoxWords,
    Part,
    Scale,
    StoredPicture,
    add_part,
    count_part,
    normalize_part,
    scale_of,
    similarity,
    store_picture,
    words_for_distance,
)
from nodes.simd.report import FrameReport, Step
from nodes.vision.appearance import Appearance
from nodes.vision.color import ColorOptions
from nodes.vision.pattern import Pattern, pattern_of


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """What the array says about boxes.

    Attributes:
        counts: Of each colour that is told apart, equal to those of `nodes.counting.histogram.count`.
        pixels: Samples in the picture, of each part.
        squared_distance: d² to the reference, as `nodes.vision.pattern.squared_distances` has it up to the
            arithmetic.
    """

    counts: Int[np.ndarray, "N K"]
    pixels: Int[np.ndarray, "N P"]
    squared_distance: Float[np.ndarray, " N"]


class SimdLikelihood:
    """Measures boxes on the array, one element a box, in as many passes as that takes.

    Args:
        options: The processor.
        color: Which colours are told apart.
        sampling: The grid; without one the array cannot follow.
        batching: Whether the emulation runs independent repetitions at once; the numbers are the same.

    Attributes:
        report: What the last measurement has cost, in a frame.

    Raises:
        LineMemoryError: The program needs more words than the line memory has.
        ValueError: The sampling has no grid, or a word is too short for its counts or for the colours.
    """

    def __init__(
        self, options: SimdOptions, color: ColorOptions, sampling: SamplingOptions, *, batching: bool = True
    ) -> None:
        if sampling.grid is None:
            raise ValueError(
                "sampling.grid is null, and the array reads a fixed grid: give columns and rows, or take"
                " filter.backend: fast"
            )
        self.options = options
        self.report: FrameReport | None = None
        self._color, self._batching = color, batching
        self._kernel, (n_columns, self._n_rows) = sampling.kernel, sampling.grid
        self._columns = sample_positions(n_columns, sampling.kernel, 1.0)
        self._rows = sample_positions(self._n_rows, sampling.kernel, 0.5)
        self._require_long_words(color)
        self._require_line_memory(color)

    def _require_long_words(self, color: ColorOptions) -> None:
        """Counts, and the numbers of colours, must not wrap."""
        most = (1 << self.options.bits) - 1
        parts = rows_of_parts(self._n_rows, self._kernel, color.parts)
        n_samples = len(self._columns) * max(part.stop - part.start for part in parts)
        if n_samples > most:
            raise ValueError(
                f"sampling.grid is [{len(self._columns)}, {self._n_rows}], which has {n_samples:,} samples in"
                f" one part of the box, and a word of {self.options.bits} bits counts to {most:,}: take fewer"
            )
        if color.n_bins > most:
            raise ValueError(
                f"color.bins_per_channel is {color.bins_per_channel}, which makes {color.n_bins:,} bins, and"
                f" a word of {self.options.bits} bits counts to {most:,}: take fewer"
            )

    def _require_line_memory(self, color: ColorOptions) -> None:
        """Measures a box of one colour: more of them take words that are free, or one after the other."""
        shares = np.zeros((len(color.parts), color.n_channels, color.n_bins))
        shares[..., 0] = 1
        plain = Appearance(shares, shares, np.ones_like(shares), 1.0, 1.0, own=True)
        bins, box = np.zeros((color.n_channels, 1, 1), np.uint8), np.zeros((1, 4))
        self.measure(bins, box, pattern_of(plain, color), (1, 1))
        self.report = None

    def measure(
        self,
        bins: Integer[np.ndarray, "C h w"],
        boxes: Float[np.ndarray, "N 4"],
        pattern: Pattern,
        picture_px: tuple[int, int],
    ) -> Measurement:
        """Counts and distances; `report` tells what they have cost.

        Args:
            bins: Bin indices of the pixels (of the region that the boxes need, or of the whole picture).
            boxes: left, top, right, bottom relative to `bins`, in pixels; they may reach over the border.
            pattern: The reference.
            picture_px: Width and height of the whole picture, which the array bins.
        """
        n_elements = self.options.processing_elements
        n_lanes = len(boxes) if self._batching else n_elements
        array = ProcessorArray(self.options, batching=self._batching, lanes=n_lanes)
        array.costs[Step.BINNING] = Cost()
        array.costs[Step.BINNING].add(
            line_cost(self.options, self._color), times=picture_px[1] * -(-picture_px[0] // n_elements)
        )
        picture = store_picture(bins, self._color.n_bins, self.options.bits)
        boxes = np.where(np.isnan(boxes), -1e6, boxes)
        parts = self._parts(pattern)
        counts = np.empty((len(boxes), len(pattern.book.part)), int)
        pixels = np.empty((len(boxes), len(parts)), int)
        ratio = np.empty(len(boxes))
        for first in range(0, len(boxes), max(n_lanes, 1)):
            of_pass = slice(first, first + n_lanes)
            one_pass = _Pass(array, picture, boxes[of_pass])
            counts[of_pass], pixels[of_pass], ratio[of_pass] = one_pass.run(parts)
        self.report = FrameReport.of(array, picture_px[1], min(len(boxes), n_elements))
        return Measurement(counts, pixels, 1 - ratio)

    def _parts(self, pattern: Pattern) -> list[Part]:
        of_codes = np.argwhere(pattern.book.codes < len(pattern.book.part))
        slices = rows_of_parts(self._n_rows, self._kernel, pattern.book.part_heights)
        return [
            Part(
                self._columns,
                self._rows[rows],
                of_codes[first:last, 1],
                of_codes[first:last, 2],
                pattern.scale[first:last],
                float(perfect),
            )
            for rows, (first, last), perfect in zip(
                slices, pairwise(pattern.ends), pattern.perfect, strict=True
            )
        ]


class _Pass:
    """The boxes that the elements hold at once."""

    def __init__(
        self, array: ProcessorArray, picture: StoredPicture, boxes: Float[np.ndarray, "N 4"]
    ) -> None:
        self._array, self._picture = array, picture
        self._active = slice(0, len(boxes))
        left, top, right, bottom = boxes.T
        self._boxes = BoxWords(*(array.word("Boxes", 2, real=True) for _ in range(4)))
        for word, lanes in zip(self._boxes.all, (left, top, right - left, bottom - top), strict=True):
            array.input(word, lanes)

    def run(
        self, parts: list[Part]
    ) -> tuple[Int[np.ndarray, "N K"], Int[np.ndarray, "N P"], Float[np.ndarray, " N"]]:
        """Counts, samples inside and the similarity coefficient / perfect."""
        array, scale = self._array, scale_of(parts, self._array.options)
        coefficient, perfect = array.number(), array.number()
        array.copy(coefficient, 0)
        array.copy(perfect, 0)
        counts, pixels = [], []
        with array.using(coefficient, perfect, *self._boxes.all):
            for index, part in enumerate(parts):
                of_part, inside = self._run_part(part, coefficient, perfect, scale, index)
                counts += of_part
                pixels.append(inside)
            with array.step(Step.DISTANCES):
                ratio = similarity(array, coefficient, perfect)
                similar = array.collect(ratio, self._active) / scale.one
                array.free(ratio)
        return _columns(counts, len(similar)), _columns(pixels, len(similar)), similar

    def _run_part(
        self, part: Part, coefficient: Word, perfect: Word, scale: Scale, index: int
    ) -> tuple[list[np.ndarray], np.ndarray]:
        """One part: its counts, a word of them at a time, and the samples inside."""
        array = self._array
        pixels, own = array.word(), array.number()
        counts = []
        with array.using(pixels, own):
            array.copy(own, 0)
            n_free = array.line_memory.size - array.line_memory.used - words_for_distance(array.options)
            for first in range(0, max(len(part.bins), 1), max(n_free, 1)):
                which = slice(first, min(first + max(n_free, 1), len(part.bins)))
                words = [array.word("Histograms") for _ in part.bins[which]]
                with array.using(*words):
                    with array.step(Step.HISTOGRAMS):
                        count_part(
                            array, words, which, part, self._boxes, self._picture, pixels, self._active
                        )
                    counts += [word.value[self._active] for word in words]
                    with array.step(Step.DISTANCES):
                        add_part(array, own, words, which, part, scale, scale.shifts[index])
            with array.step(Step.DISTANCES):
                normalize_part(array, own, pixels, part.n_samples)
                array.add(coefficient, coefficient, own)
                inside = array.less(0, pixels)
                array.add(perfect, perfect, scale.held(part.perfect), when=inside)
            return counts, pixels.value[self._active]


def _columns(lanes: list[np.ndarray], n: int) -> Int[np.ndarray, "N k"]:
    return np.stack(lanes, axis=1).astype(int) if lanes else np.zeros((n, 0), int)


@lru_cache
def line_cost(options: SimdOptions, color: ColorOptions) -> Cost:
    """What binning a line costs: the same whatever is in it, so one is run and counted."""
    array = ProcessorArray(options)
    buffers = (array.word(), array.word(), array.word())
    with array.step(Step.BINNING) as cost:
        if color.space == "hue":
            hue_bins(array, *buffers, BinningOptions(bins=color.bins_per_channel))
        elif color.space == "joint_rgb":
            joint_bins(array, *buffers, color.bins_per_channel, np.ones(3))
        else:
            channel_bins(array, buffers, color.bins_per_channel, np.ones(3))
    fits_one = color.n_channels * (color.n_bins - 1).bit_length() <= options.bits
    cost.external_writes = array.n * (1 if fits_one else color.n_channels)
    return cost
