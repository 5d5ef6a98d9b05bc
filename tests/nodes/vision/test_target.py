"""Boxes against OpenCV's projection and visible parts against counted pixels."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from nodes.imaging.camera import look_at
from nodes.vision.target import TargetOptions, project_boxes, visible_fraction

UP = np.array([0.0, 0.0, 1.0])
WIDTH, HEIGHT = 160, 120
seeds = st.integers(0, 2**32 - 1)
PERSON = TargetOptions(height=1.7, width=0.5)


def camera(distortion=(0.0, 0.0, 0.0, 0.0, 0.0)):
    # 2.5 m high, 6 m before the origin
    position, target = np.array([0.0, -6.0, 2.5]), np.array([0.0, 0.0, 1.0])
    return look_at("C1", position, target, 110.0, (WIDTH, HEIGHT), np.array(distortion))


def by_opencv(points, of):
    rotation = cv2.Rodrigues(of.R)[0]
    return cv2.projectPoints(points, rotation, of.t, of.K, of.distortion)[0][:, 0]


@given(seeds, st.sampled_from(["plane", "volume"]))
def test_boxes_reach_from_foot_to_head_as_opencv_projects_them(seed, space):
    rng = np.random.default_rng(seed)
    target = TargetOptions(space=space, plane_height=0.2, height=1.7, width=0.5)
    of = camera((-0.1, 0.02, 0.001, -0.001, 0.0))
    positions = rng.uniform([-1.5, -2, 0.5], [1.5, 3, 1.0], (10, 3))
    foot = positions.copy()
    foot[:, 2] = 0.2 if space == "plane" else positions[:, 2] - 0.85
    boxes = project_boxes(positions if space == "volume" else positions[:, :2], target, of)
    feet, heads = by_opencv(foot, of), by_opencv(foot + 1.7 * UP, of)
    # OpenCV's pixel (0, 0) is the centre of the first pixel, a box's the corner of the picture
    np.testing.assert_allclose(boxes[:, 1], heads[:, 1] + 0.5, atol=1e-6)
    np.testing.assert_allclose(boxes[:, 3], feet[:, 1] + 0.5, atol=1e-6)
    np.testing.assert_allclose((boxes[:, 0] + boxes[:, 2]) / 2, (feet + heads)[:, 0] / 2 + 0.5, atol=1e-6)
    depth = ((foot + 0.85 * UP) @ of.R.T + of.t)[:, 2]
    np.testing.assert_allclose(boxes[:, 2] - boxes[:, 0], 110 * 0.5 / depth)


def test_the_box_of_an_upright_cylinder_covers_its_outline():
    of = camera()
    angles = np.linspace(0, 2 * np.pi, 40)
    rim = 0.25 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    for position in ([0.0, 0.0], [1.0, 1.0], [-1.2, 2.0]):
        base = np.array([*position, 0.0]) + rim
        outline = by_opencv(np.concatenate([base, base + 1.7 * UP]), of) + 0.5
        left, top, right, bottom = project_boxes(np.array([position]), PERSON, of)[0]
        covered = (min(right, outline[:, 0].max()) - max(left, outline[:, 0].min())) * (
            min(bottom, outline[:, 1].max()) - max(top, outline[:, 1].min())
        )
        union = np.ptp(outline[:, 0]) * np.ptp(outline[:, 1]) + (right - left) * (bottom - top) - covered
        assert covered / union > 0.8


def test_nothing_behind_the_camera_or_too_far_has_a_box():
    boxes = project_boxes(np.array([[0.0, -8.0], [0.0, -7.0], [0.0, 500.0], [0.0, 0.0]]), PERSON, camera())
    assert np.isnan(boxes[:3]).all()
    assert np.isfinite(boxes[3]).all()
    np.testing.assert_array_equal(visible_fraction(boxes, camera()), [0, 0, 0, 1])


def test_seen_from_above_a_person_is_at_least_as_high_as_wide():
    of = look_at("C1", np.array([0.0, -0.01, 6.0]), np.zeros(3), 110.0, (WIDTH, HEIGHT), np.zeros(5))
    left, top, right, bottom = project_boxes(np.zeros((1, 2)), PERSON, of)[0]
    assert bottom - top == pytest.approx(0.8 * (right - left))


@given(seeds)
def test_the_visible_part_is_the_share_of_pixels_inside(seed):
    rng = np.random.default_rng(seed)
    low = rng.integers(-60, 140, (20, 2))
    boxes = np.hstack([low, low + rng.integers(1, 90, (20, 2))]).astype(float)
    for box, fraction in zip(boxes, visible_fraction(boxes, camera()), strict=True):
        left, top, right, bottom = box.astype(int)
        x, y = np.meshgrid(np.arange(left, right), np.arange(top, bottom))
        inside = (x >= 0) & (x < WIDTH) & (y >= 0) & (y < HEIGHT)
        assert fraction == pytest.approx(inside.mean())


@given(seeds)
def test_in_the_image_plane_a_box_has_one_size_around_its_pixel(seed):
    target = TargetOptions(space="image", size_px=(15, 21))
    centers = np.random.default_rng(seed).integers(-20, 180, (10, 2)).astype(float)
    boxes = project_boxes(centers, target, camera())
    np.testing.assert_array_equal(boxes[:, 2:] - boxes[:, :2], np.tile([15.0, 21.0], (10, 1)))
    # around the centre of a pixel, an odd box holds whole pixels: 7 on each side of it, 10 above and below
    np.testing.assert_array_equal(boxes[:, :2], centers - [7, 10])
    assert (target.n_axes, target.unit) == (2, "px")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"space": "image"}, "needs size_px"),
        ({"size_px": (10, 10)}, "size_px is for the image plane"),
        ({"space": "volume", "size_px": (10, 10)}, "size_px is for the image plane"),
        ({"space": "image", "size_px": (10, 10), "height": 1.8}, "height is in m"),
        ({"space": "image", "size_px": (10, 10), "plane_height": 1.0}, "plane_height is in m"),
        ({"space": "image", "size_px": (10, 0)}, "greater than 0"),
    ],
)
def test_the_size_is_in_the_unit_of_the_space(options, message):
    with pytest.raises(ValidationError, match=message):
        TargetOptions(**options)
