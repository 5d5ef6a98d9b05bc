"""The target: the space that it moves in, its size, its start, and the box that it fills in a picture."""

from typing import Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, PositiveFloat, model_validator

from network.options import Options
from nodes.camera import Camera

MIN_ASPECT = 0.8
"""Least height of a box in widths: what is left of a person seen from straight above."""
_TRUNK_ASPECT = np.array([1.0, MIN_ASPECT])


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
    if target.size_px is not None:
        middle, half = np.add(positions.T, 0.5, order="C"), 0.5 * np.array(target.size_px)[:, None]
        return np.concatenate((middle - half, middle + half)).T
    n, n_axes = positions.shape
    body = np.empty((3, 2, n))
    body[:n_axes] = positions.T[:, None]
    foot, head = body[2]
    if target.space == "plane":
        foot[:] = target.plane_height
    else:
        foot -= target.height / 2
    np.add(foot, target.height, out=head)
    pixels, depths = camera.project(body.reshape(3, 2 * n).T)
    low, high = pixels.T[:, :n], pixels.T[:, n:]
    middle = (low + high) / 2 + 0.5
    # A slanted or rolled view shortens the body but not its thickness: a box is at least as wide as it,
    # and nearly as high.
    trunk = 0.5 * camera.K[0, 0] * target.width / np.maximum((depths[:n] + depths[n:]) / 2, 1e-6)
    half = np.maximum(0.5 * np.abs(low - high), trunk * _TRUNK_ASPECT[:, None])
    boxes = np.concatenate((middle - half, middle + half))
    np.copyto(boxes, np.nan, where=~(half[1] > 1.0))
    return boxes.T


def visible_fraction(boxes: Float[np.ndarray, "N 4"], camera: Camera) -> Float[np.ndarray, " N"]:
    """The part of each box that lies inside the picture, 0 to 1."""
    low, high = boxes.T[:2], boxes.T[2:]
    size_px = np.array([[camera.width_px], [camera.height_px]])
    width, height = np.maximum(np.minimum(high, size_px) - np.maximum(low, 0.0), 0.0)
    whole_width, whole_height = high - low
    fraction = width * height / (whole_width * whole_height)
    return np.fmax(fraction, 0.0)  # of a box that cannot be pictured, NaN, nothing
