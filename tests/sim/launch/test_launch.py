"""Runs in real processes: the same to the last bit as in one, heard from outside, and started by hand."""

import json
import signal
import socket
from pathlib import Path

import pytest

from sim.assembly import Assembly
from sim.results.recorder import Recorder
from sim.running.in_process import run_in_process
from sim.scenario.loading import load_scenario

pytestmark = [pytest.mark.processes, pytest.mark.timeout(90)]

ROOT = Path(__file__).parents[3]
SUMMARY_KEYS = {
    "rmse_m": {"dcpf", "cpf", "single", "dcpf_per_node"},
    "lost": {"dcpf", "cpf", "single"},
    "anees": {"dcpf", "cpf"},
    "network": {"iterations", "messages_per_frame", "bytes_per_frame", "late", "refused"},
    "timing": {"first_estimate_s", "frames_per_s", "local_filter_ms", "consensus_round_ms"},
}


def recorded_in_process(folder, path, *overrides):
    """The folder of the same run in this process."""
    scenario = load_scenario(path, overrides)
    with Recorder(folder, scenario) as recorder:
        for message in run_in_process(Assembly(scenario)):
            recorder.add(message)
    return folder


def test_a_grid_of_sixteen_cameras_is_the_same_in_processes_as_in_one(launched, tmp_path):
    hall, brief = ROOT / "scenarios" / "hall.yaml", {"baselines.single": "false", "filter.n_particles": "30"}
    settings = [each for key, value in brief.items() for each in ("--set", f"{key}={value}")]
    launched.run(hall, "--frames", 4, *settings, "--json")
    code, stdout, _ = launched.end(60)
    assert code == 0
    assert launched.is_gone()
    summary = json.loads(stdout)
    assert summary["processes"] == 18
    assert summary["network"]["messages_per_frame"] == 2 * 24 * 12  # links both ways, rounds
    alone = recorded_in_process(tmp_path / "alone", hall, ("frames", "4"), *brief.items())
    assert (launched.out / "estimates.jsonl").read_bytes() == (alone / "estimates.jsonl").read_bytes()


def test_bad_links_are_the_same_in_processes_as_in_one(launched, tmp_path, small):
    bad = {"loss": "0.3", "duplicates": "0.2", "delay_s": "0.1"}
    keys = {f"network.conditions.{key}": value for key, value in bad.items()}
    settings = [each for key, value in keys.items() for each in ("--set", f"{key}={value}")]
    launched.run(small, *settings, "--json")

    code, stdout, stderr = launched.end()

    assert code == 0, stderr
    summary = json.loads(stdout)
    assert summary["network"]["lost"] > 0
    assert summary["network"]["duplicated"] > 0
    assert summary["network"]["late"] == 0
    alone = recorded_in_process(tmp_path / "alone", small, *keys.items())
    assert (launched.out / "estimates.jsonl").read_bytes() == (alone / "estimates.jsonl").read_bytes()


def test_parts_of_a_network_go_on_apart_and_find_each_other_again(launched, small):
    parted = "[{groups: [[A, B], [C, D]], first_frame: 4, frames: 4}]"
    settings = ("--set", f"network.conditions.partitions={parted}", "--set", "network.iterations=12")
    launched.run(small, "--frames", 16, *settings, "--json")

    code, stdout, stderr = launched.end()

    assert code == 0, stderr
    members = json.loads(stdout)["members"]["per_frame"]
    assert [members[name][7] for name in "ABCD"] == [2] * 4
    assert [members[name][-1] for name in "ABCD"] == [4] * 4


