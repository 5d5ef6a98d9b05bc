"""What a camera sees of the empty room: one line of sight through every quarter of a pixel."""

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from nodes.imaging.camera import Camera
from sim.world.floor import CEILING_TEXEL_M, FLOOR_TEXEL_M
from sim.world.interior import Interior
from sim.world.room import RoomOptions, along_wall, distance_to_wall, inside
from sim.world.texture import Texture
from sim.world.walls import WALL_TEXEL_M

_FINE = 2  # lines of sight for every pixel and axis
_STRIP_PX = 32
"""Rows that are drawn at once: the whole picture would take more memory than all that a node does later."""


def lines_of_sight(camera: Camera, rows: range | None = None) -> Float[np.ndarray, "h w 3"]:
    """Directions in the world, not of unit length, through a grid twice as fine as the pixels.

    Args:
        camera: The camera.
        rows: The rows of pixels that are wanted; None for all.
    """
    rows = range(camera.height_px) if rows is None else rows
    # with the rows beside them, for whatever lies between two rows
    around = range(max(rows.start - 1, 0), min(rows.stop + 1, camera.height_px))
    pixels = np.stack(np.meshgrid(np.arange(camera.width_px), np.arange(around.start, around.stop)), axis=-1)
    if camera.distortion.any():
        # the inverse of the distortion has no closed form: OpenCV iterates
        x, y = (
            cv2.undistortPoints(pixels.reshape(-1, 1, 2).astype(np.float64), camera.K, camera.distortion)
            .reshape(len(around), camera.width_px, 2)
            .transpose(2, 0, 1)
        )
    else:
        y = (pixels[..., 1] - camera.K[1, 2]) / camera.K[1, 1]
        x = (pixels[..., 0] - camera.K[0, 2] - camera.K[0, 1] * y) / camera.K[0, 0]
    size = (_FINE * camera.width_px, _FINE * len(around))
    # K⁻¹ [u, v, 1]ᵀ in camera axes, Rᵀ of it in world axes
    rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ camera.R
    fine = cv2.resize(rays.astype(np.float32), size, interpolation=cv2.INTER_LINEAR)
    return fine[_FINE * (rows.start - around.start) :][: _FINE * len(rows)]


def require_inside(camera: Camera, room: RoomOptions) -> None:
    """Checks that a camera hangs inside the room.

    Raises:
        ValueError: It does not.
    """
    place = camera.center.tolist()
    if not (inside(room, camera.center[None, :2]).all() and 0 < place[2] < room.height):
        raise ValueError(
            f"camera {camera.name} at {[round(c, 2) for c in place]} is outside the room: "
            "move it, or give world.room another center, size or height"
        )


def empty_room(camera: Camera, room: RoomOptions, interior: Interior) -> UInt8[np.ndarray, "H W 3"]:
    """The room as a camera sees it in white light.

    Args:
        camera: The camera.
        room: The room's extent.
        interior: What it looks like.

    Raises:
        ValueError: The camera hangs outside the room.
    """
    require_inside(camera, room)
    picture = np.empty((camera.height_px, camera.width_px, 3), np.uint8)
    for top in range(0, camera.height_px, _STRIP_PX):
        rows = range(top, min(top + _STRIP_PX, camera.height_px))
        picture[rows.start : rows.stop] = _strip(camera, rows, room, interior)
    return picture


def _strip(camera: Camera, rows: range, room: RoomOptions, interior: Interior) -> UInt8[np.ndarray, "h W 3"]:
    """Some rows of the empty room."""
    x, y, z = camera.center.tolist()
    dx, dy, dz = np.ascontiguousarray(np.moveaxis(lines_of_sight(camera, rows), -1, 0))
    reach = distance_to_wall(room, camera.center[:2], dx, dy)
    at_wall_z = z + reach * dz
    on_floor, on_ceiling = at_wall_z < 0, at_wall_z > room.height
    with np.errstate(divide="ignore"):
        np.copyto(reach, -z / dz, where=on_floor)
        np.copyto(reach, (room.height - z) / dz, where=on_ceiling)
    hit_x, hit_y = x - room.center[0] + reach * dx, y - room.center[1] + reach * dy
    along, column, row = along_wall(room, hit_x, hit_y), hit_x + room.size[0] / 2, hit_y + room.size[1] / 2
    fine = np.empty((*reach.shape, 3), np.uint8)
    for where, texture, right, down, texel_m in (
        (~(on_floor | on_ceiling), interior.walls, along, at_wall_z, WALL_TEXEL_M),
        (on_floor, interior.floor, column, row, FLOOR_TEXEL_M),
        (on_ceiling, interior.ceiling, column, row, CEILING_TEXEL_M),
    ):
        _paint(fine, where, texture, right / texel_m - 0.5, down / texel_m - 0.5)
    return cv2.resize(fine, (camera.width_px, len(rows)), interpolation=cv2.INTER_AREA)


def _paint(
    picture: UInt8[np.ndarray, "H W 3"],
    where: Bool[np.ndarray, "H W"],
    texture: Texture,
    column: Float[np.ndarray, "H W"],
    row: Float[np.ndarray, "H W"],
) -> None:
    """Fills a part of a picture with a texture, given the position in the texture that each pixel shows."""
    rows = np.flatnonzero(where.any(axis=1))
    if not len(rows):
        return
    part = np.s_[rows[0] : rows[-1] + 1]
    colors = cv2.remap(texture, column[part], row[part], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    cv2.copyTo(colors, where[part].astype(np.uint8), picture[part])
