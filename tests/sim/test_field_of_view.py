"""Fields of view on the ground: inside of the rim the camera sees the plane, outside it does not."""

import cv2
import numpy as np
import pytest

from nodes.imaging.camera import Camera, look_at
from sim.pictures.ground import field_of_view

CAMERAS = [
    look_at("level", np.array([1.0, -2.0, 2.5]), np.array([3.0, 6.0, 1.0]), 300.0, (320, 240), np.zeros(5)),
    look_at("steep", np.array([0.0, 0.0, 3.0]), np.array([0.5, 1.0, 0.0]), 200.0, (320, 240), np.zeros(5)),
    look_at(
        "barrel", np.array([0.0, 0.0, 2.5]), np.array([5.0, 2.0, 0.5]), 250.0, (320, 240),
        np.array([-0.15, 0.02, 0.0, 0.0, 0.0]),
    ),
]  # fmt: skip


@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: camera.name)
def test_the_rim_parts_what_is_seen_from_what_is_not(camera: Camera):
    reach, z = 12.0, 0.4
    rim = field_of_view(camera, z, reach)
    points = np.random.default_rng(0).uniform(-reach, reach, (4000, 2)) + camera.center[:2]
    near = np.linalg.norm(points - camera.center[:2], axis=1) < 0.9 * reach
    seen = camera.contains(camera.project(np.column_stack([points, np.full(len(points), z)]))[0])
    corners = rim.astype(np.float32)
    inside = np.array([cv2.pointPolygonTest(corners, tuple(p), measureDist=True) for p in points])
    clear = near & (np.abs(inside) > 0.15)  # the rim is drawn by straight pieces
    np.testing.assert_array_equal(seen[clear], inside[clear] > 0)
    assert seen[clear].any()
    assert np.linalg.norm(rim - camera.center[:2], axis=1).max() <= reach * (1 + 1e-9)
