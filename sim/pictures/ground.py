"""The ground seen from above, in metres: what of it is shown, who sees it, and where a filter is unsure.

Pure geometry; the pictures on the screen and the figures on paper draw what is worked out here.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Int

from nodes.imaging.camera import Camera
from sim.assembly import Assembly
from sim.results.results import Results

_MARGIN = 0.08  # of the larger side, around what must be seen
_RIM_STEPS = 16  # corners along each side of a picture, whose rim a lens may bend
_ELLIPSE = np.linspace(0.0, 2 * np.pi, 48, endpoint=False)


@dataclass(frozen=True, slots=True, eq=False)
class Area:
    """A rectangle of the ground.

    Attributes:
        low: Its smallest x and y, metres.
        high: Its largest.
    """

    low: Float[np.ndarray, " 2"]
    high: Float[np.ndarray, " 2"]

    @property
    def size(self) -> Float[np.ndarray, " 2"]:
        """Extent along x and y, metres."""
        return self.high - self.low

    def widened(self, aspect: float) -> "Area":
        """The smallest area with the same middle, width to height as asked, that holds this one."""
        width, height = self.size
        half = 0.5 * np.array([max(width, height * aspect), max(height, width / aspect)])
        middle = 0.5 * (self.low + self.high)
        return Area(middle - half, middle + half)


def area_of(results: Results, assembly: Assembly) -> Area:
    """The ground that holds all cameras and the target's path: the truth, or else the estimates."""
    truth = results.true_states()
    fused = [track for track in results.tracks if track[0] != "single"]
    paths = [truth] if truth is not None else [results.means(track) for track in fused]
    cameras = np.array([camera.center[:2] for camera in assembly.cameras.values()])
    points = np.concatenate([cameras, assembly.start.mean[None, :2], *(path[:, :2] for path in paths)])
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    margin = _MARGIN * max(float((high - low).max()), 1.0)
    return Area(low - margin, high + margin)


def coverage(
    cameras: Iterable[Camera], x: Float[np.ndarray, " X"], y: Float[np.ndarray, " Y"], z: float
) -> Int[np.ndarray, "Y X"]:
    """How many cameras have each point of a horizontal grid in their picture, whatever stands between.

    Args:
        cameras: The cameras.
        x: The grid's columns, metres.
        y: Its rows, metres.
        z: Its height above the floor, metres.
    """
    columns, rows = np.meshgrid(x, y)
    points = np.column_stack([columns.ravel(), rows.ravel(), np.full(columns.size, z)])
    seen = np.zeros(columns.size, dtype=np.int64)
    for camera in cameras:
        seen += camera.contains(camera.project(points)[0])
    return seen.reshape(columns.shape)


def field_of_view(camera: Camera, z: float, reach: float) -> Float[np.ndarray, "N 2"]:
    """The rim of what a camera sees of a horizontal plane, whatever stands between.

    Args:
        camera: The camera.
        z: Height of the plane above the floor, metres.
        reach: Distance from the camera, metres across the ground, beyond which nothing is drawn.

    Returns:
        Corners in turn, metres.
    """
    # rays through the picture's rim: d_world = Rᵀ K⁻¹ [u, v, 1] without the lens's distortion
    edge = np.linspace(0.0, 1.0, _RIM_STEPS, endpoint=False)
    zero, one = np.zeros_like(edge), np.ones_like(edge)
    rim = np.concatenate(
        [np.stack(side, 1) for side in ((edge, zero), (one, edge), (1 - edge, one), (zero, 1 - edge))]
    )
    pixels = rim * [camera.width_px, camera.height_px] - 0.5
    rays = cv2.undistortPoints(pixels[:, None], camera.K, camera.distortion)[:, 0]
    across = np.column_stack([rays, np.ones(len(rays))]) @ camera.R
    # where a ray meets the plane, or the end of the reach if that comes first
    with np.errstate(divide="ignore"):
        to_plane = (z - camera.center[2]) / across[:, 2]
        to_reach = reach / np.linalg.norm(across[:, :2], axis=1)
    along = np.where(to_plane > 0, np.minimum(to_plane, to_reach), to_reach)
    return camera.center[:2] + along[:, None] * across[:, :2]


def height_of_target(results: Results, assembly: Assembly) -> float:
    """Height of the target's middle above the floor, metres, in the mean of the run."""
    target, truth = assembly.scenario.target, results.true_states()
    if target.space == "plane":
        return target.plane_height + target.height / 2
    return float(assembly.start.mean[2] if truth is None else np.nanmean(truth[:, 2]))


def ellipse(
    mean: Float[np.ndarray, " 2"], covariance: Float[np.ndarray, "2 2"], deviations: float = 2.0
) -> Float[np.ndarray, "48 2"]:
    """Points at so many standard deviations around a Gaussian's mean, in turn."""
    # x = mean + c E sqrt(d) [cos t, sin t]ᵀ with covariance = E diag(d) Eᵀ; a rounding error may make d < 0
    d, E = np.linalg.eigh(covariance)
    circle = np.stack([np.cos(_ELLIPSE), np.sin(_ELLIPSE)])
    return mean + deviations * ((E * np.sqrt(np.maximum(d, 0.0))) @ circle).T


def heading(camera: Camera) -> Float[np.ndarray, " 2"]:
    """The direction across the floor in which a camera looks, of length 1.

    If it looks straight down or up, the direction of its picture's top.
    """
    across = camera.R[2, :2]
    if np.linalg.norm(across) < 1e-6:
        across = -camera.R[1, :2]
    return across / np.linalg.norm(across)
