"""A camera without pictures: where it takes the target to be, and how sure that is.

A detector finds the target's middle in the picture with an error of some pixels. What that says about the
place on the ground (or in space) follows from the camera's geometry: with A the derivative of the pixel by
the position, information AᵀA / σ². So noise grows with the distance, and along the line of sight most.

Lenses are left out: the picture of a camera is its pinhole's.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from nodes.filtering.gaussian import Information
from nodes.imaging.camera import Camera
from sim.scenario.sensor import SensorOptions


@dataclass(frozen=True, slots=True, eq=False)
class Sensors:
    """Many cameras at once.

    Attributes:
        K: Their intrinsic matrices, in pixels.
        R: Their rotations.
        t: Their translations, in m.
        size_px: Widths and heights.
    """

    K: Float[np.ndarray, "C 3 3"]
    R: Float[np.ndarray, "C 3 3"]
    t: Float[np.ndarray, "C 3"]
    size_px: Float[np.ndarray, "C 2"]

    @staticmethod
    def of(cameras: Sequence[Camera]) -> "Sensors":
        """Those of calibrated cameras."""
        return Sensors(
            np.array([camera.K for camera in cameras]),
            np.array([camera.R for camera in cameras]),
            np.array([camera.t for camera in cameras]),
            np.array([(camera.width_px, camera.height_px) for camera in cameras], dtype=float),
        )

    def chosen(self, rows: Int[np.ndarray, " S"]) -> "Sensors":
        """Some of them, in this order."""
        return Sensors(self.K[rows], self.R[rows], self.t[rows], self.size_px[rows])

    def project(
        self, point: Float[np.ndarray, "*T 3"]
    ) -> tuple[Float[np.ndarray, "*T C 2"], Float[np.ndarray, "*T C 3"]]:
        """A point of the world in all pictures, frame by frame: pixels, and places in camera axes in m."""
        places = np.matvec(self.R, point[..., None, :]) + self.t
        # (u, v, 1) z = K x
        homogeneous = np.matvec(self.K, places)
        with np.errstate(divide="ignore", invalid="ignore"):
            return homogeneous[..., :2] / homogeneous[..., 2:], places

    def derivatives(self, places: Float[np.ndarray, "C 3"]) -> Float[np.ndarray, "C 2 3"]:
        """Of the pixels by the position in the world, at places in camera axes, px/m."""
        x, y, z = places.T[:, :, None]
        # d(x/z) = (r₁ - (x/z) r₃) / z
        slopes = np.stack([self.R[:, 0] - x / z * self.R[:, 2], self.R[:, 1] - y / z * self.R[:, 2]], axis=1)
        return self.K[:, :2, :2] @ slopes / z[:, :, None]

    def in_view(
        self, pixels: Float[np.ndarray, "*T C 2"], places: Float[np.ndarray, "*T C 3"], range_m: float
    ) -> Bool[np.ndarray, "*T C"]:
        """Which cameras have a point in their picture, in front of them and near enough."""
        with np.errstate(invalid="ignore"):
            inside = ((pixels >= -0.5) & (pixels < self.size_px - 0.5)).all(axis=-1)
        return inside & (places[..., 2] > 0) & (np.linalg.norm(places, axis=-1) <= range_m)


def measure(
    sensors: Sensors,
    middle: Float[np.ndarray, "*T 3"],
    n_axes: int,
    options: SensorOptions,
    luck: Float[np.ndarray, "*T C"],
    noise: Float[np.ndarray, "*T C 2"],
) -> tuple[Information, Bool[np.ndarray, "*T C"]]:
    """What all cameras say about the target's position; exactly nothing where they do not see it.

    Args:
        sensors: The cameras.
        middle: The target's true middle, in m; of one frame or of many.
        n_axes: Axes of the position: 2 on a plane, 3 in a volume.
        options: The sensor.
        luck: Uniform draws from [0, 1), which decide about occlusion.
        noise: Standard normal draws.

    Returns:
        Information about the position, and who saw the target.
    """
    pixels, places = sensors.project(middle)
    seen = sensors.in_view(pixels, places, options.range_m) & (luck >= options.occlusion)
    # the rest is for those few
    cameras = np.nonzero(seen)[-1]
    x = np.broadcast_to(middle[..., None, :n_axes], (*seen.shape, n_axes))[seen]
    # A / σ
    A = sensors.chosen(cameras).derivatives(places[seen])[:, :, :n_axes] / options.noise_px
    # Λ = AᵀA / σ², η = Λ x + Aᵀ e / σ
    matrix, vector = np.zeros((*seen.shape, n_axes, n_axes)), np.zeros((*seen.shape, n_axes))
    matrix[seen] = A.swapaxes(1, 2) @ A
    vector[seen] = np.matvec(matrix[seen], x) + np.matvec(A.swapaxes(1, 2), noise[seen])
    return Information(matrix, vector), seen
