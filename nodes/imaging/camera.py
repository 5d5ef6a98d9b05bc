"""Pinhole cameras with lens distortion: everything about projecting the world into pixels.

The model and its names are OpenCV's (Brown-Conrady distortion): x_camera = R x_world + t, pixels =
K distort(x/z), with pixel (0, 0) at the centre of the top left pixel.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Bool, Float

MIN_DEPTH = 1e-6
"""Depth along the optical axis from which a point is before the camera, in m."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A calibrated camera.

    Attributes:
        name: The name of the camera and of the node that carries it.
        width_px: Width of its pictures.
        height_px: Height of its pictures.
        K: Intrinsic matrix, in pixels.
        R: Rotation from world axes to camera axes (x right, y down, z forward).
        t: Translation in metres; the camera's centre is -Rᵀ t.
        distortion: k1, k2, p1, p2, k3, in OpenCV's order.
    """

    name: str
    width_px: int
    height_px: int
    K: Float[np.ndarray, "3 3"]
    R: Float[np.ndarray, "3 3"]
    t: Float[np.ndarray, " 3"]
    distortion: Float[np.ndarray, " 5"]

    @cached_property
    def center(self) -> Float[np.ndarray, " 3"]:
        """The camera's centre in the world, metres."""
        return -self.R.T @ self.t

    @cached_property
    def _radius2_limit(self) -> float:
        """Squared normalised radius up to which the radial distortion still grows outwards.

        Beyond it the polynomial folds back and would put points from far outside into the picture.
        """
        k1, k2, _, _, k3 = self.distortion
        # d/dr [r (1 + k1 r² + k2 r⁴ + k3 r⁶)] = 0, in r²
        roots = np.roots([7 * k3, 5 * k2, 3 * k1, 1.0])
        real = roots[np.isreal(roots)].real
        return float(real[real > 0].min(initial=np.inf))

    @cached_property
    def _distorts(self) -> bool:
        return bool(self.distortion.any())

    @cached_property
    def projection(self) -> Float[np.ndarray, "3 4"]:
        """K [R | t], from the world to pixels times depth; [R | t] where the lens bends rays before K."""
        extrinsics = np.column_stack([self.R, self.t])
        return extrinsics if self._distorts else self.K @ extrinsics

    def project(
        self, points: Float[np.ndarray, "N 3"]
    ) -> tuple[Float[np.ndarray, "N 2"], Float[np.ndarray, " N"]]:
        """Projects points of the world.

        Args:
            points: World positions in metres.

        Returns:
            Pixel coordinates, NaN for points that no lens of this kind can picture (behind the camera, or
            beyond the radius where the distortion folds), and depths along the optical axis in metres.
        """
        pixels, depth = self._picture(self.projection[:, :3] @ points.T + self.projection[:, 3:])
        return pixels.T, depth

    def project_uprights(
        self, positions: Float[np.ndarray, "N A"], low: float, high: float
    ) -> tuple[Float[np.ndarray, "2 2 N"], Float[np.ndarray, " N"]]:
        """Projects both ends of upright lines, as `project` would.

        Args:
            positions: Places of the lines, (x, y) or (x, y, z) in metres.
            low: Height of the lower end above each place, or above the floor.
            high: Height of the upper end.

        Returns:
            Pixel coordinates, x and y of the lower ends and of the upper ones, and the middles' depths, those
            behind the camera brought before it.
        """
        matrix, offset = _uprights(self, positions.shape[1], low, high)
        seen = matrix @ positions.T
        seen += offset
        pixels, _ = self._picture(seen[:6].reshape(3, 2, -1))
        return pixels, np.maximum(seen[6], MIN_DEPTH)

    def _picture(
        self, seen: Float[np.ndarray, "3 ..."]
    ) -> tuple[Float[np.ndarray, "2 ..."], Float[np.ndarray, "..."]]:
        """Pixels and depths of what `projection` makes of points."""
        depth = seen[2]
        if np.minimum.reduce(depth, axis=None, initial=np.inf) > MIN_DEPTH:
            pixels = seen[:2] / depth
        else:  # also where one is NaN
            pixels = seen[:2] / np.where(depth > MIN_DEPTH, depth, np.nan)
        return (self._distorted(pixels) if self._distorts else pixels), depth

    def _distorted(self, rays: Float[np.ndarray, "2 ..."]) -> Float[np.ndarray, "2 ..."]:
        """From rays x/z, y/z to pixels."""
        k1, k2, p1, p2, k3 = self.distortion
        x, y = rays
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        x, y = (
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        )
        # u = f_x x + s y + c_x, v = f_y y + c_y
        (f_x, s, c_x), (_, f_y, c_y), _ = self.K.tolist()
        pixels = np.stack((f_x * x + s * y + c_x, f_y * y + c_y))
        return np.where(r2 < self._radius2_limit, pixels, np.nan)

    def contains(self, pixels: Float[np.ndarray, "N 2"]) -> Bool[np.ndarray, " N"]:
        """Which pixel coordinates lie inside the picture."""
        u, v = pixels.T
        with np.errstate(invalid="ignore"):
            return (u >= -0.5) & (u < self.width_px - 0.5) & (v >= -0.5) & (v < self.height_px - 0.5)


@lru_cache
def _uprights(
    camera: Camera, n_axes: int, low: float, high: float
) -> tuple[Float[np.ndarray, "7 A"], Float[np.ndarray, "7 1"]]:
    """What `projection` makes of both ends of upright lines: x, y and z of each, and z of their middles.

    P [x y z + h 1] = P [x y z 0] + (p₄ + h p₃), and x and y alone are a place on the floor.
    """
    rows = camera.projection[[0, 0, 1, 1, 2, 2, 2]]
    heights = np.array([low, high] * 3 + [(low + high) / 2])
    return rows[:, :n_axes], (rows[:, 3] + heights * rows[:, 2])[:, None]


def look_at(
    name: str,
    position: Float[np.ndarray, " 3"],
    target: Float[np.ndarray, " 3"],
    focal_px: float,
    size_px: tuple[int, int],
    distortion: Float[np.ndarray, " 5"],
) -> Camera:
    """A level camera at a position that looks at a point.

    Args:
        name: The camera's name.
        position: Its centre in the world, metres.
        target: A point on its optical axis, metres.
        focal_px: Focal length.
        size_px: Width and height of its pictures.
        distortion: k1, k2, p1, p2, k3.

    Raises:
        ValueError: The two points are on one plumb line, so that no side is up.
    """
    forward = target - position
    right = np.cross(forward, [0.0, 0.0, 1.0])
    if np.linalg.norm(right) < 1e-9 * max(1.0, float(np.linalg.norm(forward))):
        raise ValueError(
            f"camera {name} looks straight up or down from {position.tolist()} to {target.tolist()}:"
            " move one of them"
        )
    forward = forward / np.linalg.norm(forward)
    right = right / np.linalg.norm(right)
    R = np.stack([right, np.cross(forward, right), forward])
    width, height = size_px
    K = np.array([[focal_px, 0, (width - 1) / 2], [0, focal_px, (height - 1) / 2], [0, 0, 1.0]])
    return Camera(name, width, height, K, R, -R @ position, distortion)
