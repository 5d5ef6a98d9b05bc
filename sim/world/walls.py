"""The texture of the walls: rows from the floor up, columns along the perimeter."""

from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from network.options import Options
from sim.world.colors import Color, bgr
from sim.world.room import RoomOptions
from sim.world.texture import Texture, cloudy

WALL_TEXEL_M = 0.025


class WallsOptions(Options):
    """Walls with things on them."""

    color: Color = "#aaa59b"
    """Colour of the paint."""
    posters: Annotated[int, Field(ge=0, le=500)] = 26
    """Number of posters and boards."""
    poster_colors: Annotated[tuple[Color, ...], Field(min_length=1)] = (
        "#7d3c36", "#3f5a48", "#c2a35a", "#4c5d78", "#d8d2c4", "#5c5560",
    )  # fmt: skip
    """Colours of posters and rugs; one like the target's clothes makes tracking harder."""
    doors: Annotated[int, Field(ge=0, le=100)] = 5
    """Number of doors."""
    windows: Annotated[int, Field(ge=0, le=100)] = 8
    """Number of windows."""


def draw_walls(room: RoomOptions, options: WallsOptions, rng: np.random.Generator) -> Texture:
    """Painted walls with a skirting, pilasters, doors, windows and posters."""
    width, height = round(room.perimeter / WALL_TEXEL_M), round(room.height / WALL_TEXEL_M)
    rise = np.linspace(0, 1, height)
    shade = 0.86 + 0.2 * np.sin(np.pi * (0.15 + 0.7 * rise))  # lamps light the middle best
    texture = np.repeat(
        np.clip(shade[:, None] * bgr(options.color), 0, 255).astype(np.uint8)[:, None], width, axis=1
    )
    texture = cloudy(texture, 5.0, rng)
    for x in np.arange(0, room.perimeter, 5.0):
        _rectangle(texture, x, 0.0, 0.35, room.height, 0.88 * bgr(options.color))
    for _ in range(options.windows):
        _window(texture, rng.uniform(0, room.perimeter), rng)
    for _ in range(options.posters):
        color = bgr(options.poster_colors[rng.integers(len(options.poster_colors))])
        _poster(texture, rng.uniform(0, room.perimeter), color, rng)
    for _ in range(options.doors):
        _door(texture, rng.uniform(0, room.perimeter), rng)
    _rectangle(texture, 0.0, 0.0, room.perimeter, 0.12, 0.45 * bgr(options.color))
    return texture


def _rectangle(
    walls: Texture, x: float, z: float, width: float, height: float, color: Float[np.ndarray, " 3"]
) -> None:
    """Fills an upright rectangle of a wall, given in metres."""
    left, right = round(x / WALL_TEXEL_M), round((x + width) / WALL_TEXEL_M)
    low, high = round(z / WALL_TEXEL_M), round((z + height) / WALL_TEXEL_M)
    walls[max(low, 0) : max(high, 0), max(left, 0) : max(right, 0)] = np.clip(color, 0, 255)


def _window(walls: Texture, x: float, rng: np.random.Generator) -> None:
    """Draws a window with a cross of bars and sky behind it."""
    width = rng.uniform(1.0, 1.8)
    _rectangle(walls, x - 0.08, 1.92, width + 0.16, 1.56, np.array([98.0, 104.0, 108.0]))
    for row in range(8):
        sky = np.array([226.0, 216.0, 204.0]) - 7 * (8 - row) * np.array([0.6, 0.8, 1.0])
        _rectangle(walls, x, 2.0 + 0.175 * row, width, 0.175, sky)
    _rectangle(walls, x + width / 2 - 0.03, 2.0, 0.06, 1.4, np.array([110.0, 114.0, 118.0]))
    _rectangle(walls, x, 2.7, width, 0.06, np.array([110.0, 114.0, 118.0]))


def _poster(walls: Texture, x: float, color: Float[np.ndarray, " 3"], rng: np.random.Generator) -> None:
    """Draws a framed poster with a picture and a few lines of text."""
    width, height, z = rng.uniform(0.5, 1.3), rng.uniform(0.6, 1.6), rng.uniform(0.5, 1.3)
    tone = rng.uniform(0.8, 1.1)
    _rectangle(walls, x - 0.05, z - 0.05, width + 0.1, height + 0.1, np.array([55.0, 58.0, 62.0]))
    _rectangle(walls, x, z, width, height, tone * color)
    _rectangle(walls, x + 0.15 * width, z + 0.45 * height, 0.7 * width, 0.4 * height, 0.75 * tone * color)
    for line in range(3):
        length = width * rng.uniform(0.4, 0.75)
        _rectangle(
            walls, x + 0.12 * width, z + (0.1 + 0.1 * line) * height, length, 0.04 * height, 60 + 0.8 * color
        )


def _door(walls: Texture, x: float, rng: np.random.Generator) -> None:
    """Draws a door with its frame, panels and handle."""
    wood = np.array([62.0, 88.0, 118.0]) * rng.uniform(0.6, 1.1)
    _rectangle(walls, x - 0.1, 0.0, 1.15, 2.2, np.array([120.0, 126.0, 130.0]))
    _rectangle(walls, x, 0.0, 0.95, 2.1, wood)
    for z in (0.25, 1.2):
        _rectangle(walls, x + 0.15, z, 0.65, 0.75, 0.86 * wood)
    _rectangle(walls, x + 0.8, 1.02, 0.1, 0.05, np.array([190.0, 190.0, 190.0]))
