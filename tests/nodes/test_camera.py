"""Projection, held against OpenCV's."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.imaging.camera import Camera, look_at

seeds = st.integers(0, 2**32 - 1)


def random_camera(rng, *, distorted=True):
    R = cv2.Rodrigues(rng.normal(size=3))[0]
    K = np.array(
        [[rng.uniform(200, 2000), 0, rng.uniform(200, 500)], [0, rng.uniform(200, 2000), 300.0], [0, 0, 1]]
    )
    distortion = rng.normal(scale=[0.1, 0.05, 0.002, 0.002, 0.01]) if distorted else np.zeros(5)
    return Camera("C1", 640, 480, K, R, rng.normal(size=3), distortion)


def in_world(camera, points):
    """World positions of points given in the camera's own axes."""
    return (points - camera.t) @ camera.R


def by_opencv(camera, points):
    rotation = cv2.Rodrigues(camera.R)[0]
    return cv2.projectPoints(points, rotation, camera.t, camera.K, camera.distortion)[0][:, 0]


@given(seeds, st.booleans())
def test_points_in_front_are_projected_as_by_opencv(seed, distorted):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng, distorted=distorted)
    depth = rng.uniform(0.5, 20, size=30)
    points = in_world(camera, np.stack([*(depth * rng.uniform(-0.4, 0.4, size=(2, 30))), depth], axis=1))
    pixels, depths = camera.project(points)
    pictured = np.isfinite(pixels[:, 0])
    assert distorted or pictured.all()
    np.testing.assert_allclose(pixels[pictured], by_opencv(camera, points)[pictured], atol=1e-6)
    np.testing.assert_allclose(depths, depth, atol=1e-9)


@given(seeds)
def test_points_behind_are_not_pictured(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    points = in_world(camera, np.array([[0.1, 0.2, -3.0], [0.0, 0.0, 0.0], [0.0, 0.0, 4.0]]))
    pixels, _ = camera.project(points)
    assert np.isnan(pixels[:2]).all()
    np.testing.assert_allclose(pixels[2], camera.K[:2, 2])


def test_points_beyond_the_fold_of_the_lens_are_not_pictured():
    K = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]])
    # r (1 - 0.3 r²) grows up to r = sqrt(1 / 0.9) = 1.054 and shrinks beyond.
    camera = Camera("C1", 640, 480, K, np.eye(3), np.zeros(3), np.array([-0.3, 0, 0, 0, 0.0]))
    pixels, _ = camera.project(np.array([[1.05, 0, 1.0], [1.06, 0, 1.0]]))
    assert np.isfinite(pixels[0]).all()
    assert np.isnan(pixels[1]).all()


@given(seeds)
def test_the_centre_of_a_camera_is_at_depth_zero(seed):
    camera = random_camera(np.random.default_rng(seed))
    np.testing.assert_allclose(camera.R @ camera.center + camera.t, 0, atol=1e-12)


@given(seeds)
def test_a_camera_sees_what_it_looks_at_in_the_middle_and_upright(seed):
    rng = np.random.default_rng(seed)
    position, target = rng.uniform(-5, 5, size=(2, 3)) + np.array([[0, 0, 0], [11, 0, 0]])
    camera = look_at("C1", position, target, 500.0, (640, 480), np.zeros(5))
    above = target + np.array([0, 0, 0.1])
    pixels, depths = camera.project(np.stack([target, above]))
    np.testing.assert_allclose(pixels[0], [319.5, 239.5], atol=1e-6)
    np.testing.assert_allclose(pixels[1, 0], 319.5, atol=1e-6)
    assert pixels[1, 1] < pixels[0, 1]
    np.testing.assert_allclose(depths[0], np.linalg.norm(target - position))
    np.testing.assert_allclose(camera.center, position, atol=1e-9)
    np.testing.assert_allclose(camera.R @ camera.R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(camera.R) > 0


def test_a_plumb_line_of_sight_is_refused():
    with pytest.raises(ValueError, match="C1 looks straight up or down"):
        look_at("C1", np.array([1.0, 2, 3]), np.array([1.0, 2, 0]), 500.0, (640, 480), np.zeros(5))


def test_pictures_end_half_a_pixel_beyond_their_outer_pixels_centres():
    camera = look_at("C1", np.zeros(3), np.array([1.0, 0, 0]), 500.0, (640, 480), np.zeros(5))
    pixels = np.array([[-0.5, -0.5], [639.4, 479.4], [639.5, 0.0], [0.0, -0.6], [np.nan, np.nan]])
    assert camera.contains(pixels).tolist() == [True, True, False, False, False]
