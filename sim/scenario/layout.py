"""Cameras by the dozen: a group in the scenario from which as many of them follow as one likes."""

import math
from typing import Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, PositiveInt

from network.options import Options
from network.streams import stream

GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))
"""Turned by it one after the other, any number of cameras looks in all directions alike."""


class CameraLayout(Options):
    """Cameras C1, C2, ... that hang over the floor in place of a list of them."""

    layout: Literal["grid", "random"]
    """`grid`: in rows, as square as their number allows; `random`: anywhere in the same square, from the
    seed."""
    count: int = Field(ge=1, le=100_000)
    """How many there are."""
    spacing_m: float = Field(gt=0)
    """Distance between neighbours of the grid; at random, each has a square of this side on average."""
    center: tuple[float, float] = (0.0, 0.0)
    """Middle of them all, x and y in m."""
    height: float = Field(default=2.9, gt=0)
    """Height at which they hang, in m."""
    ahead_m: float = Field(default=5.0, gt=0)
    """How far ahead of itself a camera's axis meets the floor. Each is turned by the golden angle against the
    one before, so that neighbours look in different directions."""
    focal_px: float = Field(gt=0)
    """Focal length."""
    size_px: tuple[PositiveInt, PositiveInt]
    """Width and height of the pictures."""

    @property
    def names(self) -> tuple[str, ...]:
        """The cameras' names."""
        return tuple(f"C{number}" for number in range(1, self.count + 1))

    def positions(self, seed: int) -> Float[np.ndarray, "C 3"]:
        """Where they hang, in m; at random, one more moves none of the others within the square."""
        columns = math.isqrt(self.count - 1) + 1
        if self.layout == "grid":
            rows = -(-self.count // columns)
            row, column = np.divmod(np.arange(self.count), columns)
            places = np.column_stack([column - (columns - 1) / 2, row - (rows - 1) / 2])
        else:
            side = math.sqrt(self.count)
            places = side * (stream(seed, "layout").random((self.count, 2)) - 0.5)
        floor = np.array(self.center) + self.spacing_m * places
        return np.column_stack([floor, np.full(self.count, self.height)])

    def aims(self, positions: Float[np.ndarray, "C 3"]) -> Float[np.ndarray, "C 3"]:
        """The points on the floor at which cameras at these positions look, in m."""
        headings = GOLDEN_ANGLE * np.arange(self.count)
        ahead = self.ahead_m * np.column_stack([np.cos(headings), np.sin(headings)])
        return np.column_stack([positions[:, :2] + ahead, np.zeros(self.count)])
