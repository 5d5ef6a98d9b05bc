"""The sensor against cameras, its derivatives against differences, its noise against what it claims."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.imaging.camera import look_at
from sim.scenario.sensor import SensorOptions
from sim.simulation.sensor import Sensors, measure

seeds = st.integers(0, 2**32 - 1)


def cameras(rng, n=6):
    return [
        look_at(
            f"C{i}",
            rng.uniform([-6, -6, 2], [6, 6, 4]),
            rng.uniform(-1, 1, 3),
            150.0,
            (160, 120),
            np.zeros(5),
        )
        for i in range(n)
    ]


@given(seeds)
def test_many_cameras_project_as_each_by_itself(seed):
    rng = np.random.default_rng(seed)
    listed = cameras(rng)
    point = rng.uniform(-2, 2, 3)
    sensors = Sensors.of(listed)
    pixels, places = sensors.project(point)
    for index, camera in enumerate(listed):
        expected, depth = camera.project(point[None])
        assert places[index, 2] == pytest.approx(depth[0])
        inside = bool(camera.contains(expected)[0])
        assert bool(sensors.in_view(pixels, places, 100.0)[index]) == inside
        if depth[0] > 0.1:
            np.testing.assert_allclose(pixels[index], expected[0], rtol=1e-9)


@given(seeds)
def test_derivatives_are_the_differences(seed):
    rng = np.random.default_rng(seed)
    sensors = Sensors.of(cameras(rng))
    point = rng.uniform(-1, 1, 3)
    _, places = sensors.project(point)
    found, h = sensors.derivatives(places), 1e-6
    for axis, step in enumerate(h * np.eye(3)):
        slope = (sensors.project(point + step)[0] - sensors.project(point - step)[0]) / (2 * h)
        near = places[:, 2] > 0.5
        np.testing.assert_allclose(found[near, :, axis], slope[near], rtol=1e-4, atol=1e-3)


def test_what_is_not_seen_says_exactly_nothing():
    rng = np.random.default_rng(0)
    listed = cameras(rng, 50)
    sensors = Sensors.of(listed)
    luck, noise = rng.random(50), rng.standard_normal((50, 2))
    for options, seen_by_some in (
        (SensorOptions(), True),
        (SensorOptions(occlusion=1.0), False),
        (SensorOptions(range_m=0.5), False),
    ):
        told, seen = measure(sensors, np.array([0.3, -0.2, 0.9]), 2, options, luck, noise)
        assert seen.any() == seen_by_some
        assert not told.matrix[~seen].any()
        assert not told.vector[~seen].any()


@pytest.mark.parametrize("n_axes", [2, 3])
def test_measurements_of_many_draws_have_the_mean_and_the_covariance_that_they_claim(n_axes):
    rng = np.random.default_rng(1)
    camera = look_at("C", np.array([-4.0, 1.0, 3.0]), np.zeros(3), 150.0, (160, 120), np.zeros(5))
    n, middle = 20_000, np.array([0.4, -0.3, 0.8])
    sensors = Sensors.of([camera] * n)
    noise = rng.standard_normal((n, 2))
    told, seen = measure(sensors, middle, n_axes, SensorOptions(noise_px=3.0), np.ones(n), noise)
    assert seen.all()
    # η - Λ x has mean 0 and covariance Λ
    off = told.vector - told.matrix[0] @ middle[:n_axes]
    scale = np.sqrt(np.diag(told.matrix[0]))
    assert np.abs(off.mean(axis=0) / scale).max() < 4 / np.sqrt(n)
    spread = (np.cov(off.T) - told.matrix[0]) / np.outer(scale, scale)
    assert np.abs(spread).max() < 4 * np.sqrt(2 / n)


def test_many_frames_are_measured_as_each_by_itself():
    rng = np.random.default_rng(3)
    sensors, options = Sensors.of(cameras(rng, 20)), SensorOptions()
    middle, luck, noise = rng.uniform(-2, 2, (7, 3)), rng.random((7, 20)), rng.standard_normal((7, 20, 2))
    together, seen = measure(sensors, middle, 2, options, luck, noise)
    assert seen.any()
    for frame in range(7):
        alone, seen_alone = measure(sensors, middle[frame], 2, options, luck[frame], noise[frame])
        assert np.array_equal(seen[frame], seen_alone)
        np.testing.assert_allclose(together.matrix[frame], alone.matrix, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(together.vector[frame], alone.vector, rtol=1e-9, atol=1e-9)


def test_occlusion_is_as_likely_as_it_says():
    rng = np.random.default_rng(2)
    camera = look_at("C", np.array([-4.0, 1.0, 3.0]), np.zeros(3), 150.0, (160, 120), np.zeros(5))
    sensors = Sensors.of([camera] * 10_000)
    options = SensorOptions(occlusion=0.3)
    _, seen = measure(
        sensors, np.array([0.0, 0.0, 0.9]), 2, options, rng.random(10_000), np.zeros((10_000, 2))
    )
    assert seen.mean() == pytest.approx(0.7, abs=4 * np.sqrt(0.21 / 10_000))
