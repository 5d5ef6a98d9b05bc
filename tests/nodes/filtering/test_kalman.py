"""The filters against the exact answer: in the linear-Gaussian case it is the Kalman filter's.

The mean of n independent draws is off by N(0, P/n), so that n (m - m*)ᵀ P⁻¹ (m - m*) / D is 1 on average.
Weights, resampling and the filter's memory make it larger, by a factor that does not depend on n.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from nodes.filtering.fusion import FusionOptions, fuse, pack, propagate, unpack
from nodes.filtering.gaussian import Information, Moments, log_factor, moments
from nodes.filtering.local import local_filter
from nodes.filtering.motion import DynamicsOptions, autoregression, constant_velocity, predict
from nodes.filtering.particles import resample_if_degenerate, sample_gaussian
from nodes.filtering.sir import View, sir_step
from nodes.imaging.camera import look_at
from nodes.vision.observation import ObservationModel, ObservationOptions, Picture
from nodes.vision.target import TargetOptions

MOTION = constant_velocity(2, 0.1, DynamicsOptions(velocity_variance=0.04))
AUTOREGRESSION = autoregression(
    2, DynamicsOptions(model="autoregressive", position_variance=0.01, A=((1.6, 0.1), (0.0, 1.5)), B=-0.5)
)
START, START_DEVIATION = np.array([1.0, -2.0, 0.5, 0.3]), np.array([0.1, 0.1, 0.3, 0.3])
N_FRAMES, N_CAMERAS, THRESHOLD = 12, 4, 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Twin:
    """Measurements z ~ N(position, R) of every camera and frame, and the Kalman filter's answer to them."""

    measured: list[list[Information]]
    exact: list[Moments]


def twin(seed, motion):
    rng = np.random.default_rng([seed, 1])
    state = START + START_DEVIATION * rng.standard_normal(4)
    # each camera measures well across and badly along its own direction
    turned = [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in (0.0, 0.6, 1.4, 2.3)]
    covariances = [turn @ np.diag([0.1**2, 0.3**2]) @ turn.T for turn in turned]
    mean, covariance = START, np.diag(START_DEVIATION**2)
    H = np.eye(2, 4)
    measured, exact = [], []
    for _ in range(N_FRAMES):
        state = predict(state[None], motion, rng)[0]
        mean, covariance = motion.F @ mean, motion.F @ covariance @ motion.F.T + np.diag(motion.variances)
        measured.append([])
        for R in covariances:
            z = rng.multivariate_normal(state[:2], R)
            gain = covariance @ H.T @ np.linalg.inv(H @ covariance @ H.T + R)
            mean, covariance = mean + gain @ (z - H @ mean), (np.eye(4) - gain @ H) @ covariance
            measured[-1].append(Information(np.linalg.inv(R), np.linalg.solve(R, z)))
        exact.append(Moments(mean, covariance))
    return Twin(measured, exact)


def log_likelihoods(positions, measurement):
    return log_factor(positions, measurement, START[:2])


def position_sensor(measurement):
    """A camera whose log-likelihood is that of a position measurement."""

    class Sensor(ObservationModel):
        def log_likelihoods(self, _picture, positions, _appearance):
            return log_likelihoods(positions, measurement)

    camera = look_at("C", np.array([0.0, -5, 2]), np.zeros(3), 100.0, (16, 16), np.zeros(5))
    picture = Picture(np.zeros((16, 16, 3), np.uint8), np.ones(3))
    return View(Sensor(camera, TargetOptions(), ObservationOptions()), picture, None)


def run_sir(problem, motion, n, seed):
    rng = np.random.default_rng([seed, 2])
    particles = sample_gaussian(START, START_DEVIATION, n, rng)
    for measurements in problem.measured:
        views = [position_sensor(measurement) for measurement in measurements]
        particles, info = sir_step(particles, views, motion, THRESHOLD, rng)
        yield info.estimate


