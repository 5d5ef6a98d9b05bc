"""A camera's pictures of the simulated world.

What does not move (the room, the occluders) is drawn once. People and objects are then laid over it, far to
near, each cut out where an occluder in front of them hides them; the sensor's noise comes last.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from nodes.imaging.camera import Camera
from sim.world.background import empty_room
from sim.world.figure import figures
from sim.world.light import Sensor, gain_at
from sim.world.mesh import Box, View, clip, coverage, draw, is_empty, union, views
from sim.world.occluders import Occluder
from sim.world.shadow import NO_SHADOW, OBJECT_RADIUS, PERSON_RADIUS, Shadow, shadows
from sim.world.world import World

Picture = UInt8[np.ndarray, "H W 3"]
_FALLOFF = 0.16  # a lens gives this much less light in the picture's corners
_STANDING_M = 0.01  # an object this near to the floor stands on it, and casts a shadow there
_ALL = 255  # coverage of a pixel that is wholly covered


@dataclass(frozen=True, slots=True, eq=False)
class _Cover:
    """What an occluder hides: its coverage of a box of the picture, 0 to 255."""

    occluder: Occluder
    box: Box
    coverage: UInt8[np.ndarray, "H W"]


@dataclass(frozen=True, slots=True, eq=False)
class _Thing:
    """A person or an object: where it is above the floor, and what the camera sees of it and its shadow."""

    place: Float[np.ndarray, " 2"]
    body: View
    shadow: Shadow


class Renderer:
    """Draws what one camera sees. The same world, camera and frame always give the same picture."""

    def __init__(self, world: World, camera: Camera) -> None:
        """Draws everything that does not move.

        Args:
            world: The world, with the seed of the run.
            camera: The camera that looks at it.

        Raises:
            ValueError: The camera hangs outside the room.
        """
        self._world, self._camera = world, camera
        self._limits: Box = (0, 0, camera.width_px, camera.height_px)
        options = world.options
        self._sensor = Sensor(camera, options.noise, options.lighting.camera_spread, world.seed)
        self._falloff = _falloff(camera)
        scene = empty_room(camera, options.room, world.interior)
        self._covers = self._draw_occluders(scene)
        self._scene = cv2.multiply(scene, cv2.merge([self._falloff] * 3), dtype=cv2.CV_8U)
        self._lit: tuple[list[float], Picture] = ([1.0, 1.0, 1.0], self._scene)

    def frame(self, index: int, time_s: float) -> Picture:
        """The picture that the camera takes.

        Args:
            index: Number of the frame; the sensor's noise depends on it.
            time_s: When it is taken, seconds since the run's first frame.

        Returns:
            Blue, green and red of every pixel.
        """
        gain = gain_at(self._world.light, time_s) * self._sensor.gain
        picture = self._lit_scene(gain).copy()
        viewer = self._camera.center[:2].tolist()
        # far to near
        for thing in sorted(
            [*self._people(time_s), *self._objects(time_s)],
            key=lambda thing: -math.dist(thing.place.tolist(), viewer),
        ):
            self._draw_thing(picture, thing, gain)
        return self._sensor.read_out(picture, index)

    def _people(self, time_s: float) -> list[_Thing]:
        people = self._world.people
        if not people:
            return []
        poses = [person.pose_at(time_s) for person in people]
        places = [pose.position for pose in poses]
        bodies = views(figures(poses, [person.palette for person in people]), self._camera)
        radii = PERSON_RADIUS * np.array([pose.stature for pose in poses])
        return list(map(_Thing, places, bodies, shadows(places, radii, self._camera)))

    def _objects(self, time_s: float) -> list[_Thing]:
        things = []
        for prop in self._world.objects:
            position, _ = self._world.underside(prop.name, time_s)
            (body,) = views(prop.at(position), self._camera)
            shadow = NO_SHADOW
            if position[2] < _STANDING_M:
                radius = OBJECT_RADIUS * prop.radius
                (shadow,) = shadows([position[:2]], np.array([radius]), self._camera)
            things.append(_Thing(position[:2], body, shadow))
        return things

    def _lit_scene(self, gain: Float[np.ndarray, " 3"]) -> Picture:
        """What does not move, under a light; kept as long as the light stays the same."""
        if gain.tolist() != self._lit[0]:
            self._lit = (gain.tolist(), cv2.transform(self._scene, np.diag(gain)))
        return self._lit[1]

    def _draw_occluders(self, scene: Picture) -> list[_Cover]:
        """Lays the occluders over the empty room, and remembers what each of them hides."""
        viewer = self._camera.center[:2]
        covers = []
        for occluder in sorted(
            self._world.occluders, key=lambda o: -float(np.linalg.norm(o.center - viewer))
        ):
            (seen,) = views(occluder.solid, self._camera)
            box = clip(seen.box, self._limits)
            if is_empty(box):
                continue
            draw(_part(scene, box), seen, box[:2], np.ones(3))
            covers.append(_Cover(occluder, box, coverage(seen, box)))
        return covers

    def _draw_thing(self, picture: Picture, thing: _Thing, gain: Float[np.ndarray, " 3"]) -> None:
        """Lays a person or an object into a picture, except where an occluder in front hides it."""
        body, shadow = thing.body, thing.shadow
        body_box, shadow_box = clip(body.box, self._limits), clip(shadow.box, self._limits)
        box = union(body_box, shadow_box)
        if is_empty(box):
            return
        hidden = self._hidden(thing.place, box)
        if hidden is not None and hidden.min() == _ALL:
            return
        part = _part(picture, box)
        before = part if hidden is None else part.copy()
        if not is_empty(shadow_box):
            shadow.darken(_part(picture, shadow_box), shadow_box[:2])
        if not is_empty(body_box):
            left, top, right, bottom = body_box
            middle = self._falloff[(top + bottom) // 2, (left + right) // 2]
            draw(_part(picture, body_box), body, (left, top), gain * middle)
        if hidden is not None:
            # before · hidden + part · (1 - hidden)
            kept = cv2.multiply(before, cv2.cvtColor(hidden, cv2.COLOR_GRAY2BGR), scale=1 / _ALL)
            shown = cv2.cvtColor(_ALL - hidden, cv2.COLOR_GRAY2BGR)
            cv2.multiply(part, shown, dst=part, scale=1 / _ALL)
            cv2.add(part, kept, dst=part)

    def _hidden(self, point: Float[np.ndarray, " 2"], box: Box) -> UInt8[np.ndarray, "H W"] | None:
        """How far occluders in front of a point of the floor cover a box, 0 to 255; None if none does."""
        hidden = None
        for cover in self._covers:
            shared = clip(box, cover.box)
            if is_empty(shared) or not cover.occluder.may_hide(point, self._camera.center[:2]):
                continue
            if hidden is None:
                hidden = np.zeros((box[3] - box[1], box[2] - box[0]), np.uint8)
            part = _part(hidden, shared, box)
            part[...] = np.maximum(part, _part(cover.coverage, shared, cover.box))
        return hidden


def _part(image: UInt8[np.ndarray, "..."], box: Box, of: Box = (0, 0, 0, 0)) -> UInt8[np.ndarray, "..."]:
    """The view of a box in an image that shows the picture from the first corner of another box on."""
    return image[box[1] - of[1] : box[3] - of[1], box[0] - of[0] : box[2] - of[0]]


def _falloff(camera: Camera) -> Float[np.ndarray, "H W"]:
    """The light that reaches every pixel through the lens: less towards the corners."""
    across = np.linspace(-1, 1, camera.width_px, dtype=np.float32)
    down = np.linspace(-1, 1, camera.height_px, dtype=np.float32)
    return 1 - _FALLOFF / 2 * (down[:, None] ** 2 + across**2)
