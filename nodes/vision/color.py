"""Colours: from pixels to histogram bins, with the camera's gain taken out.

Sources: Jing & Chen, Eq. 7-8 (a histogram of each channel); Truong & Kim (2017), Eq. 10 (joint RGB); Medeiros
et al. (2008), section 4 (hue), with the colour-free pixels of Pérez et al. (2002) in a bin of their own.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float, Int, Integer, UInt8, UInt16
from pydantic import Field, model_validator

from network.options import Options
from nodes.counting.compiled import Coding
from nodes.vision.hue import FULL_SATURATION, GREY_CHROMA, GREY_SATURATION, MAX_BINS, hue_bins

GAIN_GRID_PX = 24
"""Every 24th pixel of every 24th line is enough for a median."""
MAX_RGB_BINS = 16
"""Most bins along a channel of RGB."""
NO_GAIN = [1.0, 1.0, 1.0]
_VALUES = np.arange(256)
_NO_TABLES = np.zeros((3, 256), np.uint16)


class ColorOptions(Options):
    """Which colours are told apart, and in which parts of the target."""

    space: Literal["rgb", "joint_rgb", "hue"] = "rgb"
    """`rgb`: a histogram of each channel (Eq. 7-8); `joint_rgb`: one of the three together; `hue`: one of the
    hue alone, with a last bin for what is too grey to have one."""
    bins_per_channel: int = Field(default=8, ge=2)
    """Bins along each channel, at most 16 in RGB and 64 of the hue: 8 make 3 x 8 bins in `rgb`, 512 in
    `joint_rgb`, in `hue` 7 sectors of the colour circle and one for grey."""
    parts: tuple[float, ...] = (1.0,)
    """Heights of the target's parts from top to bottom, as fractions that add up to 1; each has its own
    histogram."""
    part_weights: tuple[float, ...] = (1.0,)
    """How much each part counts in the distance; adds up to 1."""
    background_weighting: bool = False
    """Whether colours that surround the target at the start count less, or not at all."""
    gain_correction: bool = False
    """Whether each channel's gain is brought back to that of the camera's first picture."""

    @model_validator(mode="after")
    def _not_too_many_bins(self) -> "ColorOptions":
        most = MAX_BINS if self.space == "hue" else MAX_RGB_BINS
        if self.bins_per_channel > most:
            raise ValueError(
                f"bins_per_channel is {self.bins_per_channel}: in {self.space} take at most {most}"
            )
        return self

    @model_validator(mode="after")
    def _every_part_has_a_weight(self) -> "ColorOptions":
        if len(self.parts) != len(self.part_weights):
            raise ValueError(
                f"there are {len(self.parts)} parts and {len(self.part_weights)} part_weights:"
                " give each part its weight"
            )
        for name, shares in (("parts", self.parts), ("part_weights", self.part_weights)):
            if min(shares, default=0.0) < 0 or abs(sum(shares) - 1) > 1e-6:
                raise ValueError(f"{name} must be at least 0 and add up to 1, got {list(shares)}")
        return self

    @property
    def n_channels(self) -> int:
        """Histograms of a part: one a channel, or one."""
        return 3 if self.space == "rgb" else 1

    @property
    def n_bins(self) -> int:
        """Bins of a histogram."""
        return self.bins_per_channel**3 if self.space == "joint_rgb" else self.bins_per_channel


@dataclass(frozen=True, slots=True, eq=False)
class GainReference:
    """A camera's first picture on a sparse grid: what its gain is measured against."""

    pixels: UInt8[np.ndarray, "h w 3"]


def gain_reference(image: UInt8[np.ndarray, "H W 3"]) -> GainReference:
    """Keeps what `channel_gain` needs of a picture."""
    return GainReference(_sparse(image).copy())


