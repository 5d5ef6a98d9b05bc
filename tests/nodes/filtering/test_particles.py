"""Weights, resampling and effective sample size against SciPy and against their definitions."""

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.special import logsumexp

from nodes.filtering.particles import (
    Particles,
    normalize,
    resample_if_degenerate,
    reweight,
    sample_gaussian,
    systematic_indices,
    uniform_log_weights,
)

logs = arrays(float, st.integers(1, 40), elements=st.floats(-800, 800))
shares = arrays(float, st.integers(1, 40), elements=st.sampled_from([0.0, 0.0, 1e-12, 0.1, 0.5, 1.0, 7.0]))


def cloud(log_weights):
    return Particles(np.arange(4.0 * len(log_weights)).reshape(-1, 4), log_weights)


@given(logs)
def test_normalize_divides_by_the_sum_that_scipy_finds(log_weights):
    normalized, log_sum = normalize(log_weights)
    assert log_sum == pytest.approx(logsumexp(log_weights), abs=1e-9)
    assert logsumexp(normalized) == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(normalized, log_weights - logsumexp(log_weights), atol=1e-9)


def test_impossible_weights_are_a_result_and_not_an_exception():
    normalized, log_sum = normalize(np.full(8, -np.inf))
    np.testing.assert_array_equal(normalized, uniform_log_weights(8))
    assert log_sum == -np.inf
    np.testing.assert_allclose(np.exp(normalize(np.array([-np.inf, 3.0]))[0]), [0, 1])


@given(logs, st.floats(-900, 900))
def test_a_flat_likelihood_leaves_the_weights_alone_to_the_last_bit(log_weights, level):
    before = cloud(normalize(log_weights)[0])
    after = reweight(before, np.full(len(log_weights), level))
    assert np.array_equal(after.log_weights, before.log_weights)


def test_reweight_is_bayes_rule():
    prior, likelihood = np.array([0.1, 0.2, 0.3, 0.4]), np.array([5.0, 0.5, 2.0, 0.0])
    with np.errstate(divide="ignore"):
        posterior = reweight(cloud(np.log(prior)), np.log(likelihood))
    np.testing.assert_allclose(posterior.weights, prior * likelihood / (prior @ likelihood))
    _, log_evidence = normalize(np.log(prior[:3]) + np.log(likelihood[:3]))
    assert log_evidence == pytest.approx(np.log(prior[:3] @ likelihood[:3]))


@given(logs)
def test_the_effective_sample_size_lies_between_one_and_n(log_weights):
    particles = cloud(normalize(log_weights)[0])
    ess = particles.effective_sample_size
    assert 1 - 1e-9 <= ess <= len(log_weights) + 1e-9
    assert ess == pytest.approx(1 / np.sum(particles.weights**2))


def test_the_effective_sample_size_reaches_its_bounds():
    assert cloud(uniform_log_weights(50)).effective_sample_size == pytest.approx(50)
    one = np.full(50, -np.inf)
    one[7] = 0.0
    assert cloud(one).effective_sample_size == pytest.approx(1)


@given(shares, st.floats(0, 1, exclude_max=True))
@example(np.ones(40), float(np.nextafter(1, 0)))
def test_each_particle_has_the_children_that_its_weight_asks_for(raw, offset):
    assume(raw.sum() > 0)
    n, weights = len(raw), raw / raw.sum()
    children = np.bincount(systematic_indices(weights, offset), minlength=n)
    assert len(children) == n
    assert children.sum() == n
    # floor or ceil of N ω, where ω may be off by the rounding of a sum
    assert np.all(children >= np.floor(n * weights - 1e-9))
    assert np.all(children <= np.ceil(n * weights + 1e-9))
    assert not children[weights == 0].any()


def test_systematic_indices_are_those_of_the_inverse_cumulative():
    rng = np.random.default_rng(3)
    weights, offset = rng.dirichlet(np.ones(30)), 0.37
    cumulative = np.cumsum(weights)
    by_hand = [next(i for i in range(30) if cumulative[i] > (k + offset) / 30) for k in range(30)]
    np.testing.assert_array_equal(systematic_indices(weights, offset), by_hand)


@pytest.mark.parametrize("survivor", [0, 4, 9])
def test_all_weight_on_one_particle(survivor):
    weights = np.zeros(10)
    weights[survivor] = 1.0
    np.testing.assert_array_equal(systematic_indices(weights, 0.999), np.full(10, survivor))


def test_resampling_happens_below_the_threshold_only():
    rng = np.random.default_rng(0)
    particles = cloud(np.log([0.7, 0.1, 0.1, 0.1]))  # effective sample size 1.92 of 4
    assert resample_if_degenerate(particles, 0.4, rng) is particles
    resampled = resample_if_degenerate(particles, 0.5, rng)
    np.testing.assert_array_equal(resampled.log_weights, uniform_log_weights(4))
    assert np.isin(resampled.states[:, 0], particles.states[:, 0]).all()


def test_resampling_keeps_the_mean_on_average():
    rng = np.random.default_rng(5)
    n, repeats = 200, 500
    particles = Particles(rng.normal(size=(n, 2)), np.log(rng.dirichlet(np.full(n, 0.3))))
    means = [resample_if_degenerate(particles, 1.0, rng).states.mean(axis=0) for _ in range(repeats)]
    error = np.mean(means, axis=0) - particles.weights @ particles.states
    assert np.abs(error / np.std(means, axis=0)).max() < 4 / np.sqrt(repeats)


def test_the_start_is_the_gaussian_asked_for():
    n, mean, deviation = 50_000, np.array([1.0, 2, 3, 4]), np.array([0.1, 1, 10, 0])
    start = sample_gaussian(mean, deviation, n, np.random.default_rng(2))
    assert np.all(np.abs(start.states.mean(axis=0) - mean) <= 4 * deviation / np.sqrt(n))
    np.testing.assert_allclose(start.states.std(axis=0), deviation, rtol=4 / np.sqrt(2 * n))
    np.testing.assert_array_equal(start.positions, start.states[:, :2])
    assert start.weights.sum() == pytest.approx(1)
