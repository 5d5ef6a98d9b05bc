"""The room around the scene: how it is described, and where lines of sight end in it."""

from typing import Annotated, Literal

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from network.options import Options

Length = Annotated[float, Field(gt=0, le=200)]
Coordinate = Annotated[float, Field(allow_inf_nan=False)]


class RoomOptions(Options):
    """The room that the cameras hang in."""

    shape: Literal["rectangle", "ellipse"] = "rectangle"
    """Its plan."""
    center: tuple[Coordinate, Coordinate] = (0.0, 0.0)
    """Middle of the floor: x and y, metres."""
    size: tuple[Length, Length] = (22.0, 22.0)
    """Extent along x and y, metres."""
    height: Length = 5.0
    """Floor to ceiling, metres."""

    @property
    def perimeter(self) -> float:
        """Length of the walls, metres (of an ellipse, nearly)."""
        x, y = self.size
        if self.shape == "rectangle":
            return 2 * (x + y)
        return float(np.pi * np.hypot(x, y) / np.sqrt(2))


def inside(room: RoomOptions, points: Float[np.ndarray, "*P 2"]) -> Bool[np.ndarray, "*P"]:
    """Which points of the floor lie within the walls."""
    scaled = np.abs(points - np.array(room.center)) / (np.array(room.size) / 2)
    if room.shape == "rectangle":
        return scaled.max(axis=-1) < 1
    return (scaled**2).sum(axis=-1) < 1


def distance_to_wall(
    room: RoomOptions,
    start: Float[np.ndarray, " 2"],
    dx: Float[np.ndarray, "H W"],
    dy: Float[np.ndarray, "H W"],
) -> Float[np.ndarray, "H W"]:
    """How far lines of sight go before they meet a wall, in lengths of their directions.

    Args:
        room: The room.
        start: Where they start, metres, within the walls.
        dx: Their directions along x.
        dy: Their directions along y.
    """
    half_x, half_y = room.size[0] / 2, room.size[1] / 2
    x, y = (start - np.array(room.center)).tolist()
    with np.errstate(divide="ignore"):
        if room.shape == "rectangle":
            to_x = (np.copysign(half_x, dx) - x) / dx
            to_y = (np.copysign(half_y, dy) - y) / dy
            return np.minimum(to_x, to_y)
        # |q + t e|² = 1 in units of the half axes
        qx, qy, ex, ey = x / half_x, y / half_y, dx / half_x, dy / half_y
        a, b, c = ex * ex + ey * ey, qx * ex + qy * ey, qx * qx + qy * qy - 1
        return (np.sqrt(b * b - a * c) - b) / a


def along_wall(
    room: RoomOptions, x: Float[np.ndarray, "H W"], y: Float[np.ndarray, "H W"]
) -> Float[np.ndarray, "H W"]:
    """How far along the perimeter points of the walls lie, metres.

    Args:
        room: The room.
        x: Their positions on the floor, metres from the room's middle.
        y: The same along y.
    """
    size_x, size_y = room.size
    if room.shape == "ellipse":
        turn = np.arctan2(y / size_y, x / size_x) / (2 * np.pi) + 0.5
        return turn * room.perimeter
    on_x_side = np.abs(x) * size_y > np.abs(y) * size_x
    # counterclockwise from the corner at +x, -y
    x_side = np.where(x > 0, y + size_y / 2, size_x + size_y + size_y / 2 - y)
    y_side = np.where(y > 0, size_y + size_x / 2 - x, 2 * size_y + size_x + x + size_x / 2)
    return np.where(on_x_side, x_side, y_side)
