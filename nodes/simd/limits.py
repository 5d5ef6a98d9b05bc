"""What the words and elements of the array can hold of a tracker: all that it refuses is refused here."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from nodes.simd.programs.counting import Region
from nodes.simd.tracker_options import TrackerOptions


def require_room(options: TrackerOptions, counted: Region) -> None:
    """Makes sure that particles, counts and bins fit.

    Args:
        options: The tracker.
        counted: The samples of a region.

    Raises:
        ValueError: They do not; the text says what to do.
    """
    simd, binning = options.simd, options.binning
    full = (1 << simd.bits) - 1
    n_used, most = sum(options.n_particles), min(simd.processing_elements, full - 2)
    if n_used > most:
        raise ValueError(f"{n_used} particles are too many: the array has room for {most}")
    if counted.total > full:
        raise ValueError(
            f"the samples of a region count {counted.total} in all and a word holds {full}:"
            " choose a smaller region"
        )
    # the dividend of the hue, ⌊(n - 1) · 6 H C⌋, has two words
    wraps = binning.space == "hue" and (binning.bins - 1) * 6 * 255 >= 1 << 2 * simd.bits
    if binning.n_bins > full or wraps:
        raise ValueError(f"{binning.n_bins} bins are too many for words of {simd.bits} bits: take fewer")


def require_fitting(
    options: TrackerOptions, width: int, height: int, positions: Sequence[Float[np.ndarray, " _"]]
) -> None:
    """Makes sure that a picture fits the array, and the targets the picture.

    Args:
        options: The tracker.
        width: Of the picture.
        height: Of the picture.
        positions: Centres of the targets, x and y first.

    Raises:
        ValueError: They do not; the text says what to do.
    """
    n_elements, told_apart = options.simd.processing_elements, 1 << options.simd.bits
    size_px = options.region_px
    if width > n_elements:
        raise ValueError(
            f"the picture is {width} pixels wide and the array has {n_elements} elements: take a smaller one,"
            " or more elements (simd.processing_elements)"
        )
    if max(width, height) > told_apart:
        raise ValueError(
            f"the picture has {width} x {height} pixels and a word of {options.simd.bits} bits tells"
            f" {told_apart} apart: take a smaller one, or longer words (simd.bits)"
        )
    if size_px[0] > width or size_px[1] > height:
        raise ValueError(f"a region of {size_px} pixels is larger than the picture: choose a smaller one")
    if len(positions) != len(options.n_particles):
        raise ValueError(f"{len(positions)} positions for {len(options.n_particles)} targets")
    for position in positions:
        x, y = position[:2]
        if not (0 <= x < width and 0 <= y < height):
            raise ValueError(
                f"a target starts at [{x:.1f}, {y:.1f}], outside of the picture of"
                f" {width} x {height} pixels: start inside"
            )
