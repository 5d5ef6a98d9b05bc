"""A scenario's faults in real processes: killed, stopped and started again, and the router as well."""

import json
import sys

import pytest

from network.wire.codec import encode_public
from network.wire.messages import EstimateMessage

pytestmark = [
    pytest.mark.processes,
    pytest.mark.timeout(120),
    pytest.mark.skipif(sys.platform != "linux", reason="finds the processes of a run in /proc"),
]

NAMES = ["A", "B", "C", "D"]


@pytest.fixture
def summary(launched, small):
    """Runs the small scenario with faults, at 10 frames a second, and reads its summary and its events."""

    def run(frames, *faults, pace="realtime", **network):
        keys = {"faults": json.dumps(faults), "baselines.single": "false"}
        keys |= {f"network.{key}": value for key, value in network.items()}
        more = [each for key, value in keys.items() for each in ("--set", f"{key}={value}")]
        launched.run(small, "--pace", pace, "--frames", frames, *more, "--json")
        code, stdout, stderr = launched.end(90)
        assert code == 0, stderr
        assert launched.is_gone()
        return json.loads(stdout), [json.loads(line) for line in launched.lines("events")]

    return run


def test_nodes_that_are_stopped_or_started_again_come_back(summary):
    found, events = summary(
        110,
        {"kind": "hang", "node": "B", "frame": 10, "frames": 20},
        {"kind": "restart", "node": "C", "frame": 45, "frames": 5},
    )
    assert found["died"] == []
    told = [(each["event"], each["node"]) for each in events]
    for event in (("wake", "B"), ("killed", "C"), ("start", "C")):
        assert event in told
    changes = [(each["event"], each["node"]) for each in found["members"]["events"]]
    assert changes == [("lost", "B"), ("back", "B"), ("lost", "C"), ("back", "C")]
    # in the end all are there again, count each other, and agree
    assert [found["members"]["per_frame"][name][-1] for name in NAMES] == [4] * 4
    assert found["disagreement_per_frame_m"][-1] < 0.05


def test_a_node_that_is_killed_on_purpose_is_no_accident_and_one_that_is_knocked_says_so(summary):
    kill = {"kind": "kill", "node": "B", "frame": 8}
    knock = {"kind": "miscalibrate", "node": "C", "frame": 20, "frames": 10, "yaw_deg": 5}
    found, events = summary(40, kill, knock, pace="lockstep")
    assert found["died"] == []
    assert ("killed", "B") in [(each["event"], each["node"]) for each in events]
    told = {"event": "knocked", "node": "C", "frame": 20, "frames": 10}
    assert told in events
    assert told in found["members"]["events"]
    assert [found["members"]["per_frame"][name][-1] for name in ("A", "C", "D")] == [3] * 3


def test_nodes_talk_to_each_other_while_the_router_is_away(summary):
    found, events = summary(60, {"kind": "restart_router", "frame": 10})
    assert found["died"] == []
    assert ("restart", "router") in [(each["event"], each["node"]) for each in events]
    assert found["network"]["late"] < 60
    assert [found["members"]["per_frame"][name][-1] for name in NAMES] == [4] * 4


@pytest.mark.parametrize(("pace", "frame"), [("lockstep", 5), ("realtime", 17)])
def test_nodes_that_end_while_the_router_is_away_are_not_taken_for_dead(summary, pace, frame):
    found, events = summary(20, {"kind": "restart_router", "frame": frame}, pace=pace)
    assert found["died"] == []
    assert ("restart", "router") in [(each["event"], each["node"]) for each in events]
    assert found["network"]["messages_per_frame"] == 24
    assert not {"died", "left"} & {each["event"] for each in events}


def of_central(lines):
    return [line for line in lines if json.loads(line)["estimator"] == "cpf"]


@pytest.mark.parametrize(("graph", "killed"), [("path", "B"), ("star", "A"), ("ring", "BCD")])
def test_a_camera_without_neighbors_keeps_its_central_node(summary, launched, small, told, graph, killed):
    faults = [{"kind": "kill", "node": name, "frame": 3 + i} for i, name in enumerate(killed)]
    summary(12, *faults, pace="lockstep", graph=graph, deadline_s=2)
    keys = {"frames": 12, "faults": json.dumps(faults), "network.graph": graph, "baselines.single": "false"}
    alone = told(small, *((key, str(value)) for key, value in keys.items()))
    expected = [encode_public(each).decode() for each in alone if isinstance(each, EstimateMessage)]
    assert of_central(launched.lines("estimates")) == of_central(expected)


def test_the_central_node_waits_for_a_camera_that_is_late_where_there_is_no_other(launched, small):
    camera = "{name: A, position: [-5, -2, 2.9], look_at: [0, 3, 0.8], focal_px: 120, size_px: [160, 120]}"
    slow = "{kind: slow, node: A, frame: 3, seconds: 2, frames: 1}"
    keys = (f"cameras=[{camera}]", f"faults=[{slow}]", "network.deadline_s=1")
    launched.run(small, *(each for key in keys for each in ("--set", key)))
    code, _, stderr = launched.end()
    assert code == 0, stderr
    told = map(json.loads, of_central(launched.lines("estimates")))
    assert [(each["frame"], each["members"]) for each in told] == [(frame, ["A"]) for frame in range(6)]


def test_who_hung_in_lockstep_comes_back_once_and_tells_nothing_of_what_it_has_missed(summary, launched):
    found, _ = summary(40, {"kind": "hang", "node": "B", "frame": 5, "frames": 10}, pace="lockstep")
    changes = [(each["event"], each["node"]) for each in found["members"]["events"]]
    assert changes == [("lost", "B"), ("back", "B")]
    per_frame = found["members"]["per_frame"]["B"]
    assert per_frame[7:14] == [None] * 7
    assert [found["members"]["per_frame"][name][-1] for name in NAMES] == [4] * 4
    assert json.loads(of_central(launched.lines("estimates"))[-1])["members"] == NAMES


def test_who_hung_past_the_end_tells_nothing_any_more(summary):
    found, _ = summary(20, {"kind": "hang", "node": "B", "frame": 5, "frames": 90}, pace="lockstep")
    assert found["died"] == []
    assert found["members"]["per_frame"]["B"][7:] == [None] * 13
