"""The tracker of Medeiros et al. (2008), whole, on the processor array: one picture in, one position out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate

import numpy as np
from jaxtyping import Float, UInt8

from network.streams import stream
from nodes.simd.array import ProcessorArray
from nodes.simd.limits import require_fitting, require_room
from nodes.simd.memory import ExternalMemory, Word
from nodes.simd.programs.binning import bin_picture
from nodes.simd.programs.counting import (
    count_in_columns,
    count_in_passes,
    particles_in_columns,
    region,
)
from nodes.simd.programs.motion import coefficients_of, deviation_of, predict, seeds
from nodes.simd.programs.normalizing import Group, add_up, normalized, scale_factor, weighted_mean
from nodes.simd.programs.resampling import replicate, replication_bounds
from nodes.simd.programs.weighing import Reference, add_coefficient, likelihood, reference
from nodes.simd.report import FrameReport, Step
from nodes.simd.tracker_options import TrackerOptions

ROOMY = 1 << 12
"""Words of a line memory in which any program fits."""


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """What the tracker knows of one target.

    Attributes:
        group: The elements of its particles.
        reference: What it looks like.
    """

    group: Group
    reference: Reference


class SimdTracker:
    """Follows one or several targets in the image plane.

    Args:
        options: The tracker.
        rng: All its randomness: the seeds of the elements' generators and the control processor's draws.
        batching: Whether the emulation runs independent repetitions at once; the numbers are the same.

    Raises:
        LineMemoryError: The program needs more words than the line memory has.
        ValueError: There are more particles than processing elements, or a word is too short for an option.
    """

    def __init__(self, options: TrackerOptions, rng: np.random.Generator, *, batching: bool = True) -> None:
        self.options = options
        self._rng = rng
        self.array = array = ProcessorArray(options.simd, batching=batching)
        n_used = sum(options.n_particles)
        self._region = region(*options.region_px, options.shape, options.kernel)
        require_room(options, self._region)
        self._coefficients = coefficients_of(options.process, options.simd.bits)
        # the rightmost elements, as in the paper
        firsts = accumulate(options.n_particles[:-1], initial=array.n - n_used)
        self._groups = [Group(first, n) for first, n in zip(firsts, options.n_particles, strict=True)]
        self._active = slice(array.n - n_used, array.n)
        # Algorithm 1 counts every pixel of rectangles, and is the faster one for few particles.
        plain = options.shape == "rectangle" and options.kernel == "uniform"
        fits = options.region_px[0] <= array.n
        few = not particles_in_columns(n_used, array.n, options.region_px)
        self._side_by_side = plain and fits and few
        # Everything that lives from one frame to the next, or through the odd lines in between
        self._state = [array.number("Target state (current and previous)", 1) for _ in range(4)]
        self._weight = array.number("Particle weights")
        self._generator = array.word(n_words=2)
        red, green, blue = (array.word("Video line buffers") for _ in range(3))
        self._buffers = (red, green, blue)
        self._sampling = (array.word(), array.word(), array.word())
        n_bins = options.binning.n_bins
        n_words = options.histogram_words or max(1, n_bins - _missing_words(options))
        self._histogram = [array.word("Histograms") for _ in range(min(n_words, n_bins))]
        self._place = array.word()
        array.input(self._generator, seeds(array, rng))
        # beyond the last place in elements without a particle
        array.input(
            self._place, np.append(np.full(array.n - n_used, (1 << options.simd.bits) - 2), np.arange(n_used))
        )
        self._targets: list[Target] = []

    def begin(
        self, image: UInt8[np.ndarray, "H W 3"], *positions: Float[np.ndarray, " _"]
    ) -> Float[np.ndarray, "G 2"]:
        """Takes the references from the first picture.

        Args:
            image: Blue, green, red; not wider than the array.
            positions: x and y of each target's centre, in pixels, and those of the frame before where they
                differ.

        Returns:
            The positions.

        Raises:
            ValueError: The picture is too large or too small, there are not so many targets, one of them is
                outside, or the noise cannot be held.
        """
        height, width = image.shape[:2]
        require_fitting(self.options, width, height, positions)
        self._memory = ExternalMemory(height, width)
        # coordinates in fractions of a pixel, as fine as a word allows
        self._fraction_bits = self.options.simd.bits - (max(width, height) - 1).bit_length()
        self._deviation = deviation_of(self.options.noise_px, self._fraction_bits, self.options.simd.bits)
        self._bin(image)
        for group, position in zip(self._groups, positions, strict=True):
            before = np.clip(position[-2:], 0, (width - 1, height - 1))
            for word, coordinate in zip(self._state, np.r_[position[:2], before], strict=True):
                lanes = word.value.copy()
                lanes[group.elements] = round(float(coordinate) * (1 << self._fraction_bits))
                self.array.input(word, lanes)
        counts = np.zeros((len(self._groups), self.options.binning.n_bins), int)
        for first, words in self._count():
            for group, of_group in zip(self._groups, counts, strict=True):
                of_group[first : first + len(words)] = [self.array.peek(word, group.first) for word in words]
        self._targets = [
            Target(group, reference(of_group, self._region.total, self.options.simd))
            for group, of_group in zip(self._groups, counts, strict=True)
        ]
        return np.stack([position[:2] for position in positions])

    def step(self, image: UInt8[np.ndarray, "H W 3"]) -> Float[np.ndarray, "G 2"]:
        """One frame.

        Args:
            image: Blue, green, red.

        Returns:
            The weighted mean of each target's particles, x and y in pixels. The chip has it one frame later.
        """
        array = self.array
        array.costs.clear()
        self._bin(image)
        with array.step(Step.PREDICTION):
            self._predict(*image.shape[1::-1])
        coefficient = array.number()
        with array.using(coefficient):
            self._compare(coefficient)
            # The histograms are not needed any more: what follows takes their words.
            array.free(*self._histogram)
            with array.step(Step.LIKELIHOODS):
                self._weigh(coefficient)
        self._particles, self._weights = self._positions(), self._weight.value.astype(float)
        means = np.stack([self._estimate_and_resample(target) for target in self._targets])
        self._histogram = [array.word("Histograms") for _ in self._histogram]
        return means

    def particles(self, target: int = 0) -> Float[np.ndarray, "N 2"]:
        """The positions of a target's particles in the last frame, before resampling, in pixels."""
        return self._particles[self._groups[target].elements]

    def weights(self, target: int = 0) -> Float[np.ndarray, " N"]:
        """Their weights, which add up to one."""
        weights = self._weights[self._groups[target].elements]
        return weights / weights.sum() if weights.any() else np.full(len(weights), 1 / len(weights))

    def ess(self, target: int = 0) -> float:
        """1 / Σ w²: how many equally weighted particles they are worth."""
        return float(1 / np.square(self.weights(target)).sum())

    def report(self) -> FrameReport:
        """What the last frame has cost."""
        width = self.options.region_px[0]
        asking = self.array.n // width * width if self._side_by_side else sum(self.options.n_particles)
        return FrameReport.of(self.array, self._memory.pixels.shape[0], asking)

    def _bin(self, image: UInt8[np.ndarray, "H W 3"]) -> None:
        with self.array.step(Step.BINNING):
            bin_picture(self.array, self._memory, image, self._buffers, self.options.binning)

    def _predict(self, width: int, height: int) -> None:
        unit = 1 << self._fraction_bits
        for axis, size in enumerate((width, height)):
            half = self.options.region_px[axis] // 2
            far = size - self.options.region_px[axis] + half
            predict(
                self.array,
                self._state[axis],
                self._state[axis + 2],
                self._generator,
                self._coefficients,
                self._deviation,
                (half * unit, far * unit),
            )

    def _count(self) -> Iterator[tuple[int, Sequence[Word]]]:
        """Counts as many bins at a time as there are words; yields the first bin with the words."""
        n_bins = self.options.binning.n_bins
        center = (self._state[0], self._state[1])
        count = count_in_passes if self._side_by_side else count_in_columns
        for first in range(0, n_bins, len(self._histogram)):
            words = self._histogram[: n_bins - first]
            with self.array.step(Step.HISTOGRAMS):
                count(
                    self.array,
                    words,
                    self._memory,
                    center,
                    self._fraction_bits,
                    self._sampling,
                    self._region,
                    self._active,
                    first_bin=first,
                )
            yield first, words

    def _compare(self, coefficient: Word) -> None:
        """The coefficient of each particle's histogram with the reference, part after part of it."""
        references = [target.reference for target in self._targets]
        starts = [target.group.first - self._active.start for target in self._targets]
        self.array.copy(coefficient, 0)
        for first, words in self._count():
            with self.array.step(Step.DISTANCES):
                add_coefficient(self.array, coefficient, words, first, references, self._place, starts)

    def _weigh(self, coefficient: Word) -> None:
        """The likelihood of each particle, by its own target's reference; 0 in elements without one."""
        array = self.array
        own, weight, place = array.number(), array.number(), array.word()
        array.copy(self._weight, 0)
        with array.using(own, weight, place):
            for target in self._targets:
                array.copy(own, coefficient)
                likelihood(array, weight, own, target.reference.perfect, self.options.sigma)
                self._place_in(target.group, place)
                array.copy(self._weight, weight, when=array.less(place, target.group.n))

    def _place_in(self, group: Group, place: Word) -> None:
        """Sets place to 0 to n - 1 in the elements of a group, and more than any n in the others."""
        array, outside = self.array, (1 << self.options.simd.bits) - 2
        array.subtract(place, self._place, group.first - self._active.start)
        array.copy(place, outside, when=array.at_least(place, group.n))

    def _estimate_and_resample(self, target: Target) -> Float[np.ndarray, " 2"]:
        array, group = self.array, target.group
        n_words = self.options.simd.number_words
        weight, place, total = array.number(), array.word(), array.number(n_words=n_words + 1)
        start, end = array.word(), array.word()
        with array.using(weight, place, total, start, end):
            with array.step(Step.NORMALIZATION):
                self._place_in(group, place)
                array.copy(weight, self._weight)
                array.copy(weight, 0, when=array.at_least(place, group.n))
                add_up(array, total, weight, group)
                if array.peek(total, group.first) == 0:
                    # no particle looks like the target: all are as good
                    array.copy(weight, 1, when=array.less(place, group.n))
                    add_up(array, total, weight, group)
                factor = scale_factor(array, total, group)
            with array.step(Step.MEAN):
                mean = [weighted_mean(array, weight, word, total, group) for word in self._state[:2]]
            with array.step(Step.NORMALIZATION), array.using(array.number()) as (share,):
                normalized(array, share, weight, factor, extra_words=0)
                array.copy(self._weight, share, when=array.less(place, group.n))
            with array.step(Step.RESAMPLING):
                replication_bounds(array, (start, end), weight, factor, place, group, self._rng)
                replicate(array, self._state, (start, end), place, group)
        return np.array(mean) / (1 << self._fraction_bits)

    def _positions(self) -> Float[np.ndarray, "P 2"]:
        lanes = np.stack([word.value for word in self._state[:2]], axis=1)
        return lanes / (1 << self._fraction_bits)


@lru_cache
def _missing_words(options: TrackerOptions) -> int:
    """Words that the line memory lacks for a histogram as a whole; a frame is run where there are enough."""
    roomy = options.simd.model_copy(update={"words": ROOMY})
    # noise that can be held in a picture of any size: this one is as small as it may be
    whole = {"simd": roomy, "histogram_words": options.binning.n_bins, "noise_px": 1.0}
    tracker = SimdTracker(options.model_copy(update=whole), stream(0, "simd", "words"))
    width, height = options.region_px
    nothing = np.zeros((height, width, 3), np.uint8)
    tracker.begin(nothing, *[np.zeros(2)] * len(options.n_particles))
    tracker.step(nothing)
    return max(0, tracker.array.line_memory.high_water - options.simd.words)
