"""Figures of a run against closed forms, and what they say where estimates are missing."""

import numpy as np
import pytest

from sim.metrics.errors import LOST_ERROR, anees, disagreement, is_lost, position_errors, rmse

NAN = float("nan")


def test_errors_are_distances_of_positions_whatever_the_velocities():
    means = np.array([[3.0, 4.0, 9.0, 9.0], [NAN, NAN, NAN, NAN], [1.0, 0.0, 0.0, 0.0]])

    errors = position_errors(means, np.zeros((3, 4)))

    np.testing.assert_array_equal(errors, [5.0, NAN, 1.0])


def test_errors_in_a_volume_have_three_axes():
    means = np.array([[2.0, 3.0, 6.0, 1.0, 1.0, 1.0]])

    assert position_errors(means, np.zeros((1, 6))) == pytest.approx([7.0])


@pytest.mark.parametrize(
    ("errors", "expected"),
    [([3.0, 4.0], np.sqrt(12.5)), ([NAN, 2.0, NAN], 2.0), ([0.0], 0.0), ([NAN, NAN], NAN), ([], NAN)],
)
def test_rmse_is_over_what_is_there(errors, expected):
    assert rmse(np.array(errors)) == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize(
    ("errors", "lost"),
    [
        ([9.0] * 10 + [0.1] * 5, False),  # it found back
        ([0.1] * 10 + [0.9] * 5, True),
        ([0.1] * 10 + [0.0, 0.0, 0.0, 0.0, 5 * LOST_ERROR], False),  # at the limit, not above
        ([0.1] * 10 + [NAN, NAN, 0.9, 0.9, 0.9], True),
        ([0.1] * 10 + [NAN, NAN, 0.1, NAN, NAN], False),
        ([0.1] * 10 + [NAN] * 5, True),  # nobody knows where it is
        ([0.9], True),
        ([0.1], False),
    ],
)
def test_lost_is_the_mean_of_the_last_five(errors, lost):
    assert is_lost(np.array(errors)) is lost


@pytest.mark.parametrize("n_axes", [2, 3])
def test_anees_is_one_for_a_filter_that_knows_its_error(n_axes):
    rng = np.random.default_rng(1)
    n, size = 4000, 2 * n_axes
    root = rng.standard_normal((size, size)) + 2 * np.eye(size)
    P = root @ root.T
    truth = rng.standard_normal((n, size)) * 10
    means = truth + rng.standard_normal((n, size)) @ root.T

    found = anees(means, np.tile(P, (n, 1, 1)), truth)

    # n · n_axes · ANEES is χ² distributed with n · n_axes degrees of freedom.
    assert found == pytest.approx(1.0, abs=5 * np.sqrt(2 / (n * n_axes)))


def test_anees_counts_squared_deviations_of_the_frames_that_are_there():
    covariances = np.tile(np.diag([4.0, 9.0, 1.0, 1.0]), (3, 1, 1))
    covariances[1] = NAN
    means = np.array([[2.0, 3.0, 0.0, 0.0], [NAN] * 4, [4.0, 0.0, 0.0, 0.0]])

    # (1² + 1²) / 2 and (2² + 0²) / 2
    assert anees(means, covariances, np.zeros((3, 4))) == pytest.approx(1.5)


def test_anees_of_no_estimates_is_unknown():
    assert np.isnan(anees(np.full((2, 4), NAN), np.full((2, 4, 4), NAN), np.zeros((2, 4))))


def test_anees_of_a_filter_that_claims_no_doubt_is_without_bound():
    means, truth = np.ones((2, 4)), np.zeros((2, 4))
    covariances = np.stack([np.eye(4), np.zeros((4, 4))])

    assert anees(means, covariances, truth) == float("inf")


def test_disagreement_is_the_mean_distance_of_all_pairs():
    a = np.zeros((2, 4))
    b = np.tile([3.0, 4.0, 0.0, 0.0], (2, 1))
    c = np.tile([0.0, 4.0, 7.0, 7.0], (2, 1))

    assert disagreement(np.stack([a, b])) == pytest.approx(5.0)
    assert disagreement(np.stack([a, b, c])) == pytest.approx((5 + 4 + 3) / 3)


def test_disagreement_leaves_out_what_is_missing():
    a, b = np.zeros((2, 4)), np.tile([3.0, 4.0, 0.0, 0.0], (2, 1))
    b[1] = NAN

    assert disagreement(np.stack([a, b])) == pytest.approx(5.0)
    assert np.isnan(disagreement(np.stack([a, np.full((2, 4), NAN)])))


def test_one_node_agrees_with_itself():
    assert disagreement(np.ones((1, 5, 4))) == 0.0
