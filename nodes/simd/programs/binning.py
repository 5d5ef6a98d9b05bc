"""From the colours of a line to the bins of its pixels.

The array holds a line of red, green and blue, one pixel an element, in three line buffers; the bins replace
the first of them. Every statement runs for all pixels, whatever their colours.
"""

from typing import Literal

import numpy as np
from jaxtyping import Float, UInt8
from pydantic import Field, model_validator

from network.options import Options
from nodes.simd.array import ProcessorArray
from nodes.simd.memory import ExternalMemory, Word
from nodes.simd.programs.arithmetic import divide
from nodes.vision.hue import FULL_SATURATION, GREY_CHROMA, GREY_SATURATION

MAX_BINS = 512
"""The most bins of a histogram."""


class BinningOptions(Options):
    """Which colours are told apart."""

    space: Literal["hue", "joint_rgb"] = "hue"
    """`hue`: of HSV, the last bin for what is too grey to have one; `joint_rgb`: the three together."""
    bins: int = Field(default=40, ge=2)
    """Bins of the hue, or along each channel."""

    @model_validator(mode="after")
    def _not_more_than_a_pixel_holds(self) -> "BinningOptions":
        if self.n_bins > MAX_BINS:
            raise ValueError(
                f"bins must give {MAX_BINS} bins at most, {self.bins} along each channel are {self.n_bins}"
            )
        return self

    @property
    def n_bins(self) -> int:
        """Bins of a histogram."""
        return self.bins**3 if self.space == "joint_rgb" else self.bins


LINES_AT_ONCE = 120
"""Lines of a picture that the emulation runs at once: so many that they stay in the processor's cache."""


def bin_picture(
    array: ProcessorArray,
    memory: ExternalMemory,
    image: UInt8[np.ndarray, "H W 3"],
    buffers: tuple[Word, Word, Word],
    options: BinningOptions,
) -> None:
    """Bins a picture line by line as the sensor brings it, and stores the bins in the external memory.

    Args:
        array: The processor.
        memory: Of the picture's size.
        image: Blue, green, red.
        buffers: The video line buffers, red, green, blue.
        options: Which colours.
    """
    channels = [np.ascontiguousarray(image[..., channel]) for channel in (2, 1, 0)]
    for first in range(0, len(image), LINES_AT_ONCE):
        lines = np.arange(first, min(first + LINES_AT_ONCE, len(image)))
        for line in array.repeat(len(lines)):
            for buffer, channel in zip(buffers, channels, strict=True):
                array.input(buffer, channel[lines[np.squeeze(line)]])
            if options.space == "hue":
                hue_bins(array, *buffers, options)
            else:
                joint_bins(array, *buffers, options.bins, np.ones(3))
            array.output(buffers[0], memory, lines[np.squeeze(line)])


def hue_bins(array: ProcessorArray, red: Word, green: Word, blue: Word, options: BinningOptions) -> None:
    """Puts the bin of the hue into red, by the rule of `nodes.vision.hue.hue_bins`."""
    value, spread = array.word(), array.word()
    dividend, divisor = array.word(n_words=2), array.word(n_words=2)
    with array.using(value, spread, dividend, divisor):
        # V = max(R, G, B), C = V - min(R, G, B)
        array.maximum(value, red, green)
        array.maximum(value, value, blue)
        array.minimum(spread, red, green)
        array.minimum(spread, spread, blue)
        array.subtract(spread, value, spread)
        # 6 H C, from 0 to 6 C: (R - G) + 4 C, (B - R) + 2 C or (G - B), the last from below 0 to 6 C
        array.multiply(divisor, spread, 4)
        array.subtract(dividend, red, green)
        array.add(dividend, dividend, divisor)
        is_green = array.equal(value, green)
        array.multiply(divisor, spread, 2)
        array.subtract(dividend, blue, red, when=is_green)
        array.add(dividend, dividend, divisor, when=is_green)
        is_red = array.equal(value, red)
        array.multiply(divisor, spread, 6)
        array.subtract(dividend, green, blue, when=is_red)
        below = array.both(is_red, array.less(green, blue))
        array.add(dividend, dividend, divisor, when=below)
        # bin = ⌊(n - 1) · 6 H C / 6 C⌋
        array.multiply(dividend, dividend, options.bins - 1)
        divide(array, dividend, divisor)
        array.copy(red, array.part(dividend, 0))
        # the saturation is C / V; what has too little of it, or of chroma, is grey
        array.multiply(dividend, spread, FULL_SATURATION)
        array.copy(divisor, value)
        divide(array, dividend, divisor)
        pale = array.less(array.part(dividend, 0), GREY_SATURATION)
        dull = array.less(spread, GREY_CHROMA)
        array.copy(red, options.bins - 1, when=array.either(pale, dull))


def channel_bins(
    array: ProcessorArray, channels: tuple[Word, Word, Word], n: int, gain: Float[np.ndarray, " 3"]
) -> None:
    """Each channel = its bin ⌊n · value / 256 gain⌋ (Jing & Chen, Eq. 7-8), by one multiplication."""
    scale = 1 << 2 * array.options.bits
    for channel, own_gain in zip(channels, gain.tolist(), strict=True):
        factor = round(n / (256 * own_gain) * scale)
        array.multiply(channel, channel, factor, b_words=2, drop=2)
        array.minimum(channel, channel, n - 1)


def joint_bins(
    array: ProcessorArray, red: Word, green: Word, blue: Word, n: int, gain: Float[np.ndarray, " 3"]
) -> None:
    """Puts r · n² + g · n + b (Truong & Kim, Eq. 10) into red; gains in the order red, green, blue."""
    channel_bins(array, (red, green, blue), n, gain)
    array.multiply(red, red, n)
    array.add(red, red, green)
    array.multiply(red, red, n)
    array.add(red, red, blue)
