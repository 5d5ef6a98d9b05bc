"""Objects: cups, arms and other round things that stand, are carried, or move on a path of their own."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field, field_validator

from network.options import Options
from network.streams import stream
from sim.world.colors import Color, bgr
from sim.world.curves import Curve, Wander, curve, require_increasing, wander
from sim.world.mesh import Solids

_N_SIDES = 24  # enough for a cup held before a camera; an even number

Metres = Annotated[float, Field(allow_inf_nan=False)]
Radius = Annotated[float, Field(gt=0, le=2)]


class PlaceOptions(Options):
    """Where an object is at a time."""

    time_s: Metres
    """Seconds since the run's first frame."""
    position: tuple[Metres, Metres, Metres]
    """x, y and z of the middle of its underside, metres; from whom it is `attached_to`, if anybody."""


class ObjectOptions(Options):
    """An upright round object that is wider at one end: a cup, a bottle, a forearm."""

    name: Annotated[str, Field(min_length=1)]
    """How scenario and truth call it."""
    path: Annotated[tuple[PlaceOptions, ...], Field(min_length=1)]
    """Places in order of time, joined by a smooth curve; before the first and after the last it stands
    still."""
    attached_to: str | None = None
    """Person, or object listed before, that it moves with: its path is relative to theirs."""
    wander: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    """Standard deviation of a smooth random deviation from the path along each axis, metres; it depends on
    the seed."""
    height: Annotated[float, Field(gt=0, le=5)]
    """Underside to top, metres."""
    bottom_radius: Radius
    """Radius at the underside, metres."""
    top_radius: Radius
    """Radius at the top, metres."""
    bands: Annotated[tuple[Color, ...], Field(min_length=1)]
    """Colours of its side in bands of equal height, from the bottom up."""
    inside: Color = "#3a3632"
    """Colour of its upper side, such as the inside of a cup."""

    @field_validator("path")
    @classmethod
    def _in_order(cls, path: tuple[PlaceOptions, ...]) -> tuple[PlaceOptions, ...]:
        require_increasing([keyframe.time_s for keyframe in path])
        return path


@dataclass(frozen=True, slots=True, eq=False)
class Prop:
    """An object of the world.

    Attributes:
        name: Its name.
        path: The middle of its underside, metres.
        wander: Its deviation from that, metres.
        attached_to: Name of whom it moves with, if anybody.
        height: Underside to top, metres.
        radius: Of its underside, metres.
        solid: Its surface, where it stands at the origin.
    """

    name: str
    path: Curve
    wander: Wander
    attached_to: str | None
    height: float
    radius: float
    solid: Solids

    def at(self, position: Float[np.ndarray, " 3"]) -> Solids:
        """Its surface where the middle of its underside is at a position."""
        return Solids(self.solid.vertices + position, self.solid.faces, self.solid.normals, self.solid.colors)


def build_object(options: ObjectOptions, seed: int) -> Prop:
    """An object as the options describe it.

    Args:
        options: Its path, shape and colours.
        seed: The run's seed.
    """
    return Prop(
        name=options.name,
        path=curve([p.time_s for p in options.path], [p.position for p in options.path]),
        wander=wander(options.wander, stream(seed, "world", options.name), n_axes=3),
        attached_to=options.attached_to,
        height=options.height,
        radius=options.bottom_radius,
        solid=_tapered_cylinder(options),
    )


def _tapered_cylinder(options: ObjectOptions) -> Solids:
    """Strips around each band, and the upper side in strips across; nobody looks at it from below."""
    n_bands, n = len(options.bands), _N_SIDES
    up = np.linspace(0.0, 1.0, n_bands + 1)
    radii = options.bottom_radius + up * (options.top_radius - options.bottom_radius)
    angles = 2 * np.pi * np.arange(n) / n
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rings = np.empty((n_bands + 1, n, 3))
    rings[..., :2] = radii[:, None, None] * circle
    rings[..., 2] = options.height * up[:, None]
    # corners run up one edge of a strip and down the next one, clockwise from outside
    number = np.arange(rings.size // 3).reshape(n_bands + 1, n)
    after = np.roll(number, -1, axis=1)
    sides = np.stack([number[:-1], number[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)
    top, k = number[-1], np.arange(n // 2 - 1)
    lid = np.stack([top[k], top[-1 - k], top[-2 - k], top[k + 1]], axis=-1)
    faces = np.concatenate([sides, lid])
    slope = (options.bottom_radius - options.top_radius) / options.height
    middles = angles + np.pi / n
    outward = np.stack([np.cos(middles), np.sin(middles), np.full(n, slope)], axis=1)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    normals = np.concatenate([np.tile(outward, (n_bands, 1)), np.tile([0.0, 0.0, 1.0], (len(lid), 1))])
    bands = np.repeat(np.stack([bgr(color) for color in options.bands]), n, axis=0)
    colors = np.concatenate([bands, np.tile(bgr(options.inside), (len(lid), 1))])
    return Solids(rings.reshape(1, -1, 3), faces, normals[None], colors[None])