def run_fusion(problem, motion, n, seed, options):
    """C cameras with an exact average; the estimates of the first."""
    rngs = [np.random.default_rng([seed, 3, camera]) for camera in range(N_CAMERAS)]
    local_rngs = [np.random.default_rng([seed, 4, camera]) for camera in range(N_CAMERAS)]
    clouds = [sample_gaussian(START, START_DEVIATION, n, rng) for rng in rngs]
    own = [sample_gaussian(START, START_DEVIATION, n, rng) for rng in local_rngs]
    for measurements in problem.measured:
        predicted = [propagate(cloud, motion, rng) for cloud, rng in zip(clouds, rngs, strict=True)]
        if options.local_particles == "own":
            local_clouds = [propagate(cloud, motion, rng) for cloud, rng in zip(own, local_rngs, strict=True)]
        else:
            local_clouds = predicted
        results = [
            local_filter(cloud, log_likelihoods(cloud.positions, measurement))
            for cloud, measurement in zip(local_clouds, measurements, strict=True)
        ]
        own = [
            resample_if_degenerate(result.particles, THRESHOLD, rng)
            for result, rng in zip(results, local_rngs, strict=True)
        ]
        average = np.mean([pack(result, N_CAMERAS, options) for result in results], axis=0)
        fused = unpack(average, N_CAMERAS, 4, options)
        posteriors = [
            fuse(clouds[c], predicted[c], fused, motion, options, rngs[c]) for c in range(N_CAMERAS)
        ]
        yield moments(posteriors[0].states, posteriors[0].weights)
        clouds = [
            resample_if_degenerate(cloud, THRESHOLD, rng) for cloud, rng in zip(posteriors, rngs, strict=True)
        ]


def errors(run, n, seeds, motion=MOTION):
    """n (m - m*)ᵀ P⁻¹ (m - m*) / D and tr(P⁻¹ p) / D - 1, averaged over frames and seeds."""
    scaled, wider = [], []
    for seed in seeds:
        problem = twin(seed, motion)
        for found, exact in zip(run(problem, motion, n, seed), problem.exact, strict=True):
            off = found.mean - exact.mean
            scaled.append(n * off @ np.linalg.solve(exact.covariance, off) / 4)
            wider.append(np.trace(np.linalg.solve(exact.covariance, found.covariance)) / 4 - 1)
    return np.mean(scaled), np.mean(wider)


# About 2.5 times what eight seeds have; 100 / n is 5% of the Kalman filter's RMSE for n = 1000.
CASES = {
    FusionOptions(rule="net_information", proposal="optimal"): (130, 0.1),
    FusionOptions(rule="net_information", proposal="prior"): (150, 0.1),
    FusionOptions(rule="net_information", proposal="optimal", local_particles="own"): (130, 0.1),
    FusionOptions(rule="quadratic_fit", proposal="optimal"): (60, 0.1),
    FusionOptions(rule="quadratic_fit", proposal="prior"): (90, 0.1),
    FusionOptions(rule="eq17", proposal="prior", local_particles="own"): (300, 0.2),
    FusionOptions(rule="eq17", proposal="prior"): (300, 0.2),
    FusionOptions(rule="eq17", proposal="optimal"): (300, 0.2),
    FusionOptions(rule="hybrid"): (130, 0.1),
    FusionOptions(rule="icf"): (130, 0.1),
}


def _name(case):
    return f"{case.rule}-{case.proposal}-{case.local_particles}" if case in CASES else ""


@pytest.mark.parametrize(
    ("options", "limits"),
    CASES.items(),
    ids=_name,
)
def test_every_rule_and_proposal_is_near_the_kalman_filter(options, limits):
    error, wider = errors(lambda *run: run_fusion(*run, options), 1000, range(3))
    assert error < limits[0]
    assert abs(wider) < limits[1]


@pytest.mark.parametrize("motion", [MOTION, AUTOREGRESSION], ids=["velocity", "autoregression"])
def test_the_sir_filter_is_near_the_kalman_filter(motion):
    error, wider = errors(run_sir, 1000, range(3), motion)
    assert error < 100
    assert abs(wider) < 0.1


@pytest.mark.parametrize("options", CASES, ids=_name)
def test_so_they_are_where_the_state_is_the_last_two_positions(options):
    # its second half moves without noise: no proposal may divide by that
    error, wider = errors(lambda *run: run_fusion(*run, options), 1000, range(3), AUTOREGRESSION)
    assert error < CASES[options][0]
    assert abs(wider) < 0.2


@pytest.mark.parametrize("run", [run_sir, lambda *run: run_fusion(*run, FusionOptions())])
def test_the_error_falls_with_one_over_the_root_of_the_particles(run):
    few, _ = errors(run, 200, range(3))
    many, _ = errors(run, 1600, range(3))
    assert few / 4 < many < 2 * few  # both are already multiplied by n
