"""A run of many cameras in one process: sense, predict, average, fuse, frame after frame.

Every node keeps its own estimate; nothing stands for the others. Rounds are products with a sparse matrix
(`network.averaging.matrices`), so that a frame costs O(C) for C cameras with some neighbours each. Beside
them runs the Kalman filter that has all measurements: the exact answer, as CPF is in a run with pictures.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from jaxtyping import Bool, Float
from threadpoolctl import threadpool_limits

from network.averaging import matrices
from network.streams import stream
from nodes.filtering.fusion import RULES
from nodes.filtering.gaussian import Information, Moments, to_information, to_moments
from nodes.filtering.rules.rule import plus_on_position
from sim.assembly import Assembly
from sim.scenario.model import Scenario
from sim.scenario.parsing import ScenarioError
from sim.simulation.gaussians import GaussianEstimate, fused, predict, summed
from sim.simulation.sensor import Sensors, measure


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedFrame:
    """What a frame has brought.

    Attributes:
        truth: The target's state.
        nodes: Every node's estimate.
        exact: The Kalman filter's with all measurements.
        seen: Which cameras saw the target.
        residual: What the rounds left of the nodes' disagreement about what was sent.
    """

    truth: Float[np.ndarray, " D"]
    nodes: Moments
    exact: Moments
    seen: Bool[np.ndarray, " C"]
    residual: float


def simulate(assembly: Assembly) -> Iterator[SimulatedFrame]:
    """Simulates a scenario's network, from frame 0, the start, on.

    Raises:
        ScenarioError: The scenario asks for what has no closed form, or nobody knows the truth.
    """
    # As in runs; and threads that wait for each other over small matrices take longer than one.
    threadpool_limits(1)
    scenario = assembly.scenario
    _require_closed_form(scenario)
    truth = assembly.truth
    if truth is None:
        raise ScenarioError(f"{scenario.name} has no ground truth, which sensors need: give it one")
    if not np.isfinite(truth).all():
        unknown = int(np.flatnonzero(~np.isfinite(truth).all(axis=1))[0])
        raise ScenarioError(
            f"{scenario.name} has no ground truth in frame {unknown}, which sensors need: run fewer --frames"
        )
    sensors = Sensors.of(list(assembly.cameras.values()))
    n_cameras, (n_frames, n_states) = len(sensors.K), truth.shape
    rule, motion, ridge = RULES[scenario.fusion.rule], assembly.setup.motion, scenario.fusion.ridge
    network = scenario.network
    try:
        rounds = matrices.rounds(network.consensus, assembly.graph)
    except ValueError as error:
        raise ScenarioError(f"{scenario.name}: network.consensus: {error}") from error
    exact = assembly.start.moments
    nodes = Moments(np.tile(exact.mean, (n_cameras, 1)), np.tile(exact.covariance, (n_cameras, 1, 1)))
    yield SimulatedFrame(truth[0], nodes, exact, np.zeros(n_cameras, dtype=bool), 0.0)
    for frame in range(1, n_frames):
        # sense
        told, seen = _sense(scenario, sensors, truth[frame], frame)
        # predict
        local = GaussianEstimate(predict(nodes, motion), told, ridge)
        # average (Eq. 3)
        packed = rule.pack(local, n_cameras)
        (average,) = islice(rounds(packed), network.iterations, network.iterations + 1)
        # fuse
        nodes = fused(local, rule.unpack(average, n_cameras, n_states))
        exact = _updated(predict(exact, motion), summed(told), ridge)
        yield SimulatedFrame(truth[frame], nodes, exact, seen, matrices.residual(average, packed))


def _sense(
    scenario: Scenario, sensors: Sensors, state: Float[np.ndarray, " D"], frame: int
) -> tuple[Information, Bool[np.ndarray, " C"]]:
    """All measurements of a frame; another camera more changes nobody else's."""
    target, n_cameras = scenario.target, len(sensors.K)
    position = state[: target.n_axes]
    middle = (
        position if target.n_axes == 3 else np.array([*position, target.plane_height + target.height / 2])
    )
    luck = stream(scenario.seed, "sensor", "occlusion", str(frame)).random(n_cameras)
    noise = stream(scenario.seed, "sensor", "noise", str(frame)).standard_normal((n_cameras, 2))
    return measure(sensors, middle, target.n_axes, scenario.sensor, luck, noise)


def _updated(predicted: Moments, told: Information, ridge: float) -> Moments:
    """The Kalman filter's update in information form: p⁻¹ = r⁻¹ + Λ."""
    return to_moments(plus_on_position(to_information(predicted, ridge), told))


def _require_closed_form(scenario: Scenario) -> None:
    if scenario.target.space == "image":
        raise ScenarioError(f"{scenario.name} tracks in the image plane of one camera: there is no network")
    if scenario.filter.dynamics.model == "autoregressive":
        raise ScenarioError(
            f"{scenario.name}: filter.dynamics.model is autoregressive, whose covariances have no inverse:"
            " take constant_velocity"
        )
    if scenario.network.payload.encoding != "float64":
        raise ScenarioError(
            f"{scenario.name}: network.payload.encoding is {scenario.network.payload.encoding}, and matrices"
            " round nothing: take float64"
        )
