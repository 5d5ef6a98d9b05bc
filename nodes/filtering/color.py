"""Colours: from pixels to histogram bins, with the camera's gain taken out.

Sources: Jing & Chen, Eq. 7-8 (a histogram of each channel); Truong & Kim (2017), Eq. 10 (joint RGB); Medeiros
et al. (2008), section 4 (hue), with the colour-free pixels of Pérez et al. (2002) in a bin of their own.
"""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float, Integer, UInt8
from pydantic import Field, model_validator

from network.options import Options

GAIN_GRID_PX = 24
"""Every 24th pixel of every 24th line is enough for a median."""
MAX_RGB_BINS = 16
"""Most bins along a channel of RGB."""
GREY_CHROMA = 16
"""max - min of red, green and blue below which a pixel counts as grey, whatever its brightness."""
GREY_SATURATION = 8
"""It counts as grey, too, where max - min is below max / 8."""
_VALUES = np.arange(256)


class ColorOptions(Options):
    """Which colours are told apart, and in which parts of the target."""

    space: Literal["rgb", "joint_rgb", "hue"] = "rgb"
    """`rgb`: a histogram of each channel (Eq. 7-8); `joint_rgb`: one of the three together; `hue`: one of the
    hue alone, with a last bin for what is too grey to have one."""
    bins_per_channel: int = Field(default=8, ge=2, le=256)
    """Bins along each channel, at most 16 in RGB: 8 make 3 x 8 bins in `rgb`, 512 in `joint_rgb`, in `hue` 7
    sectors of the colour circle and one for grey."""
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
    def _rgb_has_few_bins(self) -> "ColorOptions":
        if self.space != "hue" and self.bins_per_channel > MAX_RGB_BINS:
            raise ValueError(
                f"bins_per_channel is {self.bins_per_channel}: in {self.space} take at most {MAX_RGB_BINS}"
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
        return hue_bins(_without_gain(image, gain), options.n_bins)[None]
    n = options.bins_per_channel
    # bin = floor(n · value / 256), of the value without its gain
    values = _VALUES / gain[:, None]
    dtype = np.uint8 if options.n_bins <= 256 else np.uint16
    bins = np.minimum(values * n / 256, n - 1).astype(dtype)
    if options.space == "joint_rgb":
        bins *= np.array([[1], [n], [n * n]], dtype)
    blue, green, red = cv2.split(cv2.LUT(image, np.ascontiguousarray(bins.T)[None]))
    return np.stack([red, green, blue]) if options.space == "rgb" else (red + green + blue)[None]


def _without_gain(
    image: UInt8[np.ndarray, "H W 3"], gain: Float[np.ndarray, " 3"]
) -> UInt8[np.ndarray, "H W 3"]:
    """The picture with each channel's gain divided out, rounded to grey levels."""
    if np.all(gain == 1.0):
        return image
    levels = np.minimum(np.rint(_VALUES / gain[:, None]), 255).astype(np.uint8)
    return np.asarray(cv2.LUT(image, np.ascontiguousarray(levels.T)[None]), dtype=np.uint8)


def hue_bins(image: UInt8[np.ndarray, "H W 3"], n_bins: int) -> UInt8[np.ndarray, "H W"]:
    """The hue of every pixel in n - 1 equal sectors of the colour circle, or n - 1 for grey.

    All integers, so that a processor without fractions finds the same bins. With M the largest and m the
    smallest of r, g, b, and C = M - m:

    1. grey, bin n - 1, if C < 16 or 8 C < M;
    2. otherwise the hue in units of 60 degrees / C, from 0 (red) to below 6 C:
       H = g - b if M = r; else H = 2 C + b - r if M = g; else H = 4 C + r - g; and H + 6 C if H < 0;
    3. bin = (n - 1) H // (6 C): floor of the quotient; the product stays below 2^16 up to 40 bins.

    Where two channels are both largest, either line of 2 gives the same H. Hue is OpenCV's
    (``cv2.COLOR_BGR2HSV``), there rounded to whole 2 degrees.

    Args:
        image: Blue, green, red.
        n_bins: n, at most 256.
    """
    blue, green, red = cv2.split(image)
    largest = cv2.max(cv2.max(blue, green), red)
    chroma = np.asarray(cv2.subtract(largest, cv2.min(cv2.min(blue, green), red)), dtype=np.int16)
    b, g, r, M = (channel.astype(np.int16) for channel in (blue, green, red, largest))
    H = np.where(r == M, g - b, np.where(g == M, 2 * chroma + b - r, 4 * chroma + r - g))
    H += 6 * chroma * (H < 0)
    # In float32 the quotient's floor is exact: it is at least 1 / (6 C) away from the next whole number
    # below which it could be rounded up, and the numbers are below 2^24.
    sector = (H.astype(np.float32) * (n_bins - 1) / (6 * np.maximum(chroma, 1))).astype(np.uint8)
    grey = (chroma < GREY_CHROMA) | (GREY_SATURATION * chroma < M)
    sector[grey] = n_bins - 1
    return sector
