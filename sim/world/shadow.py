"""The soft shadow on the floor below a person, or below an object that stands on it."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from nodes.imaging.camera import Camera
from sim.world.mesh import Box, box_around, fill

PERSON_RADIUS = 0.30
"""The floor is darker this far around a person, as a fraction of the stature."""
OBJECT_RADIUS = 2.5
"""And this far around an object, in radii."""
_ANGLES = np.linspace(0, 2 * np.pi, 12, endpoint=False)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(len(_ANGLES))], axis=1)
_NEAREST_M = 0.1
_STEPS = np.linspace(1.0, 0.18, 5)  # one disc on another, each smaller and darker
_DARKNESS = 0.34 * np.exp(-((_STEPS / 0.55) ** 2)) + 0.28 * np.exp(-((_STEPS / 0.22) ** 2))
_LIGHT = (255 * (1 - _DARKNESS[:, None])).tolist()


@dataclass(frozen=True, slots=True, eq=False)
class Shadow:
    """A shadow on a camera's picture.

    Attributes:
        polygons: Corners of its discs in pixels, the widest first; none if the lens cannot picture it whole.
    """

    polygons: Float[np.ndarray, "n 12 2"]

    @property
    def box(self) -> Box:
        """The pixels that it touches."""
        return box_around(self.polygons)

    def darken(self, picture: UInt8[np.ndarray, "H W 3"], origin: tuple[int, int]) -> None:
        """Draws it into a part of a picture, whose left and top in the whole picture are given."""
        light = np.full(picture.shape[:2], 255, np.uint8)
        fill(light, self.polygons, _LIGHT, origin, 1.0)
        cv2.multiply(picture, cv2.cvtColor(light, cv2.COLOR_GRAY2BGR), dst=picture, scale=1 / 255)


NO_SHADOW = Shadow(np.empty((0, len(_CIRCLE), 2)))
"""That of what is in the air."""


def shadows(
    places: Sequence[Float[np.ndarray, " 2"]], radii: Float[np.ndarray, " n"], camera: Camera
) -> list[Shadow]:
    """Shadows, darkest in their middles.

    Args:
        places: Their middles on the floor, metres; at least one.
        radii: How far each reaches, metres.
        camera: The camera.
    """
    spots = np.array([(*place.tolist(), 0.0) for place in places])
    points = spots[:, None] + radii[:, None, None] * _CIRCLE
    pixels, depths = camera.project(points.reshape(-1, 3))
    rims = pixels.reshape(len(spots), len(_CIRCLE), 2)
    nearest, centers = depths.reshape(len(spots), -1).min(axis=1), rims.mean(axis=1)
    # what the lens cannot picture is NaN, and so is any mean over it
    whole = (nearest > _NEAREST_M) & np.isfinite(centers[:, 0])
    centers = centers[:, None]
    discs = centers[:, None] + _STEPS[:, None, None] * (rims - centers)[:, None]
    return [Shadow(each[: len(_STEPS) * shown]) for each, shown in zip(discs, whole.tolist(), strict=True)]
