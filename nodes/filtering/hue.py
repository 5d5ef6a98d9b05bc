"""Hue, in whole numbers: the same bins on a processor without fractions, to the last pixel.

Sources: Medeiros et al. (2008), section 4, track by a hue histogram; Pérez et al. (2002) give the pixels that
are too grey to have a hue bins of their own.
"""

import cv2
import numpy as np
from jaxtyping import UInt8

GREY_CHROMA = 16
"""max - min of red, green and blue below which a pixel counts as grey, whatever its brightness."""
GREY_SATURATION = 8
"""It counts as grey, too, where max - min is below max / 8."""


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
