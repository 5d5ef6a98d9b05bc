"""A small chart over the frames, drawn with OpenCV: lines that grow as a clip plays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sim.pictures.canvas import Image, blank, draw_dots, draw_lines, draw_text, text_width
from sim.pictures.theme import FAINT, INK, MUTED, PAPER
from sim.world.colors import Color

_STEPS = (1.0, 2.0, 5.0)


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A quantity over the frames.

    Attributes:
        label: What it is.
        values: In each frame from 0 on; NaN where there is none.
        color: Of the line.
        width_px: Its width.
    """

    label: str
    values: Float[np.ndarray, " T"]
    color: Color
    width_px: int = 2


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """Lines over the frames.

    Attributes:
        title: What the lines are, with the unit.
        lines: From below to above.
        low: Lower end of the axis.
        high: Upper end of the axis.
        width_px: Width of the picture.
        height_px: Height of the picture.
        text_px: Size of the text.
    """

    title: str
    lines: Sequence[Line]
    low: float
    high: float
    width_px: int
    height_px: int
    text_px: int

    def draw(self, frame: int) -> Image:
        """The lines up to a frame, the values there in words."""
        image = blank(self.width_px, self.height_px, PAPER)
        ticks = round_numbers(self.low, self.high)
        places = self.to_pixels(np.zeros(len(ticks)), ticks)
        left, right = self.to_pixels(np.array([0.0, self._last]), np.zeros(2))[:, 0]
        for tick, (_, y) in zip(ticks, places, strict=True):
            draw_lines(image, np.array([[left, y], [right, y]]), FAINT, 1)
            draw_text(
                image, f"{tick:g}", (left - 0.5 * self.text_px, y + 0.35 * self.text_px), MUTED, self.text_px,
                align="right",
            )  # fmt: skip
        draw_text(image, self.title, (left, 1.1 * self.text_px), INK, self.text_px, bold=True)
        frames = np.arange(frame + 1, dtype=float)
        for line in self.lines:
            points = self.to_pixels(frames, line.values[: frame + 1])
            draw_lines(image, points, line.color, line.width_px)
            draw_dots(image, points[-1:], line.color, line.width_px + 1.0)
        self._draw_values(image, frame, float(right))
        return image

    def to_pixels(
        self, frames: Float[np.ndarray, " N"], values: Float[np.ndarray, " N"]
    ) -> Float[np.ndarray, "N 2"]:
        """Where a value at a frame is drawn; values beyond the axis at its end."""
        left, right = 3.5 * self.text_px, self.width_px - 1.0 * self.text_px
        top, bottom = 2.0 * self.text_px, self.height_px - 0.8 * self.text_px
        across = frames / max(self._last, 1)
        up = np.clip((values - self.low) / (self.high - self.low), 0.0, 1.0)
        return np.stack([left + across * (right - left), bottom - up * (bottom - top)], axis=1)

    @property
    def _last(self) -> int:
        return max(len(line.values) for line in self.lines) - 1

    def _draw_values(self, image: Image, frame: int, right: float) -> None:
        """What the lines are at this frame, each in its colour, from the right in their order."""
        for line in self.lines[::-1]:
            value = line.values[frame]
            words = f"{line.label} {value:.3f}" if np.isfinite(value) else f"{line.label} –"
            draw_text(
                image, words, (right, 1.1 * self.text_px), line.color, self.text_px, align="right", bold=True
            )
            right -= text_width(words, self.text_px, bold=True) + self.text_px


def mean_known(values: Float[np.ndarray, "C T"]) -> Float[np.ndarray, " T"]:
    """The mean over the nodes that have a value; NaN where none has."""
    return np.ma.masked_invalid(values).mean(axis=0).filled(np.nan)


def round_numbers(low: float, high: float, most: int = 4) -> Float[np.ndarray, " N"]:
    """At most so many round numbers, evenly spaced, from one value to another.

    Args:
        low: Where they start at the earliest.
        high: Where they end at the latest, above ``low``.
        most: How many they may be, at least 3.
    """
    decade = 10.0 ** np.floor(np.log10((high - low) / most))
    for step in (factor * power for power in (decade, 10 * decade) for factor in _STEPS):
        first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
        if last - first < most:
            return np.arange(first, last + 1) * step + 0.0  # no -0
    raise AssertionError("the last step is larger than the range")
