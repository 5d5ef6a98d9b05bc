"""The simulated world: who is where, at any time. Metres, seconds, z up, the floor at z = 0."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from network.options import Options
from network.streams import stream
from sim.world.curves import Curve
from sim.world.floor import FloorOptions
from sim.world.interior import Interior, draw_interior
from sim.world.light import LightingOptions, build_light
from sim.world.occluders import Occluder, OccluderOptions, build_occluder
from sim.world.people import Person, PersonOptions, build_person
from sim.world.room import RoomOptions
from sim.world.walls import WallsOptions


class WorldOptions(Options):
    """A simulated world, in metres and seconds; z points up, the floor is at z = 0."""

    people: tuple[PersonOptions, ...] = ()
    """Who walks about."""
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
        names = [person.name for person in self.people]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"{names.count(name)} people are called {name}: give each their own name")
        return self


@dataclass(frozen=True, eq=False)
class World:
    """Everything that the cameras look at.

    Attributes:
        options: What the world was built from.
        seed: The run's seed.
        people: Who walks about.
        occluders: What hides them.
        light: Brightness and colour temperature over time.
    """

    options: WorldOptions
    seed: int
    people: tuple[Person, ...]
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
        occluders=tuple(build_occluder(each) for each in options.occluders),
        light=build_light(options.lighting),
    )
