"""The simulated world: who is where, at any time. Metres, seconds, z up, the floor at z = 0."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from network.options import Options
from network.streams import stream
from sim.world.curves import Curve
from sim.world.figure import HEAD_MIDDLE
from sim.world.floor import FloorOptions
from sim.world.interior import Interior, draw_interior
from sim.world.light import LightingOptions, build_light
from sim.world.objects import ObjectOptions, Prop, build_object
from sim.world.occluders import Occluder, OccluderOptions, build_occluder
from sim.world.people import Person, PersonOptions, build_person
from sim.world.room import RoomOptions
from sim.world.walls import WallsOptions

Part = Literal["body", "head"]
"""What of a person is meant; an object is one part."""


class WorldOptions(Options):
    """A simulated world, in metres and seconds; z points up, the floor is at z = 0."""

    people: tuple[PersonOptions, ...] = ()
    """Who walks about."""
    objects: tuple[ObjectOptions, ...] = ()
    """What else stands or moves about."""
    occluders: tuple[OccluderOptions, ...] = ()
    """What stands or hangs between them and the cameras."""
    lighting: LightingOptions = LightingOptions()
    """How the light changes, and how cameras differ."""
    noise: Annotated[float, Field(ge=0, le=64)] = 3.0
    """Standard deviation of the sensors' noise, grey levels."""
    room: RoomOptions = RoomOptions()
    """The room's extent."""
    floor: FloorOptions = FloorOptions()
    """The room's floor."""
    walls: WallsOptions = WallsOptions()
    """The room's walls."""

    @model_validator(mode="after")
    def _names_differ(self) -> "WorldOptions":
        names = [person.name for person in self.people] + [each.name for each in self.objects]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(
                    f"{names.count(name)} people or objects are called {name}: give each a name of its own"
                )
        return self

    @model_validator(mode="after")
    def _objects_are_attached_to_what_is_there(self) -> "WorldOptions":
        known = [person.name for person in self.people]
        for each in self.objects:
            if each.attached_to is not None and each.attached_to not in known:
                raise ValueError(
                    f"object {each.name} is attached_to {each.attached_to}, who is neither a person nor an"
                    f" object listed before: name one of {', '.join(known) or 'these, once there are any'}"
                )
            known.append(each.name)
        return self


@dataclass(frozen=True, eq=False)
class World:
    """Everything that the cameras look at.

    Attributes:
        options: What the world was built from.
        seed: The run's seed.
        people: Who walks about.
        objects: What else stands or moves about.
        occluders: What hides them.
        light: Brightness and colour temperature over time.
    """

    options: WorldOptions
    seed: int
    people: tuple[Person, ...]
    objects: tuple[Prop, ...]
    occluders: tuple[Occluder, ...]
    light: Curve

    def person(self, name: str) -> Person:
        """Somebody by their name.

        Raises:
            ValueError: Nobody is called so.
        """
        for person in self.people:
            if person.name == name:
                return person
        known = ", ".join(person.name for person in self.people) or "nobody"
        raise ValueError(f"nobody in world.people is called {name}: there is {known}")

    def underside(self, name: str, time_s: float) -> Float[np.ndarray, "2 3"]:
        """Where somebody or something stands, and how fast that moves.

        Args:
            name: Of a person or an object.
            time_s: When, seconds since the run's first frame.

        Returns:
            The point on the floor below a person, or the middle of an object's underside, metres; and its
            velocity, metres a second.

        Raises:
            ValueError: Nothing and nobody is called so.
        """
        prop = next((each for each in self.objects if each.name == name), None)
        if prop is None:
            person = self.person(name)
            return np.array([[*person.position_at(time_s), 0.0], [*person.velocity_at(time_s), 0.0]])
        own = np.array(
            [
                prop.path.at(time_s) + prop.wander.at(time_s),
                prop.path.derivative_at(time_s) + prop.wander.derivative_at(time_s),
            ]
        )
        return own if prop.attached_to is None else own + self.underside(prop.attached_to, time_s)

    def middle(self, name: str, part: Part, time_s: float) -> Float[np.ndarray, "2 3"]:
        """The middle of an object, or of a person's body or head, and its velocity, as in `underside`."""
        prop = next((each for each in self.objects if each.name == name), None)
        if prop is None:
            share = HEAD_MIDDLE if part == "head" else 0.5
            tall = self.person(name).height
            rise = share * np.array([tall.at(time_s)[0], tall.derivative_at(time_s)[0]])
        else:
            rise = np.array([prop.height / 2, 0.0])
        moved = self.underside(name, time_s)
        moved[:, 2] += rise
        return moved

    def position(self, name: str, time_s: float) -> Float[np.ndarray, " 2"]:
        """Point on the floor below a person, metres."""
        return self.person(name).position_at(time_s)

    def velocity(self, name: str, time_s: float) -> Float[np.ndarray, " 2"]:
        """Velocity of a person across the floor, metres a second."""
        return self.person(name).velocity_at(time_s)

    def height(self, name: str, time_s: float) -> float:
        """Floor to top of a person's head, metres."""
        return self.person(name).height_at(time_s)

    @cached_property
    def interior(self) -> Interior:
        """The inside of the room; drawn once, at the first look."""
        options = self.options
        standing = [occluder.footprint for occluder in self.occluders if occluder.on_floor]
        rng = stream(self.seed, "world", "room")
        return draw_interior(options.room, options.floor, options.walls, standing, rng)


def build_world(options: WorldOptions, seed: int) -> World:
    """The world that the options and the run's seed describe."""
    return World(
        options=options,
        seed=seed,
        people=tuple(build_person(each, seed) for each in options.people),
        objects=tuple(build_object(each, seed) for each in options.objects),
        occluders=tuple(build_occluder(each) for each in options.occluders),
        light=build_light(options.lighting),
    )
