"""Solid things, made of narrow faces, and what a camera sees of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from jaxtyping import Float, Int, UInt8

from nodes.imaging.camera import Camera

_NEAREST_M = 0.1  # faces closer than this to a camera's plane are not drawn
_FARTHEST_PX = 20_000.0  # nor are those that end farther than this from the picture's corner
_LAMP = np.array([0.38, -0.27, 0.88])  # direction to the lamp
_SHIFT = 4  # binary digits of a pixel in polygon corners
_FINE = 2  # solids are drawn this much finer, then reduced: that smooths their edges

Box = tuple[int, int, int, int]
"""Left, top, right and bottom in pixels; right and bottom are excluded."""


@dataclass(frozen=True, slots=True, eq=False)
class Solids:
    """Closed surfaces that are alike: each has its own vertices, and all have the same faces between them.

    Attributes:
        vertices: Corners in the world, metres.
        faces: The corners of every face, half of them up one edge and half down the other; they run clockwise
            when seen from outside.
        normals: Outward unit vectors of the faces.
        colors: Colours of the faces in white light; blue, green, red, 0 to 255.
    """

    vertices: Float[np.ndarray, "M V 3"]
    faces: Int[np.ndarray, "F n"]
    normals: Float[np.ndarray, "M F 3"]
    colors: Float[np.ndarray, "M F 3"]


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The visible side of a mesh on a camera's picture, and beyond its edges.

    Attributes:
        polygons: Corners of its faces in pixels, far faces first.
        colors: Their shaded colours; blue, green, red.
        pictured: The fraction of the faces that the lens pictures at all, inside the picture or beyond.
    """

    polygons: Float[np.ndarray, "F n 2"]
    colors: Float[np.ndarray, "F 3"]
    pictured: float

    @property
    def box(self) -> Box:
        """The pixels that the polygons touch."""
        return box_around(self.polygons)


def views(solids: Solids, camera: Camera) -> list[View]:
    """Projects and shades the faces that are turned towards a camera, for each of some solids."""
    # all at once: solids are small, and calls cost more than numbers
    n_solids, n_vertices, _ = solids.vertices.shape
    pixels, depths = camera.project(solids.vertices.reshape(-1, 3))
    x, y = np.ascontiguousarray(pixels.T)
    usable = (depths > _NEAREST_M) & (np.abs(x) < _FARTHEST_PX) & (np.abs(y) < _FARTHEST_PX)
    corners = solids.faces.T[:, None] + n_vertices * np.arange(n_solids)[:, None]  # n, M, F
    pictured = usable[corners].all(axis=0)
    # a face is seen from outside when the ends of its edges run clockwise on the picture
    half = len(corners) // 2
    a, b, c, d = corners[0], corners[half - 1], corners[half], corners[-1]
    seen = pictured & ((x[c] - x[a]) * (y[d] - y[b]) > (y[c] - y[a]) * (x[d] - x[b]))
    # far faces first
    owners, numbers = np.nonzero(seen)
    nearness = -(depths[a] + depths[c])[seen]
    order = np.lexsort((nearness, owners))
    owners, numbers = owners[order], numbers[order]
    polygons = pixels.take(corners[:, owners, numbers].T, axis=0)
    colors = _shaded(solids, owners, numbers, camera)
    ends = np.searchsorted(owners, np.arange(n_solids + 1)).tolist()
    return [
        View(polygons[start:end], colors[start:end], fraction)
        for (start, end), fraction in zip(pairwise(ends), pictured.mean(axis=1).tolist(), strict=True)
    ]


def _shaded(
    solids: Solids, owners: Int[np.ndarray, " S"], numbers: Int[np.ndarray, " S"], camera: Camera
) -> Float[np.ndarray, "S 3"]:
    """Colours of some of the solids' faces, as they look to a camera."""
    # Lambert's law for a lamp, light from all sides, and a little more where the surface faces the viewer
    to_camera = camera.center - solids.vertices[:, 0]
    to_camera /= np.sqrt((to_camera**2).sum(axis=1))[:, None]
    shades = 0.70 + solids.normals @ (0.24 * _LAMP + 0.30 * to_camera)[..., None]
    return (solids.colors * shades)[owners, numbers]


