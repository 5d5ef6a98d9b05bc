"""A run of many cameras in one process: sense, predict, average, fuse, frame after frame.

Every node keeps its own estimate; nothing stands for the others. Rounds are products with matrices, sparse
ones of all but small networks (`network.averaging.matrices`), so that a frame costs O(C) for C cameras with
some neighbours each. Beside them runs the Kalman filter that has all measurements: the exact answer, as CPF
is in a run with pictures.

What does not depend on the frame before, measurements and errors, is worked out for a block of frames at
once: in a small network, a call of NumPy takes longer than what it is called for.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import ndtr
from threadpoolctl import threadpool_limits

from network.averaging import matrices
from network.streams import stream
from nodes.filtering.fusion import RULES
from nodes.filtering.gaussian import Information, Moments
from sim.assembly import Assembly
from sim.scenario.model import Scenario
from sim.scenario.parsing import ScenarioError
from sim.simulation.gaussians import GaussianEstimate, fused, predict, with_all
from sim.simulation.sensor import Sensors, measure

_BLOCK = 10_000
"""Cameras times frames in a block."""


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedFrames:
    """What a block of frames has brought.

    Attributes:
        truth: The target's states.
        nodes: Every node's estimates.
        exact: The Kalman filter's with all measurements.
        seen: Which cameras saw the target.
        residual: What the rounds left of the nodes' disagreement about what was sent.
    """

    truth: Float[np.ndarray, "T D"]
    nodes: Moments
    exact: Moments
    seen: Bool[np.ndarray, "T C"]
    residual: Float[np.ndarray, " T"]


def simulate(assembly: Assembly) -> Iterator[SimulatedFrames]:
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
    F, Q = motion.F, np.diag(motion.variances)
    network = scenario.network
    try:
        average = matrices.averaging(network.consensus, assembly.graph, network.iterations)
    except ValueError as error:
        raise ScenarioError(f"{scenario.name}: network.consensus: {error}") from error
    # of all nodes, and of the central one
    start, rows = assembly.start.moments, n_cameras + 1
    moments = Moments(np.tile(start.mean, (rows, 1)), np.tile(start.covariance, (rows, 1, 1)))
    yield _block(truth[:1], [moments], np.zeros((1, n_cameras), dtype=bool), np.zeros(1))
    n_block = frames_per_block(n_cameras)
    for first in range(1, n_frames, n_block):
        states = truth[first : first + n_block]
        # sense
        told, seen = _sense(scenario, sensors, states, first)
        estimates, sent, averages = [], [], []
        for matrix, vector in zip(told.matrix, told.vector, strict=True):
            # predict
            local = GaussianEstimate(predict(moments, F, Q), Information(matrix, vector), ridge)
            # average (Eq. 3); the central node's is exact: N times it is the sum
            packed = rule.pack(local, n_cameras)
            averaged = np.concatenate([average(packed[:-1]), packed[-1:] / n_cameras])
            # fuse
            moments = fused(local, rule.unpack(averaged, n_cameras, n_states))
            estimates.append(moments)
            sent.append(packed[:-1])
            averages.append(averaged[:-1])
        yield _block(states, estimates, seen, matrices.residual(np.array(averages), np.array(sent)))


def frames_per_block(n_cameras: int) -> int:
    """How many frames of so many cameras are in a block."""
    return max(_BLOCK // n_cameras, 1)


def _block(
    truth: Float[np.ndarray, "T D"],
    estimates: Sequence[Moments],
    seen: Bool[np.ndarray, "T C"],
    residual: Float[np.ndarray, " T"],
) -> SimulatedFrames:
    """Frames one after the other, the central node's estimates apart."""
    mean = np.array([each.mean for each in estimates])
    covariance = np.array([each.covariance for each in estimates])
    nodes = Moments(mean[:, :-1], covariance[:, :-1])
    # copies, which do not keep all the others
    exact = Moments(mean[:, -1].copy(), covariance[:, -1].copy())
    return SimulatedFrames(truth, nodes, exact, seen, residual)


def _sense(
    scenario: Scenario, sensors: Sensors, truth: Float[np.ndarray, "T D"], first: int
) -> tuple[Information, Bool[np.ndarray, "T C"]]:
    """All measurements of the frames from the first on; another camera more changes nobody else's."""
    target, n_frames, n_cameras = scenario.target, len(truth), len(sensors.K)
    middle = truth[:, : target.n_axes]
    if target.n_axes == 2:
        middle = np.hstack([middle, np.full((n_frames, 1), target.plane_height + target.height / 2)])
    draws = np.empty((n_frames, n_cameras, 3))
    for frame, row in enumerate(draws, start=first):
        stream(scenario.seed, "sensor", str(frame)).standard_normal(out=row)
    luck, noise = ndtr(draws[:, :, 0]), draws[:, :, 1:]
    told, seen = measure(sensors, middle, target.n_axes, scenario.sensor, luck, noise)
    return with_all(told), seen


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
    if not scenario.network.conditions.are_perfect:
        raise ScenarioError(
            f"{scenario.name}: network.conditions is set, and matrices lose and delay nothing: take it out,"
            " or use dcpf run"
        )
    if scenario.faults:
        raise ScenarioError(
            f"{scenario.name}: faults is set, and nothing goes wrong with matrices: take it out, or use"
            " dcpf run"
        )