def channel_gain(image: UInt8[np.ndarray, "H W 3"], reference: GainReference) -> Float[np.ndarray, " 3"]:
    """How much brighter each channel is than in the reference: median ratio of well exposed pixels."""
    # One row a channel: NumPy is quick along the long axis only.
    now, then = (np.array(pixels.reshape(-1, 3).T) for pixels in (_sparse(image), reference.pixels))
    exposed = np.flatnonzero(((now > 15) & (now < 250) & (then > 15) & (then < 250)).all(axis=0))
    n = len(exposed)
    if n < 16:
        return np.ones(3)
    ratios = (now.take(exposed, axis=1) + 1.0) / (then.take(exposed, axis=1) + 1.0)
    # The median, without the checks that make NumPy's own ten times slower for so few.
    ratios.partition(((n - 1) // 2, n // 2), axis=1)
    return (ratios[:, (n - 1) // 2] + ratios[:, n // 2]) / 2


def _sparse(image: UInt8[np.ndarray, "H W 3"]) -> UInt8[np.ndarray, "h w 3"]:
    return image[GAIN_GRID_PX // 2 :: GAIN_GRID_PX, GAIN_GRID_PX // 2 :: GAIN_GRID_PX]


def quantize(
    image: UInt8[np.ndarray, "H W 3"], options: ColorOptions, gain: Float[np.ndarray, " 3"]
) -> Integer[np.ndarray, "C H W"]:
    """The bin of every pixel in each of the C histograms of a part.

    Args:
        image: Blue, green, red (OpenCV's order).
        options: Space and number of bins.
        gain: Gain of each channel, divided out before binning.

    Returns:
        Bin indices from 0 to n_bins - 1: the channels red, green, blue in `rgb`; in `joint_rgb`
        r·n² + g·n + b for n bins a channel (Truong & Kim, Eq. 10); in `hue` those of `hue_bins`.
    """
    if options.space == "hue":
        return hue_bins(without_gain(image, gain), options.n_bins)[None]
    n = options.bins_per_channel
    if 256 % n == 0 and gain.tolist() == NO_GAIN:
        # floor(n · value / 256) without a table: the first bits of each channel
        bits = n.bit_length() - 1
        if options.space == "joint_rgb":
            return _joint_bits(image, bits)[None]
        values = np.right_shift(image, 8 - bits)
    else:
        tables = _tables(options, gain).astype(np.uint8 if options.n_bins <= 256 else np.uint16)
        values = cv2.LUT(image, np.ascontiguousarray(tables.T)[None])
        if options.space == "joint_rgb":
            blue, green, red = cv2.split(values)
            return (red + green + blue)[None]
    # a view of what lies side by side in memory, blue first, as counting wants it
    return values[..., ::-1].transpose(2, 0, 1)


def _joint_bits(image: UInt8[np.ndarray, "H W 3"], bits: int) -> Integer[np.ndarray, "H W"]:
    """The first bits of red, green and blue one after the other, at most 4 of each."""
    # OpenCV cuts red to 5 bits, green to 6 and blue to 5, in a word of 16
    words = cv2.cvtColor(image, cv2.COLOR_BGR2BGR565).view(np.uint16)[..., 0]
    return np.asarray(cv2.LUT(words, _joint_of_words(bits)))


@lru_cache
def _joint_of_words(bits: int) -> UInt8[np.ndarray, " 65536"] | UInt16[np.ndarray, " 65536"]:
    words, low = np.arange(1 << 16), (1 << bits) - 1
    joint = (words >> (16 - bits)) << (2 * bits)
    joint |= ((words >> (11 - bits)) & low) << bits
    joint |= (words >> (5 - bits)) & low
    return joint.astype(np.uint16 if bits > 2 else np.uint8)


def _tables(options: ColorOptions, gain: Float[np.ndarray, " 3"]) -> Int[np.ndarray, "3 256"]:
    """The bin of each value of blue, green and red; in `joint_rgb` what each adds to the joint bin."""
    n = options.bins_per_channel
    # bin = floor(n · value / 256), of the value without its gain
    bins = np.minimum(_VALUES * (n / 256) / gain[:, None], n - 1).astype(np.intp)
    return bins if options.space == "rgb" else bins * _digits(n)


def _digits(n: int) -> Int[np.ndarray, "3 1"]:
    """What blue, green and red count for in a number of three digits to the base n."""
    return np.array([[1], [n], [n * n]])


def coding(options: ColorOptions, gain: Float[np.ndarray, " 3"]) -> Coding:
    """The joint index of a pixel for the compiled kernel: its digits are the bins of red, green and blue."""
    return _coding(options, gain.tobytes())


@lru_cache(maxsize=64)
def _coding(options: ColorOptions, gain: bytes) -> Coding:
    if options.space == "hue":
        return Coding(_NO_TABLES, options.n_bins, (GREY_CHROMA, GREY_SATURATION, FULL_SATURATION))
    tables = _tables(options, np.frombuffer(gain))
    if options.space == "rgb":
        tables = tables * _digits(options.bins_per_channel)
    return Coding(tables.astype(np.uint16))


def without_gain(
    image: UInt8[np.ndarray, "H W 3"], gain: Float[np.ndarray, " 3"]
) -> UInt8[np.ndarray, "H W 3"]:
    """The picture with each channel's gain divided out, rounded to grey levels."""
    if gain.tolist() == NO_GAIN:
        return image
    levels = np.minimum(np.rint(_VALUES / gain[:, None]), 255).astype(np.uint8)
    return np.asarray(cv2.LUT(image, np.ascontiguousarray(levels.T)[None]), dtype=np.uint8)
