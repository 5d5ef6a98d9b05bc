"""Simulated networks against exact averages and the Kalman filter, and the command."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

from network.streams import stream
from nodes.filtering.fusion import RULES
from nodes.filtering.gaussian import Moments
from nodes.filtering.motion import constant_velocity
from sim.assembly import Assembly
from sim.commands.app import app
from sim.scenario.loading import load_scenario
from sim.scenario.parsing import ScenarioError
from sim.simulation.sensor import Sensors, measure
from sim.simulation.simulation import simulate
from sim.simulation.summary import Simulated

HALL = Path(__file__).parents[3] / "scenarios" / "hall.yaml"
EXACT = (("network.graph", "ring"), ("network.consensus.algorithm", "finite_time"))


def frames(*overrides, cameras=9, n_frames=12):
    given = [("cameras.count", str(cameras)), ("frames", str(n_frames)), *overrides]
    return frames_of(load_scenario(HALL, given, rendered=False))


def frames_of(scenario):
    return [
        SimpleNamespace(
            truth=block.truth[index],
            nodes=Moments(block.nodes.mean[index], block.nodes.covariance[index]),
            exact=Moments(block.exact.mean[index], block.exact.covariance[index]),
            seen=block.seen[index],
            residual=block.residual[index],
        )
        for block in simulate(Assembly(scenario))
        for index in range(len(block.truth))
    ]


def kalman(scenario):
    """The textbook's filter, with one position measurement after the other."""
    assembly = Assembly(scenario)
    sensors = Sensors.of(list(assembly.cameras.values()))
    motion = constant_velocity(2, 1 / scenario.rate_hz, scenario.filter.dynamics)
    mean, P, H = assembly.start.mean, np.diag(assembly.start.deviation**2), np.eye(2, 4)
    yield mean, P
    for frame in range(1, scenario.frames):
        mean, P = motion.F @ mean, motion.F @ P @ motion.F.T + np.diag(motion.variances)
        middle = np.array([*assembly.truth[frame, :2], scenario.target.height / 2])
        draws = stream(scenario.seed, "sensor", str(frame)).standard_normal((len(sensors.K), 3))
        told, seen = measure(sensors, middle, 2, scenario.sensor, norm.cdf(draws[:, 0]), draws[:, 1:])
        for matrix, vector in zip(told.matrix[seen], told.vector[seen], strict=True):
            R = np.linalg.inv(matrix)
            gain = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
            mean = mean + gain @ (R @ vector - H @ mean)
            P = (np.eye(4) - gain @ H) @ P @ (np.eye(4) - gain @ H).T + gain @ R @ gain.T
        yield mean, P


def test_the_exact_estimate_is_the_kalman_filters():
    scenario = load_scenario(HALL, [("cameras.count", "9"), ("frames", "12")], rendered=False)
    for frame, (mean, covariance) in zip(frames_of(scenario), kalman(scenario), strict=True):
        np.testing.assert_allclose(frame.exact.mean, mean, atol=1e-7)
        np.testing.assert_allclose(frame.exact.covariance, covariance, atol=1e-7)


@pytest.mark.parametrize("rule", ["net_information", "quadratic_fit", "eq17", "hybrid", "icf"])
def test_with_exact_averages_every_node_is_the_kalman_filter(rule):
    found = frames(("fusion.rule", rule), *EXACT)
    assert any(frame.seen.any() for frame in found)
    for frame in found:
        np.testing.assert_allclose(frame.nodes.mean, np.tile(frame.exact.mean, (9, 1)), atol=1e-6)
        np.testing.assert_allclose(
            frame.nodes.covariance, np.tile(frame.exact.covariance, (9, 1, 1)), atol=1e-6
        )
        assert frame.residual < 1e-9


@pytest.mark.parametrize("algorithm", ["metropolis", "best_constant", "chebyshev", "ratio"])
def test_nodes_come_near_to_it_with_the_rounds(algorithm):
    few, many = (
        [
            np.abs(frame.nodes.mean - frame.exact.mean).max()
            for frame in frames(("network.consensus.algorithm", algorithm), ("network.iterations", rounds))
        ]
        for rounds in ("12", "120")
    )
    assert max(many) < 1e-3
    assert max(many) < max(few)


@pytest.mark.parametrize("rule", RULES)
def test_it_repeats_from_its_seed_and_not_from_another(rule):
    first, again, other = (frames(("fusion.rule", rule), ("seed", seed))[-1] for seed in ("3", "3", "4"))
    assert np.array_equal(first.nodes.mean, again.nodes.mean)
    assert not np.array_equal(first.nodes.mean, other.nodes.mean)


