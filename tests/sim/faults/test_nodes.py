"""Nodes that fail in a run in one process: who notices, who goes on, and who comes back."""

import json

import numpy as np
import pytest

from network.wire.codec import encode_public
from network.wire.messages import EstimateMessage
from sim.assembly import Assembly
from sim.results.results import Results, summarize
from sim.running.in_process import run_in_process
from sim.scenario.loading import load_scenario

NAMES = ["A", "B", "C", "D"]
FEW = [("frames", "16"), ("baselines.single", "false")]


@pytest.fixture
def failing(small, told):
    """Runs the small scenario with faults."""

    def run(*faults, frames=16):
        overrides = [("frames", str(frames)), ("baselines.single", "false"), ("faults", json.dumps(faults))]
        results = Results(load_scenario(small, overrides))
        for message in told(small, *overrides):
            results.add(message)
        return results

    return run


def members(results, frame):
    return {
        name: "".join(results.tracks["dcpf", name][frame].members)
        for name in NAMES
        if frame in results.tracks["dcpf", name]
    }


def test_the_death_of_a_node_is_known_to_all_in_the_same_frame(failing):
    results = failing({"kind": "kill", "node": "C", "frame": 4})
    assert members(results, 3) == dict.fromkeys(NAMES, "ABCD")
    # A is no neighbour of C on the ring
    for frame in (4, 15):
        assert members(results, frame) == dict.fromkeys("ABD", "ABD")
        assert results.tracks["cpf", "central"][frame].members == ("A", "B", "D")
    told = summarize(results, processes=1)["members"]
    assert told["events"] == [{"frame": 4, "event": "lost", "node": "C"}]
    assert told["per_frame"]["A"] == [4] * 4 + [3] * 12
    assert told["per_frame"]["C"] == [4] * 4 + [None] * 12


@pytest.mark.parametrize("kind", ["hang", "restart"])
def test_who_was_away_comes_back_and_agrees(failing, kind):
    results = failing({"kind": kind, "node": "B", "frame": 4, "frames": 5})
    assert members(results, 4) == members(results, 8) == dict.fromkeys("ACD", "ACD")
    assert members(results, 9) == members(results, 15) == dict.fromkeys(NAMES, "ABCD")
    assert results.tracks["cpf", "central"][10].members == tuple(NAMES)
    means = {name: results.means(("dcpf", name))[15, :2] for name in NAMES}
    others = np.mean([means[name] for name in "ACD"], axis=0)
    assert np.linalg.norm(means["B"] - others) < 0.05
    events = summarize(results, processes=1)["members"]["events"]
    assert events == [
        {"frame": 4, "event": "lost", "node": "B"},
        {"frame": 9, "event": "back", "node": "B"},
    ]


def test_nobody_waits_for_those_who_never_come_back(failing):
    deaths = [{"kind": "kill", "node": name, "frame": 3 + i} for i, name in enumerate("BCD")]
    results = failing(*deaths)
    assert [members(results, frame)["A"] for frame in (2, 3, 4, 5, 15)] == ["ABCD", "ACD", "AD", "A", "A"]


def test_a_slow_node_in_lockstep_holds_the_others_up_and_is_waited_for(failing):
    slow = failing({"kind": "slow", "node": "B", "frame": 3, "seconds": 0.2})
    plain = failing()
    for name in NAMES:
        np.testing.assert_array_equal(slow.means(("dcpf", name)), plain.means(("dcpf", name)))


def test_a_node_slower_than_the_deadline_is_left_behind(failing):
    results = failing({"kind": "slow", "node": "B", "frame": 3, "seconds": 60, "frames": 4})
    assert members(results, 15)["A"] != ""
    assert len(results.tracks["dcpf", "A"]) == 16


def test_the_same_faults_give_the_same_run(small, told):
    faults = [
        {"kind": "restart", "node": "B", "frame": 4, "frames": 4},
        {"kind": "hang", "node": "D", "frame": 6, "frames": 3},
    ]
    overrides = [*FEW, ("faults", json.dumps(faults))]
    runs = [
        [encode_public(m) for m in told(small, *overrides) if isinstance(m, EstimateMessage)]
        for _ in range(2)
    ]
    assert runs[0] == runs[1]


@pytest.mark.parametrize("kind", ["kill", "hang"])
def test_the_central_node_goes_on_without_a_camera_also_where_no_camera_tracks(small, kind):
    fault = {"kind": kind, "node": "B", "frame": 4} | ({"frames": 5} if kind == "hang" else {})
    scenario = load_scenario(small, [*FEW, ("faults", json.dumps([fault]))])
    results = Results(scenario)
    for message in run_in_process(Assembly(scenario), with_cameras=False):
        results.add(message)
    members = [results.tracks["cpf", "central"][frame].members for frame in range(16)]
    assert members[3] == tuple(NAMES)
    assert members[4] == members[8] == ("A", "C", "D")
    assert members[10] == (("A", "C", "D") if kind == "kill" else tuple(NAMES))
