"""The local filter against sums written out, and the count of frames that told nothing."""

import numpy as np
import pytest

from nodes.filtering.gaussian import Information, Moments, no_information
from nodes.filtering.local import local_filter
from nodes.filtering.particles import Particles
from nodes.filtering.sighting import PATIENCE, Sighting, shrinkage, shrinkage_by


def test_equations_9_to_14_written_out():
    rng = np.random.default_rng(0)
    states, weights = rng.normal(size=(20, 4)), rng.dirichlet(np.ones(20))
    log_likelihoods = rng.normal(size=20)
    result = local_filter(Particles(states, np.log(weights)), log_likelihoods)
    updated = weights * np.exp(log_likelihoods)
    updated /= updated.sum()
    for found, w in ((result.predicted, weights), (result.posterior, updated)):
        mean = sum(w[j] * states[j] for j in range(20))
        covariance = sum(w[j] * np.outer(states[j] - mean, states[j] - mean) for j in range(20))
        np.testing.assert_allclose(found.mean, mean)
        np.testing.assert_allclose(found.covariance, covariance, atol=1e-15)
    np.testing.assert_allclose(result.particles.weights, updated)


def test_a_flat_likelihood_makes_the_posterior_the_prediction_to_the_last_bit():
    rng = np.random.default_rng(1)
    particles = Particles(rng.normal(size=(50, 4)), np.log(rng.dirichlet(np.ones(50))))
    result = local_filter(particles, np.full(50, -6.0))
    assert np.array_equal(result.posterior.mean, result.predicted.mean)
    assert np.array_equal(result.posterior.covariance, result.predicted.covariance)


@pytest.mark.parametrize("shrunk", [1.0, 0.96])
def test_frames_that_tell_nothing_are_counted_and_lose_the_target(shrunk):
    before, sighting = Moments(np.zeros(2), np.diag([0.04, 0.01])), Sighting()
    after = Moments(np.zeros(2), shrunk * before.covariance)
    for frame in range(PATIENCE):
        assert not sighting.lost
        sighting = sighting.after(shrinkage(before, after))
        assert sighting.unseen == frame + 1
    assert sighting.lost
    # half the variance along one axis is 25% in the mean: something was seen
    seen = Moments(np.zeros(2), np.diag([0.02, 0.01]))
    assert shrinkage(before, seen) == pytest.approx(0.75)
    assert not sighting.after(shrinkage(before, seen)).lost


@pytest.mark.parametrize("covariance", [np.zeros((2, 2)), np.ones((2, 2)), 1e9 * np.ones((2, 2))])
def test_a_collapsed_cloud_learns_nothing_and_is_no_exception(covariance):
    collapsed = Moments(np.zeros(2), covariance)
    assert Sighting().after(shrinkage(collapsed, collapsed)).unseen == 1
    state = Moments(np.zeros(4), np.kron(np.eye(2), covariance))
    assert shrinkage_by(no_information(2), state) == pytest.approx(1)


def test_a_factor_shrinks_the_covariance_as_the_kalman_update_does():
    rng = np.random.default_rng(3)
    A, B = rng.normal(size=(2, 4, 4))
    predicted = Moments(np.zeros(4), A @ A.T + np.eye(4))
    gain = Information((B @ B.T)[:2, :2], np.zeros(2))
    r = predicted.covariance[:2, :2]
    p = np.linalg.inv(np.linalg.inv(r) + gain.matrix)
    assert shrinkage_by(gain, predicted) == pytest.approx(
        shrinkage(Moments(np.zeros(2), r), Moments(np.zeros(2), p))
    )
    taking_away = Information(-0.5 * np.linalg.inv(r), np.zeros(2))
    assert shrinkage_by(taking_away, predicted) == pytest.approx(1)