def test_scene_1_is_the_same_in_processes_as_in_one_and_is_heard_from_outside(launched, dcpf, tmp_path):
    scene = ROOT / "scenarios" / "scene1.yaml"
    watch = launched.beside(*dcpf, "watch", "--json", "--connect", launched.router)
    example = (ROOT / "examples" / "subscribe.py").read_text(encoding="utf-8")
    assert "tcp/127.0.0.1:7447" in example
    subscriber = launched.beside(dcpf[0], "-u", "-c", example.replace("tcp/127.0.0.1:7447", launched.router))

    launched.run(scene, "--frames", 8, "--set", "filter.n_particles=30", "--json")
    code, stdout, stderr = launched.end()

    assert (code, stderr.strip()) == (0, "")
    assert launched.is_gone()
    # the numbers, to the last bit
    alone = recorded_in_process(tmp_path / "alone", scene, ("frames", "8"), ("filter.n_particles", "30"))
    for file in ("estimates.jsonl", "truth.jsonl"):
        assert (launched.out / file).read_bytes() == (alone / file).read_bytes()
    # the summary
    summary = json.loads(stdout)
    assert summary == json.loads((launched.out / "summary.json").read_text())
    for group, keys in SUMMARY_KEYS.items():
        assert keys <= summary[group].keys()
    assert summary["processes"] == 6
    assert summary["died"] == []
    assert summary["network"]["messages_per_frame"] == 96
    assert summary["network"]["bytes_per_frame"] == {"dcpf": 6144, "cpf": 4 * (24 + 640 * 480 * 3)}
    # the folder
    assert {path.stem for path in (launched.out / "logs").iterdir()} >= {"C1", "C2", "C3", "C4", "central"}
    events = [json.loads(line) for line in launched.lines("events")]
    assert {e["node"] for e in events if e["event"] == "seen"} == {"C1", "C2", "C3", "C4", "central"}
    # whoever was there before has heard it all
    heard = said_until_ended(watch)
    assert set(heard) == set(launched.lines("estimates"))
    lines = said_until_ended(subscriber)
    assert len(lines) == len(heard)
    assert {tuple(line.split()[:3]) for line in lines} == {
        (str(each["frame"]), each["estimator"], each["node"]) for each in map(json.loads, heard)
    }


def test_in_real_time_frames_come_at_their_time_and_late_watchers_hear_the_rest(launched, dcpf, small):
    launched.run(small, "--frames", 35, "--pace", "realtime", "--json")
    assert launched.reaches(1)
    watch = launched.beside(*dcpf, "watch", "--json", "--connect", launched.router, "dcpf/small/B/estimate")

    code, stdout, _ = launched.end()

    assert code == 0
    assert json.loads(stdout)["timing"]["frames_per_s"] == pytest.approx(10, abs=1.5)
    heard = [json.loads(line) for line in said_until_ended(watch)]
    assert {each["node"] for each in heard} == {"B"}
    assert max(each["frame"] for each in heard) == 34
    assert min(each["frame"] for each in heard) > 0


def test_nodes_may_be_started_by_hand(launched, dcpf, small, tmp_path):
    ports = {name: free_port() for name in ("A", "B", "C", "D", "central")}
    endpoints = ", ".join(f"{name}: tcp/127.0.0.1:{port}" for name, port in ports.items())
    agreed = ["--set", f"network.endpoints={{{endpoints}}}", "--name", "mine"]
    heard_by_nodes = [*agreed, "--set", f"network.router={launched.router}"]
    before = launched.beside(*dcpf, "node", "A", small, *heard_by_nodes)
    launched.run(small, *agreed, "--by-hand", "A", "--by-hand", "central")
    after = launched.beside(*dcpf, "central", small, *heard_by_nodes)

    code, _, stderr = launched.end()

    assert code == 0
    assert [line.split(":")[0] for line in stderr.split("\n") if line] == [
        "waiting for A",
        "waiting for central",
    ]
    for node in (before, after):
        assert node.communicate(timeout=10) == ("", "")
        assert node.returncode == 0
    alone = recorded_in_process(tmp_path / "alone", small, ("name", "mine"))
    assert (launched.out / "estimates.jsonl").read_bytes() == (alone / "estimates.jsonl").read_bytes()


def test_a_port_that_is_taken_is_named(launched, small):
    with socket.create_server(("127.0.0.1", int(launched.router.rpartition(":")[2]))):
        launched.run(small)
        code, stdout, stderr = launched.end()

    assert (code, stdout) == (2, "")
    assert "Traceback" not in stderr
    assert f"{launched.router}: end what uses it, or choose another endpoint" in stderr
    assert launched.is_gone()


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def said_until_ended(process):
    """What a process that listens for ever has written so far; it is ended by Ctrl-C."""
    process.send_signal(signal.SIGINT)
    stdout, _ = process.communicate(timeout=10)
    return stdout.splitlines()
