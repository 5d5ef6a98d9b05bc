"""What a camera sends, and what the network's sum does to the particles, against closed forms and sums."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from nodes.filtering.fusion import (
    Factor,
    FusionOptions,
    draw_optimal,
    fuse,
    is_density,
    pack,
    propagate,
    reweight_by_ratio,
    unpack,
)
from nodes.filtering.gaussian import Information, Moments, log_factor
from nodes.filtering.local import LocalResult, local_filter
from nodes.filtering.motion import DynamicsOptions, constant_velocity
from nodes.filtering.particles import Particles, normalize, sample_gaussian

MOTION = constant_velocity(2, 0.1, DynamicsOptions(position_variance=0.02, velocity_variance=0.05))
RULES = ("net_information", "quadratic_fit", "eq17")
seeds = st.integers(0, 2**32 - 1)


def cloud(rng, n=60):
    particles = sample_gaussian(rng.normal(size=4), np.array([0.3, 0.2, 0.5, 0.4]), n, rng)
    return Particles(particles.states, np.log(rng.dirichlet(np.ones(n))))


def measurement(rng):
    """exp(-½ xᵀΛx + xᵀη) on the position."""
    A = rng.normal(size=(2, 2))
    matrix = A @ A.T + 0.5 * np.eye(2)
    return Information(matrix, matrix @ rng.normal(size=2))


def exact_result(particles, predicted, measured):
    """A local filter's result whose moments are those of the Gaussians themselves."""
    before = np.linalg.inv(predicted.covariance)
    after = before.copy()
    after[:2, :2] += measured.matrix
    vector = before @ predicted.mean
    vector[:2] += measured.vector
    covariance = np.linalg.inv(after)
    posterior = Moments(covariance @ vector, (covariance + covariance.T) / 2)
    log_likelihoods = log_factor(particles.positions, measured, np.zeros(2))
    return LocalResult(predicted, posterior, particles, particles, log_likelihoods)


def padded(information):
    """The same factor on the state, which says nothing about the velocity."""
    matrix = np.zeros((4, 4))
    matrix[:2, :2] = information.matrix
    return Information(matrix, np.concatenate([information.vector, np.zeros(2)]))


@pytest.mark.parametrize("rule", RULES)
@given(seed=seeds)
def test_the_sum_over_the_cameras_is_the_product_of_their_gaussians(rule, seed):
    rng = np.random.default_rng(seed)
    options = FusionOptions(rule=rule, ridge=1e-13)
    A = rng.normal(size=(4, 4))
    predicted = Moments(rng.normal(size=4), A @ A.T + 0.1 * np.eye(4))
    measured = [measurement(rng) for _ in range(4)]
    packed = [pack(exact_result(cloud(rng), predicted, each), 4, options) for each in measured]
    fused = unpack(np.mean(packed, axis=0), 4, 4, options)
    product = Information(sum(each.matrix for each in measured), sum(each.vector for each in measured))
    expected = padded(product) if rule == "eq17" else product
    scale = 1 + np.abs(expected.matrix).max()
    np.testing.assert_allclose(fused.gain.matrix, expected.matrix, atol=1e-5 * scale)
    np.testing.assert_allclose(fused.gain.vector, expected.vector, atol=1e-5 * scale)
    assert rule == "eq17" or fused.is_density


def test_how_many_numbers_a_camera_sends():
    rng = np.random.default_rng(0)
    result = local_filter(cloud(rng), rng.normal(size=60))
    assert [len(pack(result, 4, FusionOptions(rule=rule))) for rule in RULES] == [5, 5, 28]


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("proposal", ["prior", "optimal"])
def test_cameras_that_see_nothing_change_nothing_to_the_last_bit(rule, proposal):
    rng = np.random.default_rng(0)
    options = FusionOptions(rule=rule, proposal=proposal)
    previous = cloud(rng)
    predicted = propagate(previous, MOTION, rng)
    fused = unpack(pack(local_filter(predicted, np.full(60, -3.7)), 4, options), 4, 4, options)
    assert not fused.gain.matrix.any()
    assert not fused.gain.vector.any()
    posterior = fuse(previous, predicted, fused, MOTION, options, rng)
    assert np.array_equal(posterior.log_weights, previous.log_weights)
    assert np.array_equal(posterior.states, predicted.states)


@pytest.mark.parametrize("rule", ["net_information", "quadratic_fit"])
def test_two_cameras_with_the_same_information_are_one_with_twice(rule):
    rng = np.random.default_rng(1)
    options = FusionOptions(rule=rule)
    previous, measured = cloud(rng), measurement(rng)
    predicted = propagate(previous, MOTION, rng)
    alike = pack(local_filter(predicted, log_factor(predicted.positions, measured, np.zeros(2))), 2, options)
    two = unpack((alike + alike) / 2, 2, 4, options)
    one = unpack(2 * alike, 1, 4, options)
    clouds = [
        fuse(previous, predicted, fused, MOTION, options, np.random.default_rng(2)) for fused in (two, one)
    ]
    assert np.array_equal(clouds[0].states, clouds[1].states)
    assert np.array_equal(clouds[0].log_weights, clouds[1].log_weights)


