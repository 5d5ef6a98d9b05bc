"""What can happen to a run: interruptions, deaths, silence. It never hangs and leaves nothing behind."""

import json
import os
import signal
import sys

import pytest

from sim.results.recorder import read_run

pytestmark = [
    pytest.mark.processes,
    pytest.mark.timeout(90),
    pytest.mark.skipif(sys.platform != "linux", reason="finds the processes of a run in /proc"),
]

FOR_LONG = ("--frames", 2000)
SURVIVORS = ("A", "C", "D")


def last_frames(run, estimator):
    """The last frame that each node has estimated."""
    messages = [json.loads(line) for line in run.lines("estimates")]
    return {each["node"]: each["frame"] for each in messages if each["estimator"] == estimator}


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)])
def test_a_launcher_that_ends_takes_everybody_along(launched, small, number, code):
    launched.run(small, *FOR_LONG)
    assert launched.reaches(3)
    assert len(launched.processes()) == 6

    launched.process.send_signal(number)

    found, stdout, stderr = launched.end()
    assert (found, stdout) == (code, "")
    assert "Traceback" not in stderr
    assert launched.is_gone()
    assert read_run(launched.out).frames_done > 3
    assert not (launched.out / "summary.json").exists()


def test_an_impatient_end_at_the_start_leaves_nothing_either(launched, small):
    launched.run(small, *FOR_LONG)
    while not launched.processes():
        pass
    for number in (signal.SIGTERM, signal.SIGINT):
        launched.process.send_signal(number)

    code, _, stderr = launched.end()

    assert code == 130
    assert "Traceback" not in stderr
    assert launched.is_gone()


def test_a_camera_that_dies_is_told_and_the_others_go_on(launched, small):
    launched.run(small, "--frames", 120, "--json")
    assert launched.reaches(3)

    os.kill(launched.node("B"), signal.SIGKILL)

    code, stdout, stderr = launched.end()
    assert code == 1
    assert "node B died (exit code -9)" in stderr
    frames = last_frames(launched, "dcpf")
    assert 3 <= frames["B"] < 119
    assert {name: frames[name] for name in SURVIVORS} == dict.fromkeys(SURVIVORS, 119)
    assert last_frames(launched, "cpf") == {"central": 119}
    events = [json.loads(line) for line in launched.lines("events")]
    assert {"event": "died", "node": "B", "exit_code": -9} in events
    assert any(event["event"] == "lost" and event["node"] == "B" for event in events)
    # the estimates after its death are of those that are left
    last = json.loads(launched.lines("estimates")[-1])
    assert last["frame"] == 119
    of_a = [json.loads(line) for line in launched.lines("estimates")]
    members = {
        each["frame"]: each["members"] for each in of_a if (each["node"], each["estimator"]) == ("A", "dcpf")
    }
    assert members[0] == ["A", "B", "C", "D"]
    assert "B" not in members[119]
    # what a dead node has not told is not counted
    summary = json.loads(stdout)
    assert summary["died"] == ["B"]
    assert summary["network"]["bytes_per_frame"]["dcpf"] > 0
    assert launched.is_gone()


def test_a_camera_that_stands_still_holds_nobody_up_for_ever(launched, small):
    launched.run(small, "--frames", 60, "--set", "network.deadline_s=2", "--json")
    assert launched.reaches(3)

    os.kill(launched.node("B"), signal.SIGSTOP)

    code, stdout, stderr = launched.end()
    assert code == 1
    assert json.loads(stdout)["died"] == ["B"]
    assert "node B is heard of no more" in stderr
    assert {name: last_frames(launched, "dcpf")[name] for name in SURVIVORS} == dict.fromkeys(SURVIVORS, 59)
    assert launched.is_gone()


def test_without_its_host_a_run_ends(launched, small):
    launched.run(small, *FOR_LONG)
    assert launched.reaches(3)

    os.kill(launched.node("host"), signal.SIGKILL)

    code, stdout, stderr = launched.end()
    assert (code, stdout) == (1, "")
    assert "the host of the run's processes ended" in stderr
    assert launched.is_gone()
    assert read_run(launched.out).frames_done > 3


def test_a_disk_that_fills_up_ends_the_run_with_a_sentence(launched, small):
    launched.out.mkdir()
    (launched.out / "estimates.jsonl").symlink_to("/dev/full")

    launched.run(small, *FOR_LONG)

    code, stdout, stderr = launched.end()
    assert (code, stdout) == (2, "")
    assert "cannot be recorded there: No space left on device" in stderr
    assert launched.is_gone()
