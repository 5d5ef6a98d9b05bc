"""Each fusion rule against a closed form: on Gaussians, without a single particle."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from network.averaging import matrices
from network.graphs.graph import ring
from nodes.filtering.fusion import RULES, FusionOptions, Posterior, fuse, left_of, pack, unpack
from nodes.filtering.gaussian import Information, Moments, moments, to_information
from nodes.filtering.local import LocalGaussians, local_filter
from nodes.filtering.motion import DynamicsOptions, constant_velocity, predict
from nodes.filtering.particles import sample_gaussian
from nodes.filtering.rules.rule import LocalEstimate, plus_on_position

MOTION = constant_velocity(2, 0.1, DynamicsOptions(velocity_variance=0.04))
POSTERIORS = ("naive", "covariance_intersection", "hybrid", "icf")
N, D = 5, 4
seeds = st.integers(0, 2**32 - 1)


@dataclass(frozen=True, slots=True, eq=False)
class Gaussians(LocalEstimate):
    """What local filters find where everything is linear and Gaussian, one or many at once."""

    predicted: Moments
    told: Information

    @property
    def before(self):
        return to_information(self.predicted, 1e-14)

    @property
    def measured(self):
        return self.told

    @property
    def after(self):
        return plus_on_position(self.before, self.measured)

    @property
    def posterior(self):
        P = np.linalg.inv(self.after.matrix)
        return Moments(np.matvec(P, self.after.vector), P)

    @property
    def fitted(self):
        return self.measured


def covariances(rng, n, size):
    A = rng.normal(size=(n, size, size))
    return A @ A.swapaxes(1, 2) + 0.1 * np.eye(size)


def gaussians(rng, n=N):
    measured = covariances(rng, n, 2)
    return Gaussians(
        Moments(rng.normal(size=(n, D)), covariances(rng, n, D)),
        Information(measured, rng.normal(size=(n, 2))),
    )


def one(many, index):
    return Gaussians(
        Moments(many.predicted.mean[index], many.predicted.covariance[index]),
        Information(many.measured.matrix[index], many.measured.vector[index]),
    )


@pytest.mark.parametrize("name", RULES)
@given(seed=seeds)
def test_many_nodes_at_once_are_as_each_by_itself(name, seed):
    rule, many = RULES[name], gaussians(np.random.default_rng(seed))
    packed = rule.pack(many, N)
    assert packed.shape == (N, rule.size(D))
    each = np.array([rule.pack(one(many, index), N) for index in range(N)])
    np.testing.assert_allclose(packed, each, rtol=1e-9)
    read, singly = rule.unpack(packed, N, D), [rule.unpack(row, N, D) for row in packed]
    for field in ("mean", "covariance") if isinstance(read, Moments) else ("vector", "matrix"):
        expected = np.array([getattr(answer, field) for answer in singly])
        np.testing.assert_allclose(getattr(read, field), expected, rtol=1e-7, atol=1e-9)


@given(seeds)
def test_the_naive_average_is_the_mean_of_means_and_of_covariances(seed):
    many = gaussians(np.random.default_rng(seed))
    found = RULES["naive"].unpack(RULES["naive"].pack(many, N).mean(axis=0), N, D)
    np.testing.assert_allclose(found.mean, many.posterior.mean.mean(axis=0))
    np.testing.assert_allclose(found.covariance, many.posterior.covariance.mean(axis=0), atol=1e-12)


@given(seeds)
def test_covariance_intersection_is_the_weighted_sum_of_informations(seed):
    many = gaussians(np.random.default_rng(seed))
    rule = RULES["covariance_intersection"]
    found = rule.unpack(rule.pack(many, N).mean(axis=0), N, D)
    weights = 1 / np.trace(many.posterior.covariance[:, :2, :2], axis1=1, axis2=2)
    weights /= weights.sum()
    matrix = np.einsum("c,cij->ij", weights, np.linalg.inv(many.posterior.covariance))
    vector = np.einsum("c,cij,cj->i", weights, np.linalg.inv(many.posterior.covariance), many.posterior.mean)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(matrix), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(found.mean, np.linalg.solve(matrix, vector), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("name", ["covariance_intersection", "naive"])
@given(seed=seeds)
def test_it_is_conservative_whatever_the_errors_have_in_common(name, seed):
    """p - E[e eᵀ] is positive semidefinite for any joint covariance of the cameras' errors."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(N * D, rng.integers(1, N * D + 1)))  # few columns: nearly everything in common
    joint = A @ A.T + 1e-3 * np.eye(N * D)
    blocks = np.array([joint[D * c : D * c + D, D * c : D * c + D] for c in range(N)])
    many = Gaussians(Moments(np.zeros((N, D)), blocks), Information(np.zeros((N, 2, 2)), np.zeros((N, 2))))
    rule = RULES[name]
    fused = rule.unpack(rule.pack(many, N).mean(axis=0), N, D).covariance
    # the fused estimate is Σ Gⱼ uⱼ, so that its error has covariance G joint Gᵀ
    if name == "naive":
        gains = [np.eye(D) / N] * N
    else:
        weights = 1 / np.trace(blocks[:, :2, :2], axis1=1, axis2=2)
        weights /= weights.sum()
        gains = [w * fused @ np.linalg.inv(P) for w, P in zip(weights, blocks, strict=True)]
    G = np.hstack(gains)
    left = np.linalg.eigvalsh(fused - G @ joint @ G.T)
    assert left[0] > -1e-6 * np.abs(fused).max()


