"""Recordings of real processes: exact, readable however the run ends, and one sentence where it cannot be."""

import json
import signal
import socket
import sys
from collections import Counter

import pytest

from sim.replay.opening import open_recording
from sim.results.recorder import FILM

pytestmark = [
    pytest.mark.processes,
    pytest.mark.timeout(90),
    pytest.mark.skipif(sys.platform != "linux", reason="finds the processes of a run in /proc"),
]


def told(run):
    """Everything in a recording, by key."""
    recording = open_recording(run.out)
    found = [pair for frame in range(recording.frames) for pair in recording.at(frame, pictures=True)]
    recording.close()
    return found


def test_a_run_in_processes_is_recorded_as_it_is_without(launched, small):
    launched.run(small, "--record", "--json")
    code, stdout, stderr = launched.end()

    assert (code, stderr.strip()) == (0, "")
    assert launched.is_gone()
    found = told(launched)
    estimates = [data.decode() for key, data in found if key.endswith("/estimate")]
    assert sorted(estimates) == sorted(launched.lines("estimates"))
    assert [data.decode() for key, data in found if key.endswith("/truth")] == launched.lines("truth")
    pictures = Counter(key for key, _ in found if key.endswith("/preview"))
    assert sorted(pictures) == [f"dcpf/small/{name}/preview" for name in "ABCD"]
    # looking on changes no number of the comparison
    assert json.loads(stdout)["network"]["messages_per_frame"] == 24


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_what_was_recorded_stays_readable(launched, small, number):
    launched.run(small, "--frames", 2000, "--record")
    assert launched.reaches(10)

    launched.process.send_signal(number)

    code, _, stderr = launched.end()
    assert code == (-9 if number == signal.SIGKILL else 130)
    assert "Traceback" not in stderr
    assert launched.is_gone()
    found = told(launched)
    frames = [json.loads(data)["frame"] for key, data in found if key.endswith("/estimate")]
    assert max(frames) >= (5 if number == signal.SIGKILL else 10)
    assert any(key.endswith("/preview") for key, _ in found)
    assert any(key.endswith("/truth") for key, _ in found)


def test_a_folder_that_cannot_be_written_is_named(launched, small):
    launched.out.write_text("a file")
    launched.run(small, "--record")
    code, stdout, stderr = launched.end()
    assert (code, stdout) == (2, "")
    assert "the run cannot be recorded there" in stderr
    assert "Traceback" not in stderr
    assert launched.is_gone()


def test_a_page_whose_port_is_taken_leaves_nothing_behind(launched, small):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        launched.run(small, "--live", "--record", "--port", port)
        code, stdout, stderr = launched.end()
    assert (code, stdout) == (2, "")
    assert f"port {port}: Address already in use: end what uses it" in stderr
    assert launched.is_gone()
    assert not launched.out.exists()


def test_a_replay_is_stopped_in_order(launched, small, dcpf):
    launched.run(small, "--in-process")
    assert launched.end()[0] == 0
    assert not (launched.out / FILM).exists()
    replay = launched.beside(*dcpf, "replay", launched.out, "--listen", launched.router, "--loop")
    watch = launched.beside(*dcpf, "watch", "--json", "--connect", launched.router)
    line = watch.stdout.readline()
    assert line.strip() in launched.lines("estimates")

    replay.send_signal(signal.SIGINT)

    stdout, stderr = replay.communicate(timeout=10)
    assert (replay.returncode, stdout) == (130, "")
    assert "Traceback" not in stderr