@given(seeds)
def test_the_ratio_is_that_of_two_gaussian_densities(seed):
    """Eq. 17 as printed: N(χ; u, p) / N(χ; v, r), with SciPy's densities."""
    rng = np.random.default_rng(seed)
    options = FusionOptions(rule="eq17", ridge=1e-13)
    particles = cloud(rng)
    result = local_filter(particles, rng.normal(size=60))
    found = reweight_by_ratio(particles, unpack(pack(result, 1, options), 1, 4, options))
    log_ratio = multivariate_normal(result.posterior.mean, result.posterior.covariance).logpdf(
        particles.states
    ) - multivariate_normal(result.predicted.mean, result.predicted.covariance).logpdf(particles.states)
    expected, _ = normalize(particles.log_weights + log_ratio)
    np.testing.assert_allclose(found.log_weights, expected, atol=1e-5)


def test_a_difference_that_is_no_density_is_told():
    rng = np.random.default_rng(3)
    particles = cloud(rng)
    # the posterior keeps the outermost particles: it is wider than the prediction
    outwards = ((particles.positions - particles.positions.mean(axis=0)) ** 2).sum(axis=1)
    result = local_filter(particles, 10 * outwards)
    eq17 = FusionOptions(rule="eq17")
    assert not is_density(result, eq17)
    assert not unpack(pack(result, 4, eq17), 4, 4, eq17).is_density
    net = FusionOptions(rule="net_information")
    assert is_density(result, net)
    assert unpack(pack(result, 4, net), 4, 4, net).is_density


def test_a_sum_that_is_no_density_is_a_result_and_not_an_exception():
    rng = np.random.default_rng(4)
    previous = cloud(rng)
    predicted = propagate(previous, MOTION, rng)
    fused = unpack(np.array([-1e9, 0.0, -1e9, 3.0, 4.0]), 4, 4, FusionOptions())
    assert not fused.is_density
    posterior = fuse(previous, predicted, fused, MOTION, FusionOptions(), rng)
    assert posterior.weights.sum() == pytest.approx(1)


def by_integration(x, factor):
    """∫ N(y; x, Q) factor(y) dy over the position, and the mean and covariance of the integrand."""
    Q = MOTION.variances[:2]
    axes = [x[i] + np.sqrt(Q[i]) * np.linspace(-9, 9, 401) for i in range(2)]
    y = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    values = np.exp(-0.5 * ((y - x) ** 2 / Q).sum(axis=1) + log_factor(y, factor, np.zeros(2)))
    values /= values.sum() if (total := values.sum()) else 1
    mean = values @ y
    return total, mean, ((y - mean) * values[:, None]).T @ (y - mean)


@pytest.mark.parametrize("on_state", [False, True])
def test_the_optimal_proposal_against_numerical_integration(on_state):
    rng = np.random.default_rng(5)
    n, x = 40_000, np.array([[0.3, -0.2, 1.0, 0.5], [0.1, 0.1, -1.0, 0.0], [-0.2, 0.3, 0.0, 2.0]])
    factor = Information(np.array([[30.0, 12.0], [12.0, 60.0]]), np.array([5.0, -7.0]))
    prior = np.array([0.5, 0.3, 0.2])
    previous = Particles(x.repeat(n, axis=0), np.log(prior / n).repeat(n))
    fused = Factor(padded(factor) if on_state else factor, is_density=True)
    drawn = draw_optimal(previous, fused, MOTION, rng)
    expected = [by_integration(MOTION.F[:2] @ each, factor) for each in x]
    evidence = prior * [total for total, _, _ in expected]
    np.testing.assert_allclose(drawn.weights.reshape(3, n).sum(axis=1), evidence / evidence.sum(), rtol=1e-6)
    for states, start, (_, mean, covariance) in zip(drawn.states.reshape(3, n, 4), x, expected, strict=True):
        deviation = np.sqrt(np.diag(covariance))
        assert np.abs((states[:, :2].mean(axis=0) - mean) / deviation).max() < 4 / np.sqrt(n)
        spread = (np.cov(states[:, :2].T) - covariance) / np.outer(deviation, deviation)
        assert np.abs(spread).max() < 4 * np.sqrt(2 / n)
        # the velocity follows the prior
        off = (states[:, 2:] - start[2:]) / np.sqrt(MOTION.variances[2:])
        assert np.abs(off.mean(axis=0)).max() < 4 / np.sqrt(n)
        np.testing.assert_allclose(off.std(axis=0), 1, rtol=4 / np.sqrt(2 * n))
