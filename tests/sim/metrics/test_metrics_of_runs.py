"""Consistency, loss, bounds and intervals against scipy, closed forms and calculation by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from sim.metrics.bounds import posterior_cramer_rao
from sim.metrics.consistency import anees_band, chi_square_quantile, nees
from sim.metrics.errors import anees
from sim.metrics.intervals import bootstrap, mean_interval, ratio_interval
from sim.metrics.loss import Loss, losses
from sim.metrics.sets import gospa, ospa

NAN = float("nan")


@given(st.floats(0.005, 0.995), st.integers(1, 1000))
def test_chi_square_quantiles_are_scipys(probability, degrees):
    found = chi_square_quantile(probability, degrees)

    assert found == pytest.approx(stats.chi2.ppf(probability, degrees), rel=1e-9)


def test_the_band_of_ten_runs_on_a_plane_is_the_textbooks():
    low, high = anees_band(10, 2)

    # χ²(20): 9.59 and 34.17
    assert (low, high) == pytest.approx((9.591 / 20, 34.170 / 20), rel=1e-3)


def test_the_band_holds_a_consistent_filter_nineteen_times_in_twenty():
    rng = np.random.default_rng(3)
    low, high = anees_band(10, 2)
    averages = (rng.standard_normal((4000, 10, 2)) ** 2).mean(axis=(1, 2))

    inside = np.mean((averages > low) & (averages < high))

    assert inside == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 4000))


def test_nees_averages_to_the_anees():
    rng = np.random.default_rng(5)
    means, truth = rng.standard_normal((2, 8, 4))
    covariances = np.tile(np.diag([4.0, 9.0, 1.0, 1.0]), (8, 1, 1))

    assert nees(means, covariances, truth).mean() / 2 == pytest.approx(anees(means, covariances, truth))


def test_nees_of_nothing_is_unknown_and_of_no_doubt_without_bound():
    means = np.array([[NAN] * 4, [1.0, 1.0, 0.0, 0.0]])
    covariances = np.stack([np.full((4, 4), NAN), np.zeros((4, 4))])

    np.testing.assert_array_equal(nees(means, covariances, np.zeros((2, 4))), [NAN, np.inf])


def test_a_target_that_is_estimated_costs_its_distance_up_to_the_cutoff():
    errors = np.array([0.1, 3.0, NAN])

    np.testing.assert_allclose(ospa(errors, 0.8), [0.1, 0.8, 0.8])
    np.testing.assert_allclose(gospa(errors, 0.8), [0.1, 0.8, 0.8 / np.sqrt(2)])


@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        ([0.1] * 20, ()),
        ([0.1] * 3 + [2.0] * 4 + [0.1], ()),  # a slip
        ([0.1] * 3 + [2.0] * 5 + [0.1], (Loss(3, 8),)),
        ([0.1] * 3 + [NAN, 2.0, NAN, 2.0, NAN], (Loss(3, None),)),
        ([2.0] * 6 + [0.1] * 2 + [2.0] * 7 + [0.1], (Loss(0, 6), Loss(8, 15))),
        ([], ()),
    ],
)
def test_losses_last_five_frames_and_end_when_the_target_is_found(errors, expected):
    assert losses(np.array(errors)) == expected


def test_the_bound_without_measurements_is_the_models_own_spread():
    F, Q = np.array([[1.0, 0.5], [0.0, 1.0]]), np.diag([0.1, 0.2])
    P = np.eye(2)

    bounds = posterior_cramer_rao(P, F, Q, [np.zeros((2, 2))] * 3)

    for bound in bounds:
        P = F @ P @ F.T + Q
        np.testing.assert_allclose(bound, P)


def test_the_bound_of_a_constant_is_the_variance_of_a_mean():
    (bound,) = posterior_cramer_rao(np.array([[1e12]]), np.eye(1), np.zeros((1, 1)), [np.array([[5 / 0.04]])])

    assert bound == pytest.approx(np.array([[0.04 / 5]]))


def test_the_bootstrap_is_scipys():
    values = np.random.default_rng(2).gamma(2.0, 0.1, 12)

    found = mean_interval(values)
    expected = stats.bootstrap(
        (values,), np.mean, method="percentile", n_resamples=20_000, rng=np.random.default_rng(1)
    ).confidence_interval

    width = expected.high - expected.low
    assert found.value == values.mean()
    assert found.low == pytest.approx(expected.low, abs=0.05 * width)
    assert found.high == pytest.approx(expected.high, abs=0.05 * width)


def test_what_is_paired_stays_paired():
    runs = np.random.default_rng(2).gamma(2.0, 0.1, 12)

    found = ratio_interval(3 * runs, runs)

    assert (found.value, found.low, found.high) == pytest.approx((3.0, 3.0, 3.0))


def test_the_same_runs_have_the_same_interval_and_one_run_has_no_width():
    values = np.array([[0.1], [0.4], [0.2]])

    def largest(drawn):
        return drawn.max(axis=(1, 2))

    assert bootstrap(values, largest) == bootstrap(values, largest)
    one = mean_interval(np.array([0.3]))
    assert (one.value, one.low, one.high) == (0.3, 0.3, 0.3)
