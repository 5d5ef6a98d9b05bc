"""The target: the space that it moves in, its size, its start, and the box that it fills in a picture."""

from functools import lru_cache
from typing import Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, PositiveFloat, model_validator

from network.options import Options
from nodes.imaging.camera import Camera

MIN_ASPECT = 0.8
"""Least height of a box in widths: what is left of a person seen from straight above."""
MIN_HEIGHT_PX = 2.0
"""Height below which a box shows nothing."""


class StartOptions(Options):
    """What every filter is told about the target at frame 0.

    In m and m/s; in the image plane in px and px/s.
    """

    position: tuple[float, ...] | Literal["truth"] = "truth"
    """Where the target is at frame 0, or `truth`: where the ground truth has it."""
    position_error: float = Field(default=0.05, ge=0)
    """Standard deviation of the error that the seed adds to that position, on each axis."""
    velocity: tuple[float, ...] = (0.0, 0.0)
    """Velocity at frame 0, one number an axis."""
    position_deviation: float = Field(default=0.1, gt=0)
    """Standard deviation of the first particles' positions."""
    velocity_deviation: float = Field(default=0.15, gt=0)
    """Standard deviation of the first particles' velocities."""


class TargetOptions(Options):
    """What is tracked."""

    space: Literal["plane", "volume", "image"] = "plane"
    """`plane`: on a horizontal plane, state [x, y, vx, vy]; `volume`: [x, y, z, vx, vy, vz]; `image`: in the
    pixels of one camera, [x, y, vx, vy]. Autoregressive dynamics have the last position for the velocity."""
    person: str | None = None
    """Name of the person in the world that is the target; not needed for footage."""
    object: str | None = None
    """Name of the object in the world that is the target, instead of a person."""
    part: Literal["body", "head"] = "body"
    """What of a person is the target, in a volume or in the image plane."""
    plane_height: float = 0.0
    """Height of the plane above the floor, in m; the target stands on it (people's feet: 0)."""
    height: float = Field(default=1.75, gt=0)
    """Height of the target, in m."""
    width: float = Field(default=0.4, gt=0)
    """Width of the target, in m; of a person the trunk, so that boxes show more of them than of the room."""
    size_px: tuple[PositiveFloat, PositiveFloat] | None = None
    """Width and height of the target's box in the image plane, in px, in place of the two in m."""
    start: StartOptions = StartOptions()
    """The target at frame 0."""

    @model_validator(mode="after")
    def _size_in_the_spaces_unit(self) -> "TargetOptions":
        if self.space != "image":
            if self.size_px is not None:
                raise ValueError(
                    "size_px is for the image plane: on a plane or in a volume give height and width, in m"
                )
            return self
        if self.size_px is None:
            raise ValueError("the image plane needs size_px, the target's width and height in pixels: add it")
        fields = type(self).model_fields
        for key in ("height", "width", "plane_height"):
            if getattr(self, key) != fields[key].default:
                raise ValueError(f"{key} is in m and means nothing in the image plane: give size_px instead")
        return self

    @property
    def n_axes(self) -> int:
        """Axes of the position: 3 in a volume, else 2."""
        return 3 if self.space == "volume" else 2

    @property
    def subject(self) -> str:
        """Name of the person or object in the world that is the target; empty for footage."""
        return self.person or self.object or ""

    @property
    def unit(self) -> Literal["m", "px"]:
        """The unit of the position."""
        return "px" if self.space == "image" else "m"


def project_boxes(
    positions: Float[np.ndarray, "N A"], target: TargetOptions, camera: Camera
) -> Float[np.ndarray, "N 4"]:
    """The box that the target would fill in a camera's picture at each position.

    A box of fixed size would cost a factor of two in accuracy: the size in metres is projected, the height
    from foot to head and the width at the depth between them. In the image plane nothing tells how far away
    the target is, and its box has one size.

    Args:
        positions: Foot points on the plane (2 axes) or centres in the volume (3 axes), metres; or centres in
            the picture, pixels, (0, 0) being the middle of the top left one.
        target: Space and size.
        camera: The camera.

    Returns:
        left, top, right, bottom in pixels, pixel edges at whole numbers; NaN where the target cannot be
        pictured from there, or would be less than two pixels high.
    """
    # One row a coordinate, and the boxes' sides likewise: NumPy is quick along the long axis only.
    n = len(positions)
    sides = np.empty((2, 2, n))
    if target.size_px is not None:
        np.add(positions.T, _sides(*target.size_px), out=sides)
        return sides.reshape(4, n).T
    low = target.plane_height if target.space == "plane" else -target.height / 2
    ends, depth = camera.project_uprights(positions, low, low + target.height)
    # A slanted or rolled view shortens the body but not its thickness: a box is at least as wide as it,
    # and nearly as high.
    size = ends[:, 0] - ends[:, 1]
    np.abs(size, out=size)
    np.maximum(size, _trunk_px(target.width, camera) / depth, out=size)
    twice_middle = ends[:, 0] + ends[:, 1]
    twice_middle += 1
    np.subtract(twice_middle, size, out=sides[0])
    np.add(twice_middle, size, out=sides[1])
    sides *= 0.5
    boxes = sides.reshape(4, n)
    if not np.minimum.reduce(size[1], initial=np.inf) > MIN_HEIGHT_PX:  # also where one is NaN
        boxes[:, ~(size[1] > MIN_HEIGHT_PX)] = np.nan
    return boxes.T


@lru_cache
def _sides(width: float, height: float) -> Float[np.ndarray, "2 2 1"]:
    """From the middle of a pixel to the sides of a box around it: left and top, right and bottom."""
    half = _column(width / 2, height / 2)
    return np.stack([0.5 - half, 0.5 + half])


@lru_cache(maxsize=8)  # what most frames ask for
def _wholly(n: int) -> Float[np.ndarray, " N"]:
    """That each of n boxes is in the picture; not to be written to."""
    ones = np.ones(n)
    ones.setflags(write=False)
    return ones


@lru_cache
def _trunk_px(width: float, camera: Camera) -> Float[np.ndarray, "2 1"]:
    """Least width and height of a box, in px at a depth of 1 m."""
    return camera.K[0, 0] * _column(width, MIN_ASPECT * width)


@lru_cache
def _column(x: float, y: float) -> Float[np.ndarray, "2 1"]:
    return np.array([[x], [y]])


def visible_fraction(boxes: Float[np.ndarray, "N 4"], camera: Camera) -> Float[np.ndarray, " N"]:
    """The part of each box that lies inside the picture, 0 to 1; boxes have an area, or are NaN."""
    low, high = boxes.T[:2], boxes.T[2:]
    # mostly all of all of them
    right, bottom = np.maximum.reduce(high, axis=1, initial=0.0).tolist()
    within = right <= camera.width_px and bottom <= camera.height_px
    if within and np.minimum.reduce(low, axis=None, initial=0.0) >= 0:
        return _wholly(len(boxes))
    inside = np.minimum(high, _column(float(camera.width_px), float(camera.height_px)))
    inside -= np.maximum(low, 0.0)
    np.maximum(inside, 0.0, out=inside)
    whole = high - low
    fraction = inside[0] * inside[1]
    fraction /= whole[0] * whole[1]
    return np.fmax(fraction, 0.0, out=fraction)  # of a box that cannot be pictured, NaN, nothing