def track(rule, rounds, n_frames=8, seed=0):
    """Nodes that predict, measure and fuse for some frames; and the Kalman filter with all measurements."""
    rng = np.random.default_rng(seed)
    L = matrices.metropolis_laplacian(ring([f"C{index}" for index in range(N)]))
    start, spread = rng.normal(size=D), np.diag(rng.uniform(0.1, 0.4, D))
    state = start.copy()
    exact = Moments(start, spread)
    nodes = Moments(np.tile(start, (N, 1)), np.tile(spread, (N, 1, 1)))
    F, Q = MOTION.F, np.diag(MOTION.variances)
    for _ in range(n_frames):
        state = predict(state[None], MOTION, rng)[0]
        measured = covariances(rng, N, 2)
        told = np.matvec(measured, state[:2]) + np.matvec(
            np.linalg.cholesky(measured), rng.normal(size=(N, 2))
        )
        # the Kalman filter
        predicted = Moments(F @ exact.mean, F @ exact.covariance @ F.T + Q)
        whole = plus_on_position(
            to_information(predicted, 1e-14), Information(measured.sum(axis=0), told.sum(axis=0))
        )
        P = np.linalg.inv(whole.matrix)
        exact = Moments(P @ whole.vector, P)
        # the nodes
        local = Gaussians(
            Moments(np.matvec(F, nodes.mean), F @ nodes.covariance @ F.T + Q), Information(measured, told)
        )
        packed = rule.pack(local, N)
        if rounds is None:
            average = np.tile(packed.mean(axis=0), (N, 1))
        else:
            values = matrices.linear(L, packed)
            for _ in range(rounds + 1):
                average = next(values)
        nodes = rule.unpack(average, N, D)
    return nodes, exact, state


@pytest.mark.parametrize("name", ["icf", "hybrid"])
@pytest.mark.parametrize("seed", range(3))
def test_with_exact_averages_it_is_the_centralised_kalman_filter(name, seed):
    nodes, exact, _ = track(RULES[name], None, seed=seed)
    np.testing.assert_allclose(nodes.mean, np.tile(exact.mean, (N, 1)), atol=1e-9)
    np.testing.assert_allclose(nodes.covariance, np.tile(exact.covariance, (N, 1, 1)), atol=1e-9)


@pytest.mark.parametrize("name", ["icf", "hybrid"])
def test_it_converges_to_the_kalman_filter_with_the_rounds(name):
    off = []
    for rounds in (2, 6, 18, 54):
        nodes, exact, _ = track(RULES[name], rounds)
        off.append(np.abs(nodes.mean - exact.mean).max())
    assert off[0] > off[1] > off[2] > off[3]
    assert off[3] < 1e-6


@pytest.mark.parametrize("rounds", [1, 3, 12])
def test_hybrid_consensus_and_icf_are_the_same_sum(rounds):
    (one_way, _, _), (other, _, _) = track(RULES["icf"], rounds), track(RULES["hybrid"], rounds)
    np.testing.assert_allclose(one_way.mean, other.mean, atol=1e-9)
    np.testing.assert_allclose(one_way.covariance, other.covariance, atol=1e-9)


def test_covariance_intersection_never_claims_more_than_the_kalman_filter_knows():
    nodes, exact, _ = track(RULES["covariance_intersection"], 54)
    assert (np.linalg.eigvalsh(nodes.covariance - exact.covariance) > 0).all()


def result(rng, n=400):
    particles = sample_gaussian(rng.normal(size=D), np.array([0.3, 0.2, 0.5, 0.4]), n, rng)
    return local_filter(particles, -0.5 * ((particles.positions - particles.positions[0]) ** 2).sum(axis=1))


@pytest.mark.parametrize("name", POSTERIORS)
def test_the_particles_are_drawn_from_the_fused_gaussian(name):
    rng = np.random.default_rng(1)
    options = FusionOptions(rule=name)
    local = result(rng, 20_000)
    fused = unpack(pack(local, 3, options), 3, D, options)
    assert isinstance(fused, Posterior)
    drawn = fuse(local.prior, local.prior, fused, MOTION, options, rng)
    found, expected = moments(drawn.states, drawn.weights), fused.moments
    deviation = np.sqrt(np.diag(expected.covariance))
    assert np.abs((found.mean - expected.mean) / deviation).max() < 4 / np.sqrt(20_000)
    spread = (found.covariance - expected.covariance) / np.outer(deviation, deviation)
    assert np.abs(spread).max() < 4 * np.sqrt(2 / 20_000)
    assert left_of(local.predicted, fused) < 1


@pytest.mark.parametrize("name", POSTERIORS)
def test_an_answer_that_is_no_density_leaves_the_prediction(name):
    rng = np.random.default_rng(2)
    options = FusionOptions(rule=name)
    local = result(rng)
    packed = pack(local, 3, options)
    fused = unpack(np.where(np.arange(len(packed)) == 0, -1e6, packed), 3, D, options)
    assert not fused.is_density
    assert fuse(local.prior, local.particles, fused, MOTION, options, rng) is local.particles
    assert left_of(local.predicted, fused) == 1


def test_a_local_result_tells_what_the_rules_ask_for():
    local = LocalGaussians(result(np.random.default_rng(3)), 1e-10)
    difference = local.after.matrix - local.before.matrix
    assert np.linalg.eigvalsh(local.measured.matrix)[0] >= 0
    assert difference.shape == (D, D)
    np.testing.assert_allclose(local.fitted.matrix, np.eye(2), atol=1e-6)


@pytest.mark.parametrize("name", ["hybrid", "icf"])
def test_rules_that_average_predictions_need_those_of_the_fusion_filter(name):
    with pytest.raises(ValueError, match="set local_particles to shared"):
        FusionOptions(rule=name, local_particles="own")
