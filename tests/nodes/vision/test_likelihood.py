"""The miss floor against its limits, and the constants taken from the background."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.vision.likelihood import (
    LikelihoodOptions,
    background_constants,
    log_gaussian,
    with_miss_floor,
)

D0, VARIANCE = 0.12, 0.01
FLOOR = -D0 / (2 * VARIANCE)
MISS_FLOOR = LikelihoodOptions()


def values(distance, visible=1.0):
    distance = np.atleast_1d(np.asarray(distance, dtype=float))
    visible = np.broadcast_to(np.asarray(visible, dtype=float), distance.shape)
    return with_miss_floor(log_gaussian(distance, VARIANCE), visible, D0, VARIANCE, 0.5)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_it_is_the_sum_of_two_gaussians(distances):
    expected = np.log(np.exp(-np.array(distances) / (2 * VARIANCE)) + np.exp(-D0 / (2 * VARIANCE)))
    np.testing.assert_allclose(values(distances), expected, rtol=1e-12)


def test_limits():
    assert values(0)[0] == pytest.approx(0, abs=np.exp(FLOOR))  # a perfect match: hardly any floor
    assert values(1)[0] == pytest.approx(FLOOR)  # nothing like it: the floor
    assert values(D0)[0] == pytest.approx(FLOOR + np.log(2))  # at d₀² both are alike
    assert np.all(np.diff(values(np.linspace(0, 1, 50))) <= 0)


def test_no_place_in_the_picture_is_worse_than_one_outside():
    visible = np.array([0.0, 0.49, 0.5, 1.0])
    found = values(np.full(4, 0.3), visible)
    np.testing.assert_array_equal(found[:2], FLOOR)
    assert np.all(found[2:] > FLOOR)


def test_out_of_every_picture_is_flat_to_the_last_bit():
    found = values(np.linspace(0, 1, 30), np.zeros(30))
    assert np.all(found == found[0])


def test_taken_literally_it_is_the_logarithm_of_one_gaussian():
    distance = np.array([0.0, 0.2, 1.0])
    np.testing.assert_allclose(np.exp(log_gaussian(distance, VARIANCE)), np.exp(-distance / (2 * VARIANCE)))


def test_the_constants_follow_the_background():
    options = LikelihoodOptions(background_fraction=0.4, background_ratio=10)
    assert background_constants(np.array([0.1, 0.5, 0.9, 0.3, 0.7]), options) == pytest.approx((0.2, 0.02))


@pytest.mark.parametrize(
    ("surroundings", "options"),
    [
        (np.array([0.5, 0.5, 0.5]), MISS_FLOOR),  # too few
        (np.zeros(10), MISS_FLOOR),  # all like the target: their median would leave no likelihood
        (np.full(10, 0.5), LikelihoodOptions(calibration="fixed")),
    ],
)
def test_the_fixed_constants_serve_where_the_background_tells_nothing(surroundings, options):
    assert background_constants(surroundings, options) == pytest.approx(
        (options.miss_distance, options.sigma**2)
    )
