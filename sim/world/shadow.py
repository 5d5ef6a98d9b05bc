"""The soft shadow on the floor below a person."""

from collections.abc import Sequence

import numpy as np

from nodes.camera import Camera
from sim.world.mesh import Layer
from sim.world.people import Pose

_RADIUS = 0.30  # the floor is darker this far around, as a fraction of the stature
_ANGLES = np.linspace(0, 2 * np.pi, 12, endpoint=False)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(len(_ANGLES))], axis=1)
_NEAREST_M = 0.1
_STEPS = np.linspace(1.0, 0.18, 6)  # one disc on another, each smaller and darker
_DARKNESS = 0.34 * np.exp(-((_STEPS / 0.55) ** 2)) + 0.28 * np.exp(-((_STEPS / 0.22) ** 2))
_COLORS = np.column_stack([np.zeros((len(_STEPS), 3)), 255 * _DARKNESS])


def shadows(poses: Sequence[Pose], camera: Camera) -> list[Layer]:
    """The shadow of each person, darkest between the feet; none where the lens cannot picture it whole."""
    if not poses:
        return []
    spots = np.array([[*pose.position, 0.0] for pose in poses])
    radii = _RADIUS * np.array([pose.stature for pose in poses])
    points = spots[:, None] + radii[:, None, None] * _CIRCLE
    pixels, depths = camera.project(points.reshape(-1, 3))
    rims = pixels.reshape(len(poses), -1, 2)
    whole = (depths.reshape(len(poses), -1) > _NEAREST_M).all(axis=1) & np.isfinite(rims).all(axis=(1, 2))
    centers = rims.mean(axis=1)[:, None]
    discs = (centers + step * (rims - centers) for step in _STEPS[:, None, None, None])
    polygons = np.stack(list(discs), axis=1)
    return [Layer(each[:n], _COLORS[:n]) for each, n in zip(polygons, whole * len(_STEPS), strict=True)]
