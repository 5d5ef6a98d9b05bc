"""People: where they are, which way they face and how their legs move, at any time."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field, field_validator

from network.options import Options
from network.streams import stream
from sim.world.colors import Color, bgr
from sim.world.curves import Curve, Wander, curve, require_increasing, wander

_TRACK_STEP_S = 0.05  # resolution of heading and distance walked along a path
_TURN_S = 0.5  # a person takes this long to turn round
_SLOW = 0.15  # m/s: below it people keep facing where they faced
_BRISK = 1.2  # m/s: from here on strides have their full length
_STRIDE = 0.8  # two steps, as a fraction of the stature

Metres = Annotated[float, Field(allow_inf_nan=False)]
Height = Annotated[float, Field(gt=0.3, lt=3.0)]


class WaypointOptions(Options):
    """Where a person is at a time."""

    time_s: Metres
    """Seconds since the run's first frame."""
    position: tuple[Metres, Metres]
    """x and y on the floor, metres."""


class HeightOptions(Options):
    """How tall a person is at a time: less than the stature means crouching."""

    time_s: Metres
    """Seconds since the run's first frame."""
    height: Height
    """Floor to top of the head, metres."""


class PersonOptions(Options):
    """A person and the way they walk."""

    name: Annotated[str, Field(min_length=1)]
    """How scenario and truth call this person."""
    path: Annotated[tuple[WaypointOptions, ...], Field(min_length=1)]
    """Waypoints in order of time, joined by a smooth curve; before the first and after the last the person
    stands still."""
    wander: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    """Standard deviation of a smooth random deviation from the path along each axis, metres. It depends on
    the seed, so that no two runs are alike."""
    height: Height | Annotated[tuple[HeightOptions, ...], Field(min_length=1)] = 1.75
    """Floor to top of the head, metres; or a list of heights over time, for a person who crouches."""
    facing: tuple[Metres, Metres] | None = None
    """Point that they keep facing, x and y on the floor, metres; null: they face the way they walk."""
    upper: Color = "#6e6e73"
    """Colour of the upper body's clothes."""
    lower: Color = "#2d2d3c"
    """Colour of trousers."""
    skin: Color = "#cda082"
    """Colour of face and hands."""
    hair: Color = "#322319"
    """Colour of the hair."""

    @field_validator("path", "height")
    @classmethod
    def _in_order(cls, value: object) -> object:
        if isinstance(value, tuple):
            require_increasing([keyframe.time_s for keyframe in value])
        return value


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """How a person stands or walks at one moment.

    Attributes:
        position: Point on the floor below them, metres.
        heading: Direction that they face, radians from +x towards +y.
        phase: Of the gait, radians; one stride is 2π.
        effort: Length of the stride as a fraction of a full one, 0 (standing) to 1.
        height: Floor to top of the head now, metres.
        stature: Their height when upright, metres; it sets their width.
    """

    position: Float[np.ndarray, " 2"]
    heading: float
    phase: float
    effort: float
    height: float
    stature: float


@dataclass(frozen=True, slots=True, eq=False)
class Person:
    """Somebody who walks through the world.

    Attributes:
        name: Their name.
        palette: Colours of skin, hair, upper body, trousers and shoes; blue, green, red, 0 to 255.
        path: Their way across the floor, metres.
        wander: Their deviation from it, metres.
        height: Their height over time, metres.
        stature: Their height when upright, metres.
        track_s: Times at which the two following are known, seconds, evenly spaced.
        headings: Directions faced, radians, unwrapped.
        distances: Distances walked, metres.
    """

    name: str
    palette: Float[np.ndarray, "5 3"]
    path: Curve
    wander: Wander
    height: Curve
    stature: float
    track_s: Float[np.ndarray, " T"]
    headings: Float[np.ndarray, " T"]
    distances: Float[np.ndarray, " T"]

    def position_at(self, time_s: float) -> Float[np.ndarray, " 2"]:
        """Point on the floor below the person, metres."""
        return self.path.at(time_s) + self.wander.at(time_s)

    def velocity_at(self, time_s: float) -> Float[np.ndarray, " 2"]:
        """Derivative of the position, metres a second."""
        return self.path.derivative_at(time_s) + self.wander.derivative_at(time_s)

    def height_at(self, time_s: float) -> float:
        """Floor to top of the head, metres."""
        return float(self.height.at(time_s)[0])

    def pose_at(self, time_s: float) -> Pose:
        """How the person stands or walks."""
        distance = float(np.interp(time_s, self.track_s, self.distances))
        speed = math.hypot(*self.path.derivative_at(time_s).tolist())
        return Pose(
            position=self.position_at(time_s),
            heading=float(np.interp(time_s, self.track_s, self.headings)),
            phase=2 * np.pi * distance / (_STRIDE * self.stature),
            effort=min(1.0, speed / _BRISK),
            height=self.height_at(time_s),
            stature=self.stature,
        )


def build_person(options: PersonOptions, seed: int) -> Person:
    """A person as the options describe them.

    Args:
        options: Their path, size and colours.
        seed: The run's seed.
    """
    path = curve([p.time_s for p in options.path], [p.position for p in options.path])
    heights = (
        options.height
        if isinstance(options.height, tuple)
        else (HeightOptions(time_s=0, height=options.height),)
    )
    lower = bgr(options.lower)
    palette = [bgr(options.skin), bgr(options.hair), bgr(options.upper), lower, 20 + 0.4 * lower]
    rng = stream(seed, "world", options.name)
    track_s, headings, distances = _track(path)
    if options.facing is not None:
        to_point = np.array(options.facing) - [path.at(t) for t in track_s.tolist()]
        headings = np.unwrap(np.arctan2(to_point[:, 1], to_point[:, 0]))
    start = rng.uniform(0.0, _STRIDE * 2)  # so that no two people walk in step
    return Person(
        name=options.name,
        palette=np.stack(palette),
        path=path,
        wander=wander(options.wander, rng),
        height=curve([h.time_s for h in heights], [[h.height] for h in heights]),
        stature=max(h.height for h in heights),
        track_s=track_s,
        headings=headings,
        distances=start + distances,
    )


def _track(path: Curve) -> tuple[Float[np.ndarray, " T"], Float[np.ndarray, " T"], Float[np.ndarray, " T"]]:
    """Times, headings and distances walked along a path."""
    n_steps = int(np.ceil((path.times[-1] - path.times[0]) / _TRACK_STEP_S)) + 1
    track_s = np.linspace(path.times[0], path.times[-1], max(n_steps, 2))
    velocities = np.array([path.derivative_at(time_s) for time_s in track_s.tolist()])
    speeds = np.linalg.norm(velocities, axis=1)
    # who stands still faces where they last walked, or, at the start, where they will walk
    walking = np.flatnonzero(speeds > _SLOW)
    if len(walking):
        last = walking[np.maximum(np.searchsorted(walking, np.arange(len(track_s)), side="right") - 1, 0)]
        headings = np.unwrap(np.arctan2(velocities[last, 1], velocities[last, 0]))
    else:
        headings = np.zeros(len(track_s))
    # people turn round in a moment, not at once
    width = 2 * int(_TURN_S / _TRACK_STEP_S / 2) + 1
    padded = np.pad(headings, width // 2, mode="edge")
    headings = np.convolve(padded, np.full(width, 1 / width), mode="valid")
    steps = np.diff(track_s) * (speeds[1:] + speeds[:-1]) / 2
    return track_s, headings, np.concatenate([[0.0], np.cumsum(steps)])
