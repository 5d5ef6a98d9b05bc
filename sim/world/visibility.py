"""Ground truth of visibility: how much of a person a camera sees, from the shapes that it draws."""

from dataclasses import dataclass

import cv2
import numpy as np

from nodes.camera import Camera
from sim.world.figure import figures
from sim.world.mesh import View, clip, is_empty, silhouette, views
from sim.world.world import World

_LARGEST_PX = 256  # silhouettes are compared at this size at most


@dataclass(frozen=True, slots=True)
class Visibility:
    """How much of a person a camera sees.

    Attributes:
        in_view: The fraction of the whole silhouette that lies inside the picture.
        occluded: The fraction of that part that other people and occluders hide; 0 if nothing is in view.
    """

    in_view: float
    occluded: float


def visibility(world: World, camera: Camera, name: str, time_s: float) -> Visibility:
    """How much of a person a camera sees.

    Args:
        world: The world.
        camera: The camera.
        name: The person.
        time_s: When, seconds since the run's first frame.

    Raises:
        ValueError: Nobody in the world is called so.
    """
    person = world.person(name)
    (seen,) = views(figures([person.pose_at(time_s)], [person.palette]), camera)
    box = seen.box
    shown = clip(box, (0, 0, camera.width_px, camera.height_px))
    if is_empty(shown):
        return Visibility(0.0, 0.0)
    scale = min(1.0, _LARGEST_PX / max(box[2] - box[0], box[3] - box[1]))
    whole = cv2.countNonZero(silhouette(seen, box, scale))
    inside = silhouette(seen, shown, scale)
    n_inside = cv2.countNonZero(inside)
    if n_inside == 0:
        return Visibility(0.0, 0.0)
    for other in _in_front(world, camera, name, time_s):
        if not is_empty(clip(shown, other.box)):
            inside = cv2.subtract(inside, silhouette(other, shown, scale))
    # faces beyond what the lens can picture belong to the whole, too
    in_view = min(1.0, n_inside / whole) * seen.pictured
    return Visibility(in_view, 1 - cv2.countNonZero(inside) / n_inside)


def _in_front(world: World, camera: Camera, name: str, time_s: float) -> list[View]:
    """Everything that is drawn over a person."""
    viewer = camera.center[:2]
    position = world.position(name, time_s)
    distance = np.linalg.norm(position - viewer)
    occluders = [
        view
        for occluder in world.occluders
        if occluder.may_hide(position, viewer)
        for view in views(occluder.solid, camera)
    ]
    others = [(other.pose_at(time_s), other.palette) for other in world.people if other.name != name]
    nearer = [
        (pose, palette) for pose, palette in others if np.linalg.norm(pose.position - viewer) < distance
    ]
    if not nearer:
        return occluders
    bodies = figures([pose for pose, _ in nearer], [palette for _, palette in nearer])
    return occluders + views(bodies, camera)
