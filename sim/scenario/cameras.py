"""The cameras of a scenario: one by one with their calibrations, or as many as one likes by a layout."""

import math
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from jaxtyping import Float
from pydantic import AfterValidator, Field, PositiveInt, model_validator

from network.options import Options
from network.streams import stream
from network.wire.keys import check_name

Name = Annotated[str, AfterValidator(check_name)]
Vector3 = tuple[float, float, float]
GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))
"""Turned by it one after the other, any number of cameras looks in all directions alike."""


class CameraOptions(Options):
    """A calibrated camera: by position and look-at point, by K, R and t, or by a calibration file."""

    name: Name
    """Name of the camera and of its node."""
    size_px: tuple[PositiveInt, PositiveInt] | None = None
    """Width and height of its pictures."""
    position: Vector3 | None = None
    """Its centre, in m, with `look_at` and `focal_px`."""
    look_at: Vector3 | None = None
    """A point on its optical axis, in m; the camera stands level."""
    focal_px: float | None = Field(default=None, gt=0)
    """Focal length."""
    K: tuple[Vector3, Vector3, Vector3] | None = None
    """Intrinsic matrix, in pixels, with `R` and `t`."""
    R: tuple[Vector3, Vector3, Vector3] | None = None
    """Rotation from world axes to the camera's (x right, y down, z forward)."""
    t: Vector3 | None = None
    """Translation, in m; the camera's centre is -Rᵀt."""
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """k1, k2, p1, p2, k3 of the lens, in OpenCV's order."""
    calibration: str | None = None
    """A calibration file instead: OpenCV's YAML, XML or JSON, or Qualisys' `.qca.txt` (by serial = name)."""
    video: str | None = None
    """The camera's video, for footage: a path, relative to the footage's folder."""
    video_sha256: str | None = None
    """What the video must hash to; written into the folder of a run."""

    @model_validator(mode="after")
    def _one_way(self) -> "CameraOptions":
        looks = [self.position, self.look_at, self.focal_px]
        matrices = [self.K, self.R, self.t]
        ways = [any(v is not None for v in way) for way in (looks, matrices)] + [self.calibration is not None]
        if sum(ways) > 1:
            raise ValueError(
                f"camera {self.name} is calibrated in two ways: keep position, look_at and focal_px, or K, R"
                " and t, or calibration"
            )
        if ways[0] and None in looks:
            raise ValueError(f"camera {self.name} needs position, look_at and focal_px: add what lacks")
        if ways[1] and None in matrices:
            raise ValueError(f"camera {self.name} needs K, R and t together: add what lacks")
        if (ways[0] or ways[1]) and self.size_px is None:
            raise ValueError(f"camera {self.name} needs size_px: add it, such as size_px: [640, 480]")
        return self


class CameraLayout(Options):
    """Cameras C1, C2, ... that hang over the floor in place of a list of them."""

    layout: Literal["grid", "random"]
    """`grid`: in rows, as square as their number allows; `random`: anywhere in the same square, from the
    seed."""
    count: int = Field(ge=1, le=100_000)
    """How many there are."""
    spacing_m: float = Field(gt=0)
    """Distance between neighbours of the grid; at random, each has a square of this side on average."""
    center: tuple[float, float] = (0.0, 0.0)
    """Middle of them all, x and y in m."""
    height: float = Field(default=2.9, gt=0)
    """Height at which they hang, in m."""
    ahead_m: float = Field(default=5.0, gt=0)
    """How far ahead of itself a camera's axis meets the floor. Each is turned by the golden angle against the
    one before, so that neighbours look in different directions."""
    focal_px: float = Field(gt=0)
    """Focal length."""
    size_px: tuple[PositiveInt, PositiveInt]
    """Width and height of the pictures."""

    @property
    def names(self) -> tuple[str, ...]:
        """The cameras' names."""
        return tuple(f"C{number}" for number in range(1, self.count + 1))

    def positions(self, seed: int) -> Float[np.ndarray, "C 3"]:
        """Where they hang, in m; at random, one more moves none of the others within the square."""
        columns = math.isqrt(self.count - 1) + 1
        if self.layout == "grid":
            rows = -(-self.count // columns)
            row, column = np.divmod(np.arange(self.count), columns)
            places = np.column_stack([column - (columns - 1) / 2, row - (rows - 1) / 2])
        else:
            side = math.sqrt(self.count)
            places = side * (stream(seed, "layout").random((self.count, 2)) - 0.5)
        floor = np.array(self.center) + self.spacing_m * places
        return np.column_stack([floor, np.full(self.count, self.height)])

    def aims(self, positions: Float[np.ndarray, "C 3"]) -> Float[np.ndarray, "C 3"]:
        """The points on the floor at which cameras at these positions look, in m."""
        headings = GOLDEN_ANGLE * np.arange(self.count)
        ahead = self.ahead_m * np.column_stack([np.cos(headings), np.sin(headings)])
        return np.column_stack([positions[:, :2] + ahead, np.zeros(self.count)])


def _hung(cameras: tuple[CameraOptions, ...] | CameraLayout, seed: int) -> tuple[CameraOptions, ...]:
    """The cameras of a layout, one by one; a list stays as it is."""
    if not isinstance(cameras, CameraLayout):
        return cameras
    positions = cameras.positions(seed)
    return tuple(
        CameraOptions(
            name=name,
            position=position,
            look_at=aim,
            focal_px=cameras.focal_px,
            size_px=cameras.size_px,
        )
        for name, position, aim in zip(
            cameras.names, positions.tolist(), cameras.aims(positions).tolist(), strict=True
        )
    )


if TYPE_CHECKING:
    Cameras = tuple[CameraOptions, ...]
else:
    Cameras = Annotated[
        Annotated[tuple[CameraOptions, ...], Field(min_length=1)] | CameraLayout,
        AfterValidator(lambda cameras, info: _hung(cameras, info.data.get("seed", 0))),
    ]
