"""Ground truth of visibility: how much of a person or object a camera sees, from the shapes that it draws."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from nodes.imaging.camera import Camera
from sim.world.figure import figures, heads
from sim.world.mesh import Solids, View, clip, is_empty, silhouette, views
from sim.world.world import Part, World

_LARGEST_PX = 256  # silhouettes are compared at this size at most


@dataclass(frozen=True, slots=True)
class Visibility:
    """How much of a person or object a camera sees.

    Attributes:
        in_view: The fraction of the whole silhouette that lies inside the picture.
        occluded: The fraction of that part that others and occluders hide; 0 if nothing is in view.
    """

    in_view: float
    occluded: float


def visibility(world: World, camera: Camera, name: str, time_s: float, part: Part = "body") -> Visibility:
    """How much of a person or object a camera sees.

    Args:
        world: The world.
        camera: The camera.
        name: The person or object.
        time_s: When, seconds since the run's first frame.
        part: What of a person; their own body does not hide their head.

    Raises:
        ValueError: Nothing and nobody in the world is called so.
    """
    (seen,) = views(_solid(world, name, time_s, part), camera)
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


def _solid(world: World, name: str, time_s: float, part: Part) -> Solids:
    prop = next((each for each in world.objects if each.name == name), None)
    if prop is not None:
        return prop.at(world.underside(name, time_s)[0])
    body = _bodies(world, [name], time_s)
    return heads(body) if part == "head" else body


def _bodies(world: World, names: Sequence[str], time_s: float) -> Solids:
    people = [world.person(name) for name in names]
    return figures([person.pose_at(time_s) for person in people], [person.palette for person in people])


def _in_front(world: World, camera: Camera, name: str, time_s: float) -> list[View]:
    """Everything that is drawn over a person or object."""
    viewer = camera.center[:2]
    position = world.underside(name, time_s)[0, :2]
    distance = np.linalg.norm(position - viewer)
    occluders = [
        view
        for occluder in world.occluders
        if occluder.may_hide(position, viewer)
        for view in views(occluder.solid, camera)
    ]
    nearer = [
        other.name
        for other in world.people
        if other.name != name and np.linalg.norm(other.position_at(time_s) - viewer) < distance
    ]
    props = [
        view
        for other in world.objects
        if other.name != name
        and np.linalg.norm(world.underside(other.name, time_s)[0, :2] - viewer) < distance
        for view in views(other.at(world.underside(other.name, time_s)[0]), camera)
    ]
    return occluders + props + (views(_bodies(world, nearer, time_s), camera) if nearer else [])
