"""The observation model of one camera: what a picture says about where the target is.

Source: Jing & Chen, Eq. 6-8 and 11-12, on boxes that follow from the camera's geometry. Everything about one
camera and one picture lives here; nothing about particles' weights does.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float, Int, Integer, UInt8
from pydantic import Field

from network.options import Options
from nodes.counting.codebook import Codebook
from nodes.counting.compiled import distances_compiled
from nodes.counting.histogram import SamplingOptions, locate
from nodes.imaging.camera import Camera
from nodes.simd.likelihood import SimdLikelihood
from nodes.simd.options import SimdOptions
from nodes.threads import in_shares, n_shares
from nodes.vision.appearance import (
    Appearance,
    ModelUpdateOptions,
    distinctness_of,
    normalize_counts,
    update_appearance,
)
from nodes.vision.color import (
    ColorOptions,
    GainReference,
    channel_gain,
    coding,
    gain_reference,
    quantize,
    without_gain,
)
from nodes.vision.likelihood import (
    LikelihoodOptions,
    background_constants,
    log_gaussian,
    with_miss_floor,
)
from nodes.vision.pattern import Pattern, full_codebook, pattern_of, squared_distances
from nodes.vision.standstill import Background, background_of, likeness
from nodes.vision.target import TargetOptions, project_boxes, visible_fraction

GOOD_SIGHT = 0.9
"""Part of the target's box inside the picture from which a camera trusts its own eyes for a reference."""
GOOD_SIGHTS = 5
"""Good sights of the target from which a camera takes a reference of its own: until then, its pictures
correct where it was told that the target is, and what lies beside the target is not taken for it."""
LEAST_BOXES = 8000
"""Boxes that a thread counts at least: each makes its own integral images, however few they are."""


class ObservationOptions(Options):
    """How a camera measures the target."""

    backend: Literal["fast", "compiled", "simd"] = "fast"
    """What counts the colours of the particles' boxes: `fast`, NumPy and OpenCV; `compiled`, a kernel in C
    that is built on first use; `simd`, the emulated processor array of a smart camera, in its own arithmetic.
    The counts are equal to the last one."""
    simd: SimdOptions = SimdOptions()
    """The array, for the backend `simd`."""
    threads: int = Field(default=1, ge=1, le=64)
    """Threads of each filter, for likelihoods and resampling; the numbers are the same with any. Too few
    particles for so many threads, or too few cores, are done by fewer."""
    color: ColorOptions = ColorOptions()
    sampling: SamplingOptions = SamplingOptions()
    likelihood: LikelihoodOptions = LikelihoodOptions()
    model_update: ModelUpdateOptions = ModelUpdateOptions()
    min_likeness: float | None = Field(default=None, ge=0, le=1)
    """How well the background must correlate with that of the camera's first picture. Below, a smart camera
    has been knocked, or is covered: it tells the others nothing until it looks there again. null: never."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A frame with the gain of its channels against the camera's first frame."""

    image: UInt8[np.ndarray, "H W 3"]
    gain: Float[np.ndarray, " 3"]


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """What one box shows.

    Attributes:
        histograms: Normalised, of each part and channel.
        squared_distance: d² to the reference.
        visible: Part of the box inside the picture.
    """

    histograms: Float[np.ndarray, "P C B"]
    squared_distance: float
    visible: float


