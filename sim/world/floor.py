"""The textures of floor and ceiling: rows along y, columns along x, from the room's lowest corner."""

from collections.abc import Sequence
from typing import Annotated

import cv2
import numpy as np
from jaxtyping import Float
from pydantic import Field

from network.options import Options
from sim.world.colors import Color, bgr
from sim.world.room import RoomOptions, inside
from sim.world.texture import COARSE, Texture, cloudy

FLOOR_TEXEL_M = 0.02
CEILING_TEXEL_M = 0.05


class FloorOptions(Options):
    """A tiled floor with stains and rugs."""

    tile: Annotated[float, Field(ge=0.1, le=200)] = 0.6
    """Length of a tile's side, metres."""
    colors: tuple[Color, Color] = ("#928c82", "#88837a")
    """Colours of the tiles, in turn."""
    blotches: Annotated[int, Field(ge=0, le=500)] = 14
    """Number of stains and rugs."""


def draw_floor(
    room: RoomOptions, options: FloorOptions, rug_colors: Sequence[Color], rng: np.random.Generator
) -> Texture:
    """Tiles with joints between them, and rugs and stains on them."""
    width, height = (round(side / FLOOR_TEXEL_M) for side in room.size)
    row = (np.arange(height) * FLOOR_TEXEL_M / options.tile).astype(int)
    column = (np.arange(width) * FLOOR_TEXEL_M / options.tile).astype(int)
    first, second = (bgr(color) for color in options.colors)
    checker = (np.arange(row[-1] + 1)[:, None] + np.arange(column[-1] + 1)) % 2
    tiles = np.where(checker[..., None] == 0, first, second) + 3 * rng.standard_normal((*checker.shape, 1))
    texture = np.clip(tiles, 0, 255).astype(np.uint8)[:, column][row]
    for joint in (np.s_[np.diff(row, prepend=0) > 0], np.s_[:, np.diff(column, prepend=0) > 0]):
        texture[joint] -= texture[joint] // 4
    for _ in range(options.blotches):
        color = bgr(rug_colors[int(rng.integers(len(rug_colors)))])
        center, turn = rng.uniform(0, 1, 2) * (width, height), float(rng.uniform(0, 180))
        if rng.random() < 0.4:
            _rug(texture, center, turn, color, rng)
        else:
            _stain(texture, center, turn, first, rng)
    return cloudy(texture, 7.0, rng)


def _rug(
    texture: Texture,
    center: Float[np.ndarray, " 2"],
    turn: float,
    color: Float[np.ndarray, " 3"],
    rng: np.random.Generator,
) -> None:
    """Draws a rug with a border."""
    size = rng.uniform(0.6, 1.6, 2) / FLOOR_TEXEL_M
    for inset, tone in ((0.0, 0.7), (8.0, 1.0), (16.0, 0.85), (20.0, 0.95)):
        corners = cv2.boxPoints((center.tolist(), (size - inset).tolist(), turn))
        cv2.fillConvexPoly(texture, np.rint(corners).astype(np.int32), np.clip(tone * color, 0, 255).tolist())


def _stain(
    texture: Texture,
    center: Float[np.ndarray, " 2"],
    turn: float,
    color: Float[np.ndarray, " 3"],
    rng: np.random.Generator,
) -> None:
    """Draws a stain: an irregular patch, darker or lighter than the floor."""
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    radii = rng.uniform(0.15, 0.45) * (
        1 + 0.25 * np.sin(3 * angles + turn) + 0.15 * np.sin(5 * angles - turn)
    )
    ring = center + radii[:, None] / FLOOR_TEXEL_M * np.stack([np.cos(angles), 0.7 * np.sin(angles)], axis=1)
    tone = np.clip(rng.uniform(0.75, 1.12) * color, 0, 255).tolist()
    cv2.fillPoly(texture, [np.rint(ring).astype(np.int32)], tone, cv2.LINE_AA)


def shade_floor(
    texture: Texture, room: RoomOptions, footprints: Sequence[Float[np.ndarray, "4 2"]]
) -> Texture:
    """A floor that is darker along the walls and around what stands on it."""
    height, width = texture.shape[:2]
    texel_m = FLOOR_TEXEL_M * COARSE
    corner = np.array(room.center) - np.array(room.size) / 2
    x = corner[0] + texel_m * (np.arange(width // COARSE) + 0.5)
    y = corner[1] + texel_m * (np.arange(height // COARSE) + 0.5)
    things = np.where(inside(room, np.stack(np.meshgrid(x, y), axis=-1)), 0, 255).astype(np.uint8)
    for footprint in footprints:
        cv2.fillConvexPoly(things, np.rint((footprint - corner) / texel_m).astype(np.int32), 255.0)
    near = cv2.copyMakeBorder(things, 8, 8, 8, 8, cv2.BORDER_CONSTANT, value=255.0)
    near = 0.6 * cv2.GaussianBlur(near, (0, 0), 0.12 / texel_m) + 0.4 * cv2.GaussianBlur(
        near, (0, 0), 0.4 / texel_m
    )
    light = cv2.resize((255 - 0.5 * near[8:-8, 8:-8]).astype(np.uint8), (width, height))
    return cv2.multiply(texture, cv2.cvtColor(light, cv2.COLOR_GRAY2BGR), scale=1 / 255).astype(
        np.uint8, copy=False
    )


def draw_ceiling(room: RoomOptions) -> Texture:
    """Panels, with a lamp in every third of them."""
    width, height = (round(side / CEILING_TEXEL_M) for side in room.size)
    y, x = np.mgrid[:height, :width] * CEILING_TEXEL_M % 3.6
    lamp = (x > 1.2) & (x < 2.4) & (y > 1.65) & (y < 1.95)
    joint = np.minimum(x % 0.6, y % 0.6) < CEILING_TEXEL_M
    return np.where(lamp, 246, np.where(joint, 118, 136)).astype(np.uint8)[..., None].repeat(3, axis=-1)