def test_a_camera_more_changes_no_other_cameras_luck():
    # hung nearly in one place, so that where they hang does not matter
    few, more = (frames(("cameras.spacing_m", "0.001"), cameras=n) for n in (90, 100))
    for one, other in zip(few[1:], more[1:], strict=True):
        assert (one.seen == other.seen[:90]).mean() > 0.95


@pytest.mark.parametrize("rule", RULES)
def test_the_exact_estimate_is_the_same_whatever_the_rule(rule):
    for frame, kalmans in zip(frames(("fusion.rule", rule)), frames(), strict=True):
        np.testing.assert_allclose(frame.exact.mean, kalmans.exact.mean, atol=1e-9)
        np.testing.assert_allclose(frame.exact.covariance, kalmans.exact.covariance, atol=1e-9)


@pytest.mark.parametrize("n_block", [1, 4, 11])
def test_how_many_frames_are_in_a_block_changes_nothing(monkeypatch, n_block):
    expected = frames()
    monkeypatch.setattr("sim.simulation.simulation.frames_per_block", lambda _: n_block)
    for frame, other in zip(frames(), expected, strict=True):
        assert np.array_equal(frame.seen, other.seen)
        np.testing.assert_allclose(frame.nodes.mean, other.nodes.mean, atol=1e-12)
        np.testing.assert_allclose(frame.nodes.covariance, other.nodes.covariance, atol=1e-12)
        assert frame.residual == pytest.approx(other.residual)


def test_covariance_intersection_claims_least():
    one, other = (frames(("fusion.rule", rule))[-1].nodes for rule in ("covariance_intersection", "icf"))
    assert (np.trace(one.covariance, axis1=1, axis2=2) > np.trace(other.covariance, axis1=1, axis2=2)).all()


def test_a_volume_is_simulated_as_well():
    found = frames(("target.space", "volume"), ("target.start.velocity", "[0.9, 0.9, 0]"), *EXACT)
    assert found[-1].nodes.mean.shape == (9, 6)
    np.testing.assert_allclose(found[-1].nodes.mean[0], found[-1].exact.mean, atol=1e-6)


def test_the_summary_is_what_the_frames_say():
    scenario = load_scenario(HALL, [("cameras.count", "9"), ("frames", "12")], rendered=False)
    found, told = Simulated(scenario), frames_of(scenario)
    for block in simulate(Assembly(scenario)):
        found.add(block)
    summary = found.summary(0.001, 1.0)
    off = np.array([frame.nodes.mean[:, :2] - frame.truth[:2] for frame in told[1:]])
    assert summary["rmse_m"]["dcpf"] == pytest.approx(np.sqrt((off**2).sum(axis=2).mean()))
    nees = [
        e @ np.linalg.inv(P[:2, :2]) @ e / 2
        for errors, frame in zip(off, told[1:], strict=True)
        for e, P in zip(errors, frame.nodes.covariance, strict=True)
    ]
    assert summary["anees"]["dcpf"] == pytest.approx(np.mean(nees))
    assert summary["seeing_cameras"] == np.mean([frame.seen.sum() for frame in told[1:]])
    assert summary["network"]["numbers_per_message"] == 5
    assert summary["timing"]["us_per_camera_and_frame"] == pytest.approx(1000 / 9)


@pytest.mark.parametrize(
    ("override", "says"),
    [
        (("network.consensus.algorithm", "event_triggered"), "no matrix does: choose another"),
        (("network.payload.encoding", "float32"), "round nothing: take float64"),
        (("filter.dynamics.model", "autoregressive"), "take constant_velocity"),
        (("network.conditions.loss", "0.3"), "conditions is set, and matrices lose and delay nothing: take"),
        (("network.conditions.partitions", "[{groups: [[C1]], first_frame: 4, frames: 2}]"), "take it out"),
        (("faults", "[{kind: kill, node: C1, frame: 4}]"), "faults is set, and nothing goes wrong with"),
    ],
)
def test_what_has_no_closed_form_is_refused(override, says):
    with pytest.raises(ScenarioError, match=says):
        frames(override)


def test_the_command_writes_numbers_and_a_picture(tmp_path):
    arguments = ["simulate", HALL, "--cameras", 30, "--frames", 5, "--out", tmp_path / "out", "--json"]
    result = CliRunner().invoke(app, [str(each) for each in arguments])
    assert result.exit_code == 0, result.stderr
    summary = json.loads(result.stdout)
    assert summary == json.loads((tmp_path / "out" / "summary.json").read_text())
    assert (summary["n_cameras"], summary["frames"]) == (30, 5)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "summary.json", "simulation.png", "simulation.svg",
    }  # fmt: skip


def test_a_list_of_cameras_has_no_count():
    scene = HALL.with_name("scene1.yaml")
    result = CliRunner().invoke(app, ["simulate", str(scene), "--cameras", "30"])
    assert result.exit_code == 2
    assert "cameras has no item count" in " ".join(result.stderr.split())
