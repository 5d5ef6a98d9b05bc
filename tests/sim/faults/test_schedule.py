"""Faults as a list: who is away when, what is ordered when, and what cannot be."""

import json
import signal

import pytest

from sim.faults.options import HangOptions, KillOptions, RestartOptions, RestartRouterOptions, SlowOptions
from sim.faults.orders import Orders
from sim.faults.schedule import absences, slowness_s
from sim.scenario.loading import load_scenario
from sim.scenario.parsing import ScenarioError

KILL = KillOptions(kind="kill", node="A", frame=9)
RESTART = RestartOptions(kind="restart", node="B", frame=3, frames=4)
HANG = HangOptions(kind="hang", node="C", frame=5, frames=2)
ROUTER = RestartRouterOptions(kind="restart_router", frame=6)
SLOW = SlowOptions(kind="slow", node="D", frame=2, seconds=0.5, frames=3)


def test_who_is_away_when():
    found = [
        (each.node, each.begin, each.end, each.forgets) for each in absences([KILL, RESTART, HANG, SLOW])
    ]
    assert found == [("B", 3, 7, True), ("C", 5, 7, False), ("A", 9, None, True)]


def test_slowness_adds_up_and_ends():
    assert [slowness_s([SLOW, SLOW], "D", frame) for frame in (1, 2, 4, 5)] == [0, 1, 1, 0]
    assert slowness_s([SLOW], "A", 2) == 0


def test_orders_are_given_once_and_no_node_is_started_before_its_process_has_ended():
    orders = Orders([KILL, RESTART, HANG, ROUTER])
    assert orders.excuses("B")
    assert not orders.excuses("D")
    assert orders.due(6) == []
    assert orders.due(7) == [("restart", "router"), ("wake", "C")]
    assert orders.killed("B", -signal.SIGKILL).end == 7
    assert orders.due(8) == [("start", "B")]
    assert orders.due(9) == []
    assert not orders.excuses("B")
    # an end of its own is no fault of the scenario
    assert orders.killed("A", 1) is None
    assert orders.killed("A", -signal.SIGKILL).end is None
    assert orders.close() == []


def test_at_the_end_who_is_stopped_goes_on():
    assert Orders([HANG, RESTART]).close() == [("wake", "C")]


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ({"kind": "kill", "node": "Z", "frame": 2}, "kill of Z, which is no camera: name one of A, B, C, D"),
        ({"kind": "kill", "node": "A", "frame": 6}, "at frame 6: the run ends with frame 5"),
        ({"kind": "kill", "node": "A", "frame": 0}, "faults"),
        ({"kind": "vanish", "node": "A", "frame": 2}, "vanish"),
        ({"kind": "hang", "node": "A", "frame": 2, "frames": 0}, "frames"),
    ],
)
def test_what_cannot_be_is_refused(small, fault, says):
    with pytest.raises(ScenarioError, match=says):
        load_scenario(small, [("faults", json.dumps([fault]))])
