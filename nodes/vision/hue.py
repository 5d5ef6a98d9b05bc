"""Hue in equal sectors of the colour circle, by integers that any processor can follow.

Source: Medeiros et al. (2008), section 4; what has no colour has a bin of its own, as in Pérez et al. (2002).
"""

import cv2
import numpy as np
from jaxtyping import UInt8

GREY_CHROMA = 16
"""max - min of red, green and blue below which a pixel counts as grey, whatever its brightness."""
FULL_SATURATION = 1023
GREY_SATURATION = 128
"""It counts as grey, too, where its saturation (max - min) / max is below this, in parts of 1023."""
NUDGE = 1 + 2**-18
"""By how much hues are stretched before sectors are cut: more than the error of 32-bit floats, less than the
smallest distance of a hue from the sector's end above it, 360 / (6 · 255 (n - 1))."""
MAX_BINS = 64
"""Up to here, the nudge is small enough."""


def hue_bins(image: UInt8[np.ndarray, "H W 3"], n_bins: int) -> UInt8[np.ndarray, "H W"]:
    """The hue of every pixel in n - 1 equal sectors of the colour circle, or n - 1 for grey.

    All integers, so that a processor without fractions finds the same bins. With M the largest and m the
    smallest of r, g, b, and C = M - m:

    1. grey, bin n - 1, if C < 16 or 1023 C < 128 M;
    2. otherwise the hue in units of 60 degrees / C, from 0 (red) to below 6 C:
       H = g - b if M = r; else H = 2 C + b - r if M = g; else H = 4 C + r - g; and H + 6 C if H < 0;
    3. bin = (n - 1) H // (6 C): floor of the quotient; the product stays below 2^16 up to 40 bins.

    Where two channels are both largest, either line of 2 gives the same H. Hue is OpenCV's
    (``cv2.COLOR_BGR2HSV``), there rounded to whole 2 degrees; here OpenCV works it out in floats, faster than
    NumPy in integers, and the bins come out the same for each of the 2^24 colours.

    Args:
        image: Blue, green, red.
        n_bins: n, at most `MAX_BINS`.
    """
    hsv = cv2.cvtColor(image.astype(np.float32), cv2.COLOR_BGR2HSV)
    # one row each: NumPy is quick along the long axis only
    hue, saturation, value = np.ascontiguousarray(hsv.reshape(-1, 3).T)
    sector = np.empty(len(hue), np.uint8)
    np.multiply(hue, np.float32(NUDGE * (n_bins - 1) / 360), out=sector, casting="unsafe")
    # C = S M is whole, and S is further from the limit than the error of floats
    grey = saturation * value < GREY_CHROMA - 0.5
    grey |= saturation < GREY_SATURATION / FULL_SATURATION
    np.maximum(sector, grey * np.uint8(n_bins - 1), out=sector)
    return sector.reshape(image.shape[:2])
