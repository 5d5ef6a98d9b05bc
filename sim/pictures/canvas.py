"""Drawing on pixels with OpenCV: lines, dots and text, anti-aliased, at places between the pixels.

Everything is drawn into the image that is passed in. Places are pixel coordinates (x, y) with (0, 0) at the
centre of the top left pixel; what is NaN is not drawn.
"""

from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sim.world.colors import Color, bgr

Image = UInt8[np.ndarray, "_H _W 3"]
"""A picture, blue, green, red; two in one call may differ in size."""

_SHIFT = 4  # OpenCV's fixed point: sixteenths of a pixel
_FAR_PX = 1e5  # beyond any picture, within the fixed point's range
_FONT = cv2.FontFace("sans")


def blank(width_px: int, height_px: int, color: Color) -> Image:
    """An image of one colour."""
    return np.full((height_px, width_px, 3), bgr(color), dtype=np.uint8)


def draw_lines(
    image: Image, points: Float[np.ndarray, "N 2"], color: Color, width_px: int, *, closed: bool = False
) -> None:
    """Joins points by lines; there is a gap where one is NaN."""
    known = np.isfinite(points).all(axis=1)
    pieces = np.split(points, np.flatnonzero(~known))
    fixed = [_fixed(piece[np.isfinite(piece).all(axis=1)]) for piece in pieces]
    cv2.polylines(
        image,
        [piece for piece in fixed if len(piece) > 1],
        closed,
        bgr(color).tolist(),
        width_px,
        cv2.LINE_AA,
        _SHIFT,
    )


def fill(image: Image, points: Float[np.ndarray, "N 2"], color: Color) -> None:
    """Fills a polygon."""
    cv2.fillPoly(image, [_fixed(points)], bgr(color).tolist(), cv2.LINE_AA, _SHIFT)


def draw_dots(image: Image, points: Float[np.ndarray, "N 2"], color: Color, radius_px: float) -> None:
    """Filled circles."""
    for x, y in _fixed(points[np.isfinite(points).all(axis=1)]).tolist():
        cv2.circle(
            image, (x, y), round(radius_px * 2**_SHIFT), bgr(color).tolist(), cv2.FILLED, cv2.LINE_AA, _SHIFT
        )


def draw_text(
    image: Image,
    words: str,
    at: tuple[float, float],
    color: Color,
    size_px: int,
    *,
    align: Literal["left", "middle", "right"] = "left",
    bold: bool = False,
) -> None:
    """Writes a line of text.

    Args:
        image: Where.
        words: What.
        at: The place on the base line at which it begins, has its middle, or ends.
        color: Of the letters.
        size_px: Of the font.
        align: What ``at`` means.
        bold: Whether it is heavy.
    """
    share = {"left": 0.0, "middle": 0.5, "right": 1.0}[align]
    place = (round(at[0] - share * text_width(words, size_px, bold=bold)), round(at[1]))
    cv2.putText(image, words, place, bgr(color).tolist(), _FONT, size_px, _weight(bold=bold))


def text_width(words: str, size_px: int, *, bold: bool = False) -> int:
    """How wide a line of text is, pixels."""
    _, _, width, _ = cv2.getTextSize((0, 0), words, (0, 0), _FONT, size_px, _weight(bold=bold))
    return width


def dashes(
    points: Float[np.ndarray, "N 2"], dash_px: float, *, closed: bool = False
) -> Float[np.ndarray, "M 2"]:
    """Cuts lines into dashes and gaps of equal length.

    Args:
        points: The corners, at least two.
        dash_px: Length of a dash and of a gap, nearly.
        closed: Whether the last corner is joined to the first.

    Returns:
        The ends of the dashes, NaN between two dashes, for :func:`draw_lines`.
    """
    if closed:
        points = np.concatenate([points, points[:1]])
    along = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]
    if not 0 < along[-1] < _FAR_PX:
        return np.empty((0, 2))
    n = 2 * max(1, round(along[-1] / (2 * dash_px))) + (0 if closed else 1)
    pieces = []
    for start, end in np.linspace(0.0, along[-1], n + 1).repeat(2)[1:-1].reshape(-1, 2)[::2]:
        corners = along[(along > start) & (along < end)]
        s = np.r_[start, corners, end]
        pieces += [np.column_stack([np.interp(s, along, axis) for axis in points.T]), np.full((1, 2), np.nan)]
    return np.concatenate(pieces)


def _fixed(points: Float[np.ndarray, "N 2"]) -> np.ndarray:
    return np.rint(np.clip(points, -_FAR_PX, _FAR_PX) * 2**_SHIFT).astype(np.int32)


def _weight(*, bold: bool) -> int:
    return 700 if bold else 400
