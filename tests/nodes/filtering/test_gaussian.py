"""Information form against moment form, and the two ways to say what a measurement told."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from nodes.filtering.gaussian import (
    Information,
    Moments,
    fit_log_quadratic,
    log_factor,
    moments,
    net_information,
    regularized,
    to_information,
    with_smaller_steps,
)

RIDGE = 1e-12
seeds = st.integers(0, 2**32 - 1)


def random_covariance(rng, n):
    A = rng.normal(size=(n, n))
    return A @ A.T + 0.1 * np.eye(n)


def random_gaussian(rng, n):
    return Moments(rng.normal(size=n), random_covariance(rng, n))


@given(seeds)
def test_moments_are_those_of_numpy(seed):
    rng = np.random.default_rng(seed)
    states, weights = rng.normal(100, 1, size=(30, 4)), rng.dirichlet(np.ones(30))
    found = moments(states, weights)
    np.testing.assert_allclose(found.mean, np.average(states, axis=0, weights=weights))
    np.testing.assert_allclose(found.covariance, np.cov(states.T, aweights=weights, ddof=0), atol=1e-12)
    np.testing.assert_array_equal(found.covariance, found.covariance.T)
    np.testing.assert_array_equal(found.position().mean, found.mean[:2])
    np.testing.assert_array_equal(found.position().covariance, found.covariance[:2, :2])


@given(seeds, st.sampled_from([2, 3, 4, 6]))
def test_information_form_says_the_same_as_moment_form(seed, n):
    gaussian = random_gaussian(np.random.default_rng(seed), n)
    information = to_information(gaussian, RIDGE)
    np.testing.assert_allclose(information.matrix @ gaussian.covariance, np.eye(n), atol=1e-6)
    np.testing.assert_allclose(np.linalg.solve(information.matrix, information.vector), gaussian.mean)


@given(seeds)
def test_a_factor_is_the_gaussians_logarithm_up_to_a_constant(seed):
    rng = np.random.default_rng(seed)
    gaussian, points = random_gaussian(rng, 2), rng.normal(size=(20, 2))
    expected = multivariate_normal(gaussian.mean, gaussian.covariance).logpdf(points)
    found = log_factor(points, to_information(gaussian, RIDGE), points.mean(axis=0))
    np.testing.assert_allclose(found - found[0], expected - expected[0], atol=1e-6)


def test_a_factor_far_from_the_origin_loses_no_digits():
    far, information = np.array([1e5, -1e5]), Information(1e4 * np.eye(2), 1e4 * np.array([1e5, -1e5]))
    points = far + np.array([[0.0, 0.0], [0.01, 0.0], [0.0, -0.02]])
    found = log_factor(points, information, points.mean(axis=0))
    np.testing.assert_allclose(found - found[0], [0, -0.5, -2], rtol=1e-6)


@given(seeds, st.sampled_from([2, 3]))
def test_net_information_turns_the_prediction_into_the_posterior(seed, n):
    """Where p⁻¹ - r⁻¹ is a density's, as for every Gaussian measurement, nothing else is found."""
    rng = np.random.default_rng(seed)
    predicted = random_gaussian(rng, n)
    measured = to_information(random_gaussian(rng, n), RIDGE)
    before = to_information(predicted, RIDGE)
    covariance = np.linalg.inv(before.matrix + measured.matrix)
    posterior = Moments(covariance @ (before.vector + measured.vector), covariance)
    net = net_information(posterior, predicted, RIDGE)
    np.testing.assert_allclose(net.matrix, measured.matrix, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(net.vector, measured.vector, rtol=1e-5, atol=1e-5)


@given(seeds, st.sampled_from([2, 3]))
def test_net_information_is_always_a_density(seed, n):
    rng = np.random.default_rng(seed)
    posterior, predicted = random_gaussian(rng, n), random_gaussian(rng, n)
    net = net_information(posterior, predicted, RIDGE)
    eigenvalues = np.linalg.eigvalsh(net.matrix)
    assert eigenvalues[0] >= -1e-9 * max(1.0, eigenvalues[-1])
    # nothing finite was lost on directions that did shrink: Λ ≥ p⁻¹ - r⁻¹
    difference = np.linalg.inv(posterior.covariance) - np.linalg.inv(predicted.covariance)
    assert np.linalg.eigvalsh(net.matrix - difference)[0] >= -1e-6 * max(1.0, np.abs(difference).max())


def test_net_information_of_no_measurement_is_zero_exactly():
    gaussian = random_gaussian(np.random.default_rng(0), 2)
    net = net_information(gaussian, gaussian, RIDGE)
    assert not net.matrix.any()
    assert not net.vector.any()


def test_a_direction_that_grew_wider_says_nothing():
    net = net_information(
        Moments(np.array([1.0, 5.0]), np.diag([0.25, 4.0])), Moments(np.zeros(2), np.eye(2)), RIDGE
    )
    # along x: 1/0.25 - 1 = 3, and 1/0.25 · 1 = 4; along y the sample grew
    np.testing.assert_allclose(net.matrix, np.diag([3.0, 0.0]), atol=1e-9)
    np.testing.assert_allclose(net.vector, [4.0, 0.0], atol=1e-9)


@given(seeds, st.sampled_from([2, 3]))
def test_the_fit_recovers_an_exact_quadratic(seed, n):
    rng = np.random.default_rng(seed)
    exact = to_information(random_gaussian(rng, n), RIDGE)
    points, weights = rng.normal(3, 0.5, size=(60, n)), rng.dirichlet(np.ones(60))
    values = 7.0 + log_factor(points, exact, np.zeros(n))
    fitted = fit_log_quadratic(points, values, weights)
    np.testing.assert_allclose(fitted.matrix, exact.matrix, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(fitted.vector, exact.vector, rtol=1e-5, atol=1e-4)


def test_the_fit_of_a_valley_is_flat():
    points = np.random.default_rng(1).normal(size=(50, 2))
    fitted = fit_log_quadratic(points, points[:, 0] ** 2 - 2 * points[:, 1] ** 2, np.full(50, 0.02))
    np.testing.assert_allclose(fitted.matrix, np.diag([0.0, 4.0]), atol=1e-9)


def test_a_fit_and_a_mean_that_agree_are_the_fit():
    fit = Information(np.array([[3.0, 1.0], [1.0, 2.0]]), np.array([1.0, -2.0]))
    predicted = Moments(np.array([1.0, 2.0]), np.array([[0.5, 0.2], [0.2, 0.4]]))
    before = to_information(predicted, RIDGE)
    mean = np.linalg.solve(before.matrix + fit.matrix, before.vector + fit.vector)
    limited = with_smaller_steps(fit, Moments(mean, np.eye(2)), predicted, RIDGE)
    np.testing.assert_allclose(limited.matrix, fit.matrix, atol=1e-9)
    np.testing.assert_allclose(limited.vector, fit.vector, atol=1e-7)


@given(seeds, st.sampled_from([2, 3]))
def test_in_no_direction_a_fit_moves_farther_than_the_sample_or_than_itself(seed, n):
    rng = np.random.default_rng(seed)
    predicted, posterior = random_gaussian(rng, n), random_gaussian(rng, n)
    fit = to_information(random_gaussian(rng, n), RIDGE)
    limited = with_smaller_steps(fit, posterior, predicted, RIDGE)
    np.testing.assert_allclose(limited.matrix, fit.matrix, rtol=1e-6, atol=1e-6)
    # in coordinates in which the prediction is the identity and the fit is diagonal
    L = np.linalg.cholesky(predicted.covariance)
    curvature, V = np.linalg.eigh(L.T @ fit.matrix @ L)
    steps = [
        V.T @ L.T @ (each.vector - fit.matrix @ predicted.mean) / (1 + curvature) for each in (fit, limited)
    ]
    to_mean = V.T @ np.linalg.solve(L, posterior.mean - predicted.mean)
    expected = np.where(np.abs(steps[0]) < np.abs(to_mean), steps[0], to_mean)
    np.testing.assert_allclose(steps[1], expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("n_points", [1, 3, 5])
def test_too_few_points_tell_no_quadratic(n_points):
    points = np.random.default_rng(1).normal(size=(50, 2))
    weights = np.where(np.arange(50) < n_points, 1 / n_points, 0.0)
    fitted = fit_log_quadratic(points, -50 * (points**2).sum(axis=1), weights)
    assert not fitted.matrix.any()
    assert not fitted.vector.any()


@given(seeds, st.sampled_from([1, 2, 4]), st.floats(-6, 6))
def test_collapsed_samples_are_a_result_and_not_an_exception(seed, n_distinct, log_scale):
    rng = np.random.default_rng(seed)
    states = 10**log_scale * rng.normal(size=(n_distinct, 4)).repeat(5, axis=0)
    predicted = moments(states, np.full(len(states), 1 / len(states)))
    posterior = moments(states, rng.dirichlet(np.ones(len(states))))
    for information in (
        to_information(predicted, 1e-10),
        to_information(posterior, 1e-10),
        net_information(posterior.position(), predicted.position(), 1e-10),
        fit_log_quadratic(states[:, :2], rng.normal(size=len(states)), np.full(len(states), 1 / len(states))),
    ):
        assert np.isfinite(information.matrix).all()
        assert np.isfinite(information.vector).all()
    assert np.linalg.cholesky(regularized(predicted.covariance, 1e-10)).shape == (4, 4)
