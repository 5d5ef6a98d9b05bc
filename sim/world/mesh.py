"""Solid things as meshes of four-sided faces, and what a camera sees of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Int, UInt8

from nodes.camera import Camera

_NEAREST_M = 0.1  # faces closer than this to a camera's plane are not drawn
_FARTHEST_PX = 20_000.0  # nor are those that end farther than this from the picture's corner
_LAMP = np.array([0.38, -0.27, 0.88])  # direction to the lamp
_SHIFT = 4  # binary digits of a pixel in polygon corners
_FINE = 2  # pictures of meshes are drawn this much finer, then reduced: that smooths their edges

Box = tuple[int, int, int, int]
"""Left, top, right and bottom in pixels; right and bottom are excluded."""


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A closed surface.

    Attributes:
        vertices: Corners in the world, metres.
        faces: The corners of every face; they run clockwise when seen from outside.
        normals: Outward unit vectors of the faces.
        colors: Colours of the faces in white light; blue, green, red, 0 to 255.
    """

    vertices: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 4"]
    normals: Float[np.ndarray, "F 3"]
    colors: Float[np.ndarray, "F 3"]


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """Polygons to draw, the first one lowest; each replaces what it covers.

    Attributes:
        polygons: Their corners in pixels; convex.
        colors: Blue, green and red times coverage, then coverage, 0 to 255.
    """

    polygons: Float[np.ndarray, "F n 2"]
    colors: Float[np.ndarray, "F 4"]


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The visible side of a mesh on a camera's picture, and beyond its edges.

    Attributes:
        polygons: Corners of its faces in pixels, far faces first.
        colors: Their shaded colours; blue, green, red.
        pictured: The fraction of the faces that the lens pictures at all, inside the picture or beyond.
    """

    polygons: Float[np.ndarray, "F 4 2"]
    colors: Float[np.ndarray, "F 3"]
    pictured: float

    def under(self, gain: Float[np.ndarray, " 3"]) -> Layer:
        """Its polygons, opaque, with what light and lens do to blue, green and red."""
        return Layer(self.polygons, np.column_stack([gain * self.colors, np.full(len(self.colors), 255.0)]))

    @property
    def box(self) -> Box:
        """The pixels that the polygons touch."""
        return box_around(self.polygons)


def views(meshes: Sequence[Mesh], camera: Camera) -> list[View]:
    """Projects and shades the faces of meshes that are turned towards a camera."""
    if not meshes:
        return []
    # all at once: the meshes are small, and calls cost more than numbers
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)])
    owners = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    pixels, depths = camera.project(vertices)
    x, y = pixels.T
    usable = (depths > _NEAREST_M) & (np.abs(x) < _FARTHEST_PX) & (np.abs(y) < _FARTHEST_PX)
    a, b, c, d = faces.T
    pictured = usable[a] & usable[b] & usable[c] & usable[d]
    # a face is seen from outside when its corners run clockwise on the picture
    clockwise = (x[c] - x[a]) * (y[d] - y[b]) > (y[c] - y[a]) * (x[d] - x[b])
    seen = np.flatnonzero(pictured & clockwise)
    seen = seen[np.lexsort((-(depths[a] + depths[c])[seen], owners[seen]))]
    colors = _shaded(meshes, vertices[starts[:-1]], camera)[seen]
    polygons = pixels.take(faces[seen], axis=0)
    parts = np.split(np.arange(len(seen)), np.searchsorted(owners[seen], np.arange(1, len(meshes))))
    fractions = np.bincount(owners, pictured) / np.bincount(owners)
    return [
        View(polygons[part], colors[part], fraction)
        for part, fraction in zip(parts, fractions.tolist(), strict=True)
    ]


def _shaded(
    meshes: Sequence[Mesh], places: Float[np.ndarray, "M 3"], camera: Camera
) -> Float[np.ndarray, "F 3"]:
    """Colours of all faces of meshes at some places, as they look to a camera."""
    # Lambert's law for a lamp, light from all sides, and a little more where the surface faces the viewer
    to_camera = camera.center - places
    to_camera /= np.linalg.norm(to_camera, axis=1, keepdims=True)
    shades = [
        0.70 + mesh.normals @ (0.24 * _LAMP + 0.30 * direction)
        for mesh, direction in zip(meshes, to_camera, strict=True)
    ]
    return np.concatenate([mesh.colors for mesh in meshes]) * np.concatenate(shades)[:, None]


def sprite(layers: Sequence[Layer], box: Box) -> UInt8[np.ndarray, "H W 4"]:
    """A picture of layers, the first one lowest: blue, green and red times coverage, then coverage."""
    left, top, right, bottom = box
    fine = np.zeros((_FINE * (bottom - top), _FINE * (right - left), 4), np.uint8)
    for layer in layers:
        _fill(fine, layer.polygons, np.minimum(layer.colors, 255).tolist(), (left, top), float(_FINE))
    return cv2.resize(fine, (right - left, bottom - top), interpolation=cv2.INTER_AREA)


def silhouette(seen: View, box: Box, scale: float) -> UInt8[np.ndarray, "h w"]:
    """Where a mesh covers a box, at a scale: 255 on the mesh, 0 beside it."""
    left, top, right, bottom = box
    mask = np.zeros((max(1, round(scale * (bottom - top))), max(1, round(scale * (right - left)))), np.uint8)
    _fill(mask, seen.polygons, [[255.0]] * len(seen.polygons), (left, top), scale)
    return mask


def _fill(
    canvas: UInt8[np.ndarray, "..."],
    polygons: Float[np.ndarray, "F n 2"],
    colors: Sequence[Sequence[float]],
    origin: tuple[int, int],
    scale: float,
) -> None:
    """Draws polygons into a canvas that shows the picture from an origin on, at a scale."""
    # pixel 0's centre is at 0 and its edge at -1/2, at every scale
    corners = (polygons - np.array(origin) + 0.5) * scale - 0.5
    fixed = np.rint(corners * (1 << _SHIFT)).astype(np.int32)
    for corner, color in zip(list(fixed), colors, strict=True):
        cv2.fillConvexPoly(canvas, corner, color, cv2.LINE_8, _SHIFT)


def lay_over(
    picture: UInt8[np.ndarray, "H W 3"], layer: UInt8[np.ndarray, "H W 4"]
) -> UInt8[np.ndarray, "H W 3"]:
    """A layer over a picture: picture (1 - coverage) + layer."""
    uncovered = cv2.cvtColor(255 - layer[..., 3], cv2.COLOR_GRAY2BGR)
    return cv2.add(cv2.multiply(picture, uncovered, scale=1 / 255), cv2.cvtColor(layer, cv2.COLOR_BGRA2BGR))


def box_around(polygons: Float[np.ndarray, "F n 2"]) -> Box:
    """The smallest box that holds some polygons; empty if there are none."""
    if not len(polygons):
        return 0, 0, 0, 0
    x, y = polygons.reshape(-1, 2).T
    return math.floor(x.min()), math.floor(y.min()), math.ceil(x.max()) + 1, math.ceil(y.max()) + 1


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