def draw(
    picture: UInt8[np.ndarray, "H W 3"], seen: View, origin: tuple[int, int], gain: Float[np.ndarray, " 3"]
) -> None:
    """Draws a solid into a part of a picture.

    Args:
        picture: The part; it is overwritten.
        seen: What the camera sees of the solid.
        origin: Left and top of the part in the whole picture, pixels.
        gain: What light and lens do to blue, green and red.
    """
    height, width, _ = picture.shape
    fine = cv2.resize(picture, (_FINE * width, _FINE * height), interpolation=cv2.INTER_NEAREST)
    fill(fine, seen.polygons, (gain * seen.colors).tolist(), origin, float(_FINE))
    cv2.resize(fine, (width, height), dst=picture, interpolation=cv2.INTER_AREA)


def coverage(seen: View, box: Box) -> UInt8[np.ndarray, "H W"]:
    """How far a solid covers the pixels of a box, 0 to 255."""
    size = (box[2] - box[0], box[3] - box[1])
    return cv2.resize(silhouette(seen, box, float(_FINE)), size, interpolation=cv2.INTER_AREA).astype(
        np.uint8, copy=False
    )


def silhouette(seen: View, box: Box, scale: float) -> UInt8[np.ndarray, "h w"]:
    """Where a mesh covers a box, at a scale: 255 on the mesh, 0 beside it."""
    left, top, right, bottom = box
    mask = np.zeros((max(1, round(scale * (bottom - top))), max(1, round(scale * (right - left)))), np.uint8)
    fill(mask, seen.polygons, [[255.0]] * len(seen.polygons), (left, top), scale)
    return mask


def fill(
    canvas: UInt8[np.ndarray, "..."],
    polygons: Float[np.ndarray, "F n 2"],
    colors: Sequence[Sequence[float]],
    origin: tuple[int, int],
    scale: float,
) -> None:
    """Fills polygons of a canvas, each over those before it.

    Args:
        canvas: What to draw into.
        polygons: Their corners in the picture, pixels; a row of pixels crosses each of them once at most.
        colors: Their colours: as many numbers as the canvas has channels.
        origin: Where the canvas starts in the picture, pixels.
        scale: The canvas' pixels for every pixel of the picture.
    """
    # pixel 0's centre is at 0 and its edge at -1/2, at every scale: (polygons - origin + 1/2) scale - 1/2
    unit = 1 << _SHIFT
    shift = [unit * ((0.5 - start) * scale - 0.5) for start in origin]
    fixed = np.rint(polygons * (unit * scale) + shift).astype(np.int32)
    for corners, color in zip(list(fixed), colors, strict=True):
        cv2.fillConvexPoly(canvas, corners, color, cv2.LINE_8, _SHIFT)


def box_around(polygons: Float[np.ndarray, "F n 2"]) -> Box:
    """The smallest box that holds some polygons; empty if there are none."""
    if not len(polygons):
        return 0, 0, 0, 0
    left, top, width, height = cv2.boundingRect(polygons.reshape(-1, 2).astype(np.float32))
    return left, top, left + width + 1, top + height + 1


def union(a: Box, b: Box) -> Box:
    """The smallest box that holds two others; an empty one does not count."""
    if is_empty(a) or is_empty(b):
        return b if is_empty(a) else a
    return min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])


def clip(box: Box, limits: Box) -> Box:
    """The part of a box inside another; empty boxes come out with no width or height."""
    left, top = max(box[0], limits[0]), max(box[1], limits[1])
    return left, top, max(left, min(box[2], limits[2])), max(top, min(box[3], limits[3]))


def is_empty(box: Box) -> bool:
    """Whether a box holds no pixel."""
    return box[2] <= box[0] or box[3] <= box[1]
