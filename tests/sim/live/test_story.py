"""What the page is told, without page and network: errors, boxes, particles, nodes that come and go."""

import json
from pathlib import Path

import numpy as np
import pytest

from network.wire.messages import EstimateMessage, PreviewMessage, StatusMessage, TruthMessage
from nodes.vision.target import project_boxes
from sim.assembly import Assembly
from sim.live.nodes import NodeStates
from sim.live.setting import setting
from sim.live.story import Story
from sim.results.results import Results
from sim.running.in_process import run_in_process
from sim.scenario.loading import load_scenario

WICA = Path(__file__).parents[3] / "scenarios" / "wica.yaml"


@pytest.fixture
def assembly(small):
    return Assembly(load_scenario(small))


def told_by(story, messages):
    return [event for each in messages for event in story.take(each, 0.0)]


def of_kind(events, kind):
    return [event for event in events if event["type"] == kind]


def test_errors_are_those_of_the_results_whatever_comes_first(assembly):
    messages = [m for m in run_in_process(assembly) if not isinstance(m, StatusMessage)]
    results = Results(assembly.scenario)
    for message in messages:
        results.add(message)
    for order in (messages, messages[::-1]):
        story = Story(assembly, recorded=False)
        errors = of_kind(told_by(story, order), "error")
        assert len(errors) == 9 * 6
        for event in errors:
            if event["frame"] > 0:
                expected = results.errors((event["estimator"], event["node"]))[event["frame"] - 1]
                assert event["error"] == pytest.approx(expected, abs=1e-4)
        # who comes later is told the same
        (history,) = of_kind(story.so_far(), "history")
        later = {(e["estimator"], e["node"], f, v) for e in history["errors"] for f, v in e["errors"]}
        assert later == {(e["estimator"], e["node"], e["frame"], e["error"]) for e in errors}
        assert len(history["truth"]) == 6
        json.dumps(story.so_far(), allow_nan=False)


def test_boxes_are_in_the_pictures_of_those_that_they_concern(assembly):
    story = Story(assembly, recorded=False)
    target = assembly.scenario.target
    for message in (m for m in run_in_process(assembly) if isinstance(m, EstimateMessage)):
        (event,) = of_kind(story.take(message, 0.0), "estimate")
        expected = {"dcpf": [message.node], "cpf": ["A", "B", "C", "D"], "single": []}[message.estimator]
        assert sorted(event["boxes_px"]) == expected
        for name, box in event["boxes_px"].items():
            projected = project_boxes(message.mean[None, :2], target, assembly.cameras[name])[0]
            np.testing.assert_allclose(box, projected, atol=0.051)
        rim = np.array(event["ellipse"]) - message.mean[:2]
        covariance = message.covariance[:2, :2]
        far = np.sqrt(np.einsum("ij,jk,ik->i", rim, np.linalg.inv(covariance), rim))
        # two deviations, each coordinate to the millimetre
        millimetre = 0.00071 / np.sqrt(np.linalg.eigvalsh(covariance)[0])
        np.testing.assert_allclose(far, 2, atol=millimetre)


def test_particles_are_shown_where_the_camera_sees_them(assembly):
    story = Story(assembly, recorded=False)
    points = np.array([[0.0, 1.0], [0.3, 2.0], [400.0, 0.0]])
    event = story.picture(PreviewMessage("small", "A", 3, 0.3, points, b""))
    expected, _ = assembly.cameras["A"].project(np.column_stack([points, np.zeros(3)]))
    np.testing.assert_allclose(event["particles"], expected[:2], atol=0.051)
    assert story.picture(PreviewMessage("small", "Z", 3, 0.3, points, b"")) is None
    assert story.picture(PreviewMessage("small", "A", 3, 0.3, np.zeros((2, 3)), b"")) is None


def test_what_does_not_belong_to_the_run_tells_nothing(assembly):
    story = Story(assembly, recorded=False)
    strange = {"run": "small", "time_s": 0.0, "members": (), "visible": True, "lost": False}
    strange |= {"ess": 1.0, "iterations": 1}
    wide = np.zeros(6), np.eye(6)
    flat = np.zeros(4), np.eye(4)
    for node, frame, (mean, covariance) in (("A", 6, flat), ("Z", 1, flat), ("A", 1, wide)):
        message = EstimateMessage(
            node=node, estimator="dcpf", frame=frame, mean=mean, covariance=covariance, **strange
        )
        assert story.take(message, 0.0) == []
    assert story.take(TruthMessage("small", 1, 0.1, np.zeros(6), {}), 0.0) == []
    assert story.take(StatusMessage("Z", "running", 0, {}, {}), 0.0) == []
    assert story.see("Z", here=True) == []


def test_nodes_come_die_and_return():
    states = NodeStates(["A", "B"])
    assert [event["state"] for event in states.events()] == ["waiting", "waiting"]
    assert states.see("A", here=True, frame=0)[0]["state"] == "alive"
    assert states.see("A", here=False, frame=7)[0] | {"bytes_per_s": {}} == {
        "type": "node", "node": "A", "state": "lost", "since": 7, "returned": False, "bytes_per_s": {},
    }  # fmt: skip
    back = states.see("A", here=True, frame=9)[0]
    assert (back["state"], back["since"], back["returned"]) == ("alive", 9, True)
    for said, state in (("done", "done"), ("failed", "failed")):
        states.see("B", here=True, frame=0)
        states.take(StatusMessage("B", said, 5, {}, {}), 0.0)
        assert states.see("B", here=False, frame=5)[0]["state"] == state


def test_bytes_a_second_follow_from_two_statuses():
    def says(**sent):
        return StatusMessage("A", "running", 0, {"bytes": sent}, {})

    states = NodeStates(["A"])
    assert states.take(says(consensus=1000), 10.0)[0]["bytes_per_s"] == {}
    told = states.take(says(consensus=3000, pixels=500), 12.0)[0]
    assert told["bytes_per_s"] == {"consensus": 1000, "pixels": 250}
    # a recording that was turned back tells nothing new
    assert states.take(says(consensus=100), 13.0)[0]["bytes_per_s"] == told["bytes_per_s"]


@pytest.mark.parametrize(
    "overrides", [(), (("target.space", "volume"), ("target.start.velocity", "[0.0, 1.5, 0.0]"))]
)
def test_the_setting_is_plain_and_holds_everybody(small, overrides):
    told = setting(Assembly(load_scenario(small, overrides)), recorded=True)
    json.dumps(told, allow_nan=False)
    assert [camera["name"] for camera in told["cameras"]] == ["A", "B", "C", "D"]
    area = told["ground"]["area_m"]
    low, high = np.array(area["low"]), np.array(area["high"])
    for camera in told["ground"]["cameras"].values():
        assert (low < camera["position_m"]).all()
        assert (camera["position_m"] < high).all()
    assert len(told["ground"]["edges"]) == 4


def test_in_the_image_plane_there_are_pixels_and_no_ground():
    assembly = Assembly(load_scenario(WICA, [("frames", "2"), ("filter.n_particles", "50")]))
    story = Story(assembly, recorded=False)
    assert story.so_far()[0]["unit"] == "px"
    assert "ground" not in story.so_far()[0]
    for message in run_in_process(assembly, watched=True):
        if isinstance(message, PreviewMessage):
            shown = np.array(story.picture(message)["particles"])
            np.testing.assert_allclose(shown, message.particles, atol=0.051)
        else:
            events = story.take(message, 0.0)
            json.dumps(events, allow_nan=False)