@dataclass(frozen=True, slots=True, eq=False)
class ObservationModel:
    """z(k) = hist(k) of one camera (Eq. 6).

    Attributes:
        camera: Where the camera is.
        target: What it looks for.
        options: How it measures.
        gain: The first picture on a sparse grid; None before the first.
        background: Its fine structure, if the options ask for it.
        processor: The emulated array that measures, if one does.
    """

    camera: Camera
    target: TargetOptions
    options: ObservationOptions
    gain: GainReference | None = None
    background: Background | None = None
    processor: SimdLikelihood | None = None

    def with_first(self, image: UInt8[np.ndarray, "H W 3"]) -> "ObservationModel":
        """The same model, with gain and background held against this picture from now on."""
        background = None if self.options.min_likeness is None else background_of(image)
        return replace(self, gain=gain_reference(image), background=background)

    def stands_still(self, image: UInt8[np.ndarray, "H W 3"]) -> bool:
        """Whether the camera looks where it did in its first picture, as far as the options ask."""
        least = self.options.min_likeness
        return least is None or self.background is None or likeness(image, self.background) >= least

    @property
    def off_array(self) -> "ObservationModel":
        """The same model measured by this machine: for baselines, which no camera has to run."""
        return replace(self, processor=None)

    def look(self, image: UInt8[np.ndarray, "H W 3"]) -> Picture:
        """Takes the gain of a picture, if the options ask for it."""
        if self.gain is None or not self.options.color.gain_correction:
            return Picture(image, np.ones(3))
        return Picture(image, channel_gain(image, self.gain))

    def log_likelihoods(
        self, picture: Picture, positions: Float[np.ndarray, "N A"], appearance: Appearance | None
    ) -> Float[np.ndarray, " N"]:
        """Evaluates log P(z | χ) at each position; flat while the target's looks are not known."""
        if appearance is None:
            return np.zeros(len(positions))
        boxes = project_boxes(positions, self.target, self.camera)
        log_match = log_gaussian(self.box_distances(picture, boxes, appearance), appearance.variance)
        if self.options.likelihood.form == "literal":
            return log_match
        visible, min_visible = visible_fraction(boxes, self.camera), self.options.sampling.min_visible
        return with_miss_floor(log_match, visible, appearance.miss_distance, appearance.variance, min_visible)

    def sight(self, picture: Picture, position: Float[np.ndarray, " A"], appearance: Appearance) -> Sight:
        """What the target's box at a position shows."""
        boxes = project_boxes(position[None], self.target, self.camera)
        visible = visible_fraction(boxes, self.camera)
        pattern = pattern_of(appearance, self.options.color, all_bins=True)
        counts, pixels = self._count(picture, boxes, pattern.book)
        distance = squared_distances(counts, pixels, pattern)
        histograms = normalize_counts(counts, pixels, self.options.color)[0]
        return Sight(histograms, float(distance[0]), float(visible[0]))

    def sees(self, sight: Sight, appearance: Appearance) -> bool:
        """Whether a box shows the target."""
        min_visible = self.options.sampling.min_visible
        return sight.visible >= min_visible and sight.squared_distance < appearance.miss_distance

    def first_appearance(self, picture: Picture, position: Float[np.ndarray, " A"]) -> Appearance | None:
        """The reference at the target's known position, or None where its box is not well in the picture."""
        boxes = project_boxes(position[None], self.target, self.camera)
        if visible_fraction(boxes, self.camera)[0] < GOOD_SIGHT:
            return None
        histograms = self._histograms(picture, boxes)[0]
        appearance = Appearance(histograms, histograms, np.ones_like(histograms), 1.0, 1.0, own=True)
        # What surrounds the target tells which colours are its own, and how near a look-alike comes.
        around = surrounding_boxes(boxes[0])
        around = around[visible_fraction(around, self.camera) > 0.7]
        if len(around) and self.options.color.background_weighting:
            background = self._histograms(picture, around).mean(axis=0)
            appearance = replace(appearance, distinctness=distinctness_of(histograms, background))
        distance = self.box_distances(picture, around, appearance)
        miss_distance, variance = background_constants(distance, self.options.likelihood)
        return replace(appearance, miss_distance=miss_distance, variance=variance)

    def updated(
        self, picture: Picture, position: Float[np.ndarray, " A"], sight: Sight, appearance: Appearance
    ) -> Appearance:
        """The reference after the frame's estimate: Eq. 4, and a look of one's own.

        Args:
            picture: Of the frame.
            position: The estimate's.
            sight: What it shows there.
            appearance: The reference before.
        """
        update = self.options.model_update
        if appearance.own:
            return update_appearance(
                appearance, sight.histograms, sight.squared_distance, sight.visible, update
            )
        # Its own reference in place of the neighbours', after a few good sights of the target.
        if (
            sight.visible < GOOD_SIGHT
            or sight.squared_distance > update.max_distance * appearance.miss_distance
        ):
            return appearance
        seen = replace(appearance, good_sights=appearance.good_sights + 1)
        return (self.first_appearance(picture, position) or seen) if seen.good_sights >= GOOD_SIGHTS else seen

    def box_distances(
        self, picture: Picture, boxes: Float[np.ndarray, "N 4"], appearance: Appearance
    ) -> Float[np.ndarray, " N"]:
        """d² of each box to the reference, counted by the backend of the options, in its threads."""
        pattern = pattern_of(appearance, self.options.color)
        if self.processor is not None:
            return self._on_array(picture, boxes, pattern, self.processor)
        n, n_threads = len(boxes), self.options.threads
        if n_shares(n, n_threads, LEAST_BOXES) == 1:
            return self._share_distances(picture, boxes, pattern)
        distances = np.empty(n)

        def measure(share: slice) -> None:
            distances[share] = self._share_distances(picture, boxes[share], pattern)

        in_shares(measure, n, n_threads, LEAST_BOXES)
        return distances

    def _share_distances(
        self, picture: Picture, boxes: Float[np.ndarray, "N 4"], pattern: Pattern
    ) -> Float[np.ndarray, " N"]:
        if self.options.backend == "compiled":
            sampling, color = self.options.sampling, self.options.color
            image, code = picture.image, coding(color, picture.gain)
            if color.space == "hue":
                image = without_gain(image, picture.gain)
            return distances_compiled(image, code, boxes, pattern.compiled, sampling.grid, sampling.kernel)
        counts, pixels = self._count(picture, boxes, pattern.book)
        return squared_distances(counts, pixels, pattern)

    def _on_array(
        self,
        picture: Picture,
        boxes: Float[np.ndarray, "N 4"],
        pattern: Pattern,
        processor: SimdLikelihood,
    ) -> Float[np.ndarray, " N"]:
        size_px = self.camera.width_px, self.camera.height_px
        # The array bins the whole picture; what nobody reads need not be emulated.
        left, top, right, bottom = locate(boxes, size_px, pattern.book, self.options.sampling).region
        bins = quantize(picture.image[top:bottom, left:right], self.options.color, picture.gain)
        offset = np.array([left, top, left, top])
        return processor.measure(bins, boxes - offset, pattern, size_px).squared_distance

    def _histograms(self, picture: Picture, boxes: Float[np.ndarray, "N 4"]) -> Float[np.ndarray, "N P C B"]:
        color = self.options.color
        counts, pixels = self._count(picture, boxes, full_codebook(color))
        return normalize_counts(counts, pixels, color)

    def _count(
        self, picture: Picture, boxes: Float[np.ndarray, "N 4"], book: Codebook
    ) -> tuple[Integer[np.ndarray, "N K"], Int[np.ndarray, "N P"]]:
        # Only the region that the boxes cover is quantised.
        size_px = self.camera.width_px, self.camera.height_px
        where = locate(boxes, size_px, book, self.options.sampling)
        left, top, right, bottom = where.region
        counts, pixels = where.count(
            quantize(picture.image[top:bottom, left:right], self.options.color, picture.gain)
        )
        return counts.T, pixels.T


def surrounding_boxes(box: Float[np.ndarray, " 4"]) -> Float[np.ndarray, "N 4"]:
    """Boxes of the same size on three rings around a box; those straight above and below overlap it."""
    center, size = (box[:2] + box[2:]) / 2, box[2:] - box[:2]
    angles = np.arange(12) * np.pi / 6
    # rings of 1.5, 2.5 and 4 box widths, flattened to the part of the picture where a target could be
    offsets = np.concatenate(
        [
            ring * size[0] * np.stack([np.cos(angles), 0.5 * np.sin(angles)], axis=1)
            for ring in (1.5, 2.5, 4.0)
        ]
    )
    centers = center + offsets
    return np.concatenate([centers - size / 2, centers + size / 2], axis=1)
