"""The command line: exit codes, one sentence for each mistake, and never a traceback."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from nodes import threads
from nodes.counting.build import load_kernel
from sim.commands import shared
from sim.commands.app import app
from sim.commands.inspect import scenario_schema
from sim.running import listener

SCENARIOS = Path(__file__).parents[2] / "scenarios"
BRIEF = ["--frames", "3", "--set", "filter.n_particles=10"]


@pytest.fixture
def dcpf(tmp_path, monkeypatch):
    """Runs a command in an empty folder, without footage."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("DCPF_CACHE", str(tmp_path / "cache"))

    def run(*arguments):
        result = CliRunner().invoke(app, [str(each) for each in arguments])
        assert isinstance(result.exception, SystemExit | None)
        return result

    return run


FOOTAGE = """
    {name: film, frames: 2, rate_hz: 10, footage: {name: swimcap}, target: {space: plane, height: 0.2},
     cameras: [{name: A, video: a.mp4}]}
    """

MISTAKES = {
    "no such file": (["run", "none.yaml"], "none.yaml: there is no such file: check the path"),
    "a folder": (["check", "."], ".: is a folder: name the scenario file in it"),
    "an empty file": (["check", "empty.yaml"], "empty.yaml: is empty"),
    "footage not fetched": (["run", "film.yaml"], "film.yaml: footage swimcap is not in"),
    "footage unknown": (["footage", "nope"], "there is no footage nope: choose one of swimcap"),
    "--set without =": (["run", "small.yaml", "--set", "frames"], "--set frames: has no ="),
    "--set of no number": (
        ["run", "small.yaml", "--set", "frames=x"],
        "--set frames=x: frames must be a whole",
    ),
    "--set of no key": (
        ["check", "small.yaml", "--set", "fliter.x=1"],
        "--set fliter.x=1: fliter is not a key",
    ),
    "a name that is no key": (["run", "small.yaml", "--name", "a b"], "'a b' cannot name a run or node"),
    "an unknown node": (["node", "Z", "small.yaml"], "has no node Z: its nodes are A, B, C, D, central"),
    "no place to listen": (["node", "A", "small.yaml", "--listen", "x"], "cannot listen on x"),
    "unknown by hand": (
        ["run", "small.yaml", "--by-hand", "Z"],
        "there is no node Z: the nodes are A, B, C, D",
    ),
    "by hand in process": (
        ["run", "small.yaml", "--in-process", "--by-hand", "A"],
        "no node is left to start",
    ),
    "an out that is a file": (
        ["run", "small.yaml", "--in-process", "--out", "empty.yaml"],
        "name another --out",
    ),
    "no run": (["clip", "."], ".: is not the folder of a run"),
    "a key with a hole": (["watch", "a//b"], "a//b is no key expression"),
    "no endpoint": (["watch", "--connect", "x"], "nothing answers at x"),
    "nothing to compare": (["compare"], "Missing argument"),
    "one of two is missing": (["compare", "small.yaml", "none.yaml"], "none.yaml: there is no such file"),
    "no such algorithm": (
        ["consensus", "small.yaml", "--algorithm", "gossip"],
        "there is no algorithm gossip: choose among constant, metropolis",
    ),
    "no such graph": (["consensus", "small.yaml", "--graph", "rings"], "network.graph must be 'ring'"),
    "a graph on which the paper's epsilon diverges": (
        [
            "consensus",
            "small.yaml",
            "--graph",
            "star",
            "--set",
            "preset=paper",
            "--set",
            "network.consensus.epsilon=0.34",
        ],
        "take it below 1/3 = 0.333",
    ),
    "nobody to average with": (
        ["consensus", str(SCENARIOS / "wica.yaml")],
        "wica has one camera, and nobody to average with",
    ),
    "no rounds": (
        ["consensus", "small.yaml", "--set", "network.iterations=0"],
        "network.iterations is 0, and nothing averages: give --rounds",
    ),
    "a negative seed": (["run", "small.yaml", "--seed", "-1"], "--seed"),
    "no command": (["frobnicate"], "No such command"),
}


@pytest.mark.parametrize(("arguments", "sentence"), MISTAKES.values(), ids=MISTAKES)
@pytest.mark.usefixtures("small")
def test_a_mistake_is_answered_in_a_sentence(dcpf, tmp_path, arguments, sentence):
    (tmp_path / "empty.yaml").touch()
    (tmp_path / "film.yaml").write_text(FOOTAGE, encoding="utf-8")

    result = dcpf(*arguments)

    assert result.exit_code == 2
    assert sentence in result.stderr
    assert "Traceback" not in result.stderr
    assert not result.stdout


def test_check_says_what_would_run(dcpf, small):
    facts = json.loads(dcpf("check", small, "--set", "network.graph=path", "--json").stdout)

    assert facts["scenario"] == "small"
    assert facts["cameras"] == {name: [160, 120] for name in "ABCD"}
    assert facts["graph"] == [["A", "B"], ["B", "C"], ["C", "D"]]
    assert facts["processes"] == 6
    assert facts["ground_truth"] is True
    assert len(facts["start"]) == 4


def test_check_is_a_table_for_people(dcpf, small):
    result = dcpf("check", small)

    assert result.exit_code == 0
    assert "is valid" in result.stdout
    assert "talks to B, D" in result.stdout


def test_schema_is_json(dcpf):
    assert json.loads(dcpf("schema").stdout) == scenario_schema()


def test_a_run_prints_its_summary_and_writes_its_folder(dcpf, small, tmp_path):
    result = dcpf("run", small, "--in-process", *BRIEF, "--seed", 4, "--name", "mine", "--json")

    summary = json.loads(result.stdout)
    (folder,) = (tmp_path / "runs").iterdir()
    assert result.exit_code == 0
    assert folder.name.startswith("mine-")
    assert json.loads((folder / "summary.json").read_text()) == summary
    assert (summary["scenario"], summary["seed"], summary["frames"]) == ("mine", 4, 3)


def test_a_run_is_a_table_for_people(dcpf, small):
    result = dcpf("run", small, "--in-process", *BRIEF, "--out", "run")

    assert "small, robust preset, seed 0, 3 frames, 1 processes" in result.stdout
    assert "DCPF (all nodes)" in result.stdout
    assert result.stdout.endswith("recorded in run\n")


def test_a_lost_target_fails_the_run_that_asks_for_it(dcpf, small):
    astray = ["--set", "target.start.position=[9, 9]", *BRIEF, "--in-process"]

    assert dcpf("run", small, *astray).exit_code == 0
    assert dcpf("run", small, *astray, "--fail-if-lost").exit_code == 1
    assert dcpf("run", small, *BRIEF, "--in-process", "--fail-if-lost").exit_code == 0


def test_compare_writes_figures_and_plots(dcpf, small, tmp_path):
    result = dcpf("compare", small, "--runs", 2, "--jobs", 1, *BRIEF, "--out", "out", "--json")

    report = json.loads(result.stdout)["small (robust)"]
    assert report["runs"] == 2
    assert [each["seed"] for each in report["summaries"]] == [0, 1]
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        *("comparison.json", "comparison.svg", "comparison.png", "cells.jsonl", "summary.csv", "timing.json"),
        *("parts", "report.html"),
    }


def test_consensus_says_that_it_leaves_conditions_out(dcpf, small):
    asked = ["consensus", small, "--algorithm", "metropolis", "--out", "out", "--json"]

    perfect, lossy = dcpf(*asked), dcpf(*asked, "--set", "network.conditions.loss=0.3")

    assert lossy.stdout == perfect.stdout
    assert "conditions is left out" not in perfect.stderr
    assert "conditions is left out: the algorithms are compared on perfect links" in lossy.stderr


def test_consensus_takes_two_eigenvalues_where_there_are_many(dcpf, small, monkeypatch):
    asked = ["consensus", small, "--graph", "path", "--out", "out", "--json"]
    whole = json.loads(dcpf(*asked, "--algorithm", "chebyshev").stdout)
    monkeypatch.setattr("network.graphs.spectrum.LARGEST_DENSE", 3)
    monkeypatch.setattr("sim.commands.consensus.LARGEST_DENSE", 3)

    two = json.loads(dcpf(*asked, "--algorithm", "chebyshev").stdout)
    every = dcpf(*asked)

    assert two["graph"]["eigenvalues"] == pytest.approx([whole["graph"]["eigenvalues"][i] for i in (0, -1)])
    assert (whole["graph"]["has_all_eigenvalues"], two["graph"]["has_all_eigenvalues"]) == (True, False)
    assert two["algorithms"]["chebyshev"]["rate"] == pytest.approx(whole["algorithms"]["chebyshev"]["rate"])
    assert every.exit_code == 2
    assert "all eigenvalues of 4 nodes, more than 3, take too long: choose an algorithm" in every.stderr


def test_nobody_who_reads_the_output_is_no_failure():
    command = [sys.executable, "-c", "from sim.commands import main; main()", "schema"]

    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert not process.stderr.read()

    assert process.returncode == 0


def test_an_output_that_is_full_is_told_in_a_sentence(small):
    command = [sys.executable, "-c", "from sim.commands import main; main()", "check", small, "--json"]

    with Path("/dev/full").open("wb") as full:
        result = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)

    assert result.returncode == 2
    assert (
        result.stderr.strip() == "dcpf: the output: No space left on device: make room, or name another place"
    )


def test_ctrl_c_before_the_command_has_begun_ends_it_without_a_word():
    command = [sys.executable, "-c", "from sim.commands import main; print(1, flush=True); main()", "schema"]

    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.readline()
        time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        assert not process.stderr.read()

    assert process.returncode in (-signal.SIGINT, 130, 0)


def test_watch_goes_on_until_it_is_ended(dcpf, monkeypatch):
    def interrupted(*_):
        yield None
        raise KeyboardInterrupt

    monkeypatch.setattr(listener, "estimates", interrupted)

    result = dcpf("watch", "--json")

    assert result.exit_code == 130
    assert result.stderr == "dcpf: interrupted\n"


def test_a_kernel_that_cannot_be_compiled_is_said_before_anything_starts(dcpf, small, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", "false")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "kernels"))
    load_kernel.cache_clear()
    for command in ("run", "check", "compare"):
        result = dcpf(command, small, "--set", "filter.backend=compiled")
        assert result.exit_code == 2
        assert "false could not compile count.c" in result.stderr
        assert "take filter.backend: fast" in result.stderr
    assert not (tmp_path / "runs").exists()


def test_threads_that_would_lose_are_said_not_to_be_used(dcpf, small):
    result = dcpf("check", small, "--set", "filter.threads=4")
    assert result.exit_code == 0
    assert "filter.threads is 4, and 1 will be used: fewer than 8,000" in result.stderr
    assert not dcpf("check", small).stderr


def test_threads_without_a_core_are_said_not_to_be_used(dcpf, small, monkeypatch):
    for module in (threads, shared):
        monkeypatch.setattr(module, "n_cores", lambda: 2)
    many = "--set", "filter.n_particles=100000"
    result = dcpf("check", small, "--set", "filter.threads=8", *many)
    assert "filter.threads is 8, and 2 will be used: this process may use no more cores" in result.stderr
    assert not dcpf("check", small, "--set", "filter.threads=2", *many).stderr


def test_bench_names_the_scenario_that_is_not_there(dcpf, tmp_path):
    result = dcpf("bench", "filter", "--scenarios", tmp_path)
    assert result.exit_code == 2
    assert "wica.yaml: there is no such file" in result.stderr


@pytest.mark.usefixtures("small")
def test_consensus_tells_how_each_algorithm_converges(dcpf, tmp_path):
    result = dcpf("consensus", "small.yaml", "--graph", "path", "--rounds", "12", "--out", "c", "--json")
    assert result.exit_code == 0
    told = json.loads(result.stdout)
    assert told["graph"]["edges"] == [["A", "B"], ["B", "C"], ["C", "D"]]
    assert list(told["algorithms"]) == ["constant", "metropolis", "best_constant", "chebyshev", "finite_time",
                                        "ratio", "event_triggered"]  # fmt: skip
    for each in told["algorithms"].values():
        assert len(each["residual"]) == 12
        assert {"residual", "rate", "theory", "bytes_per_round"} <= each.keys()
    assert told["algorithms"]["chebyshev"]["residual"][-1] == pytest.approx(5.1e-5, rel=0.01)
    assert json.loads((tmp_path / "c/consensus.json").read_text()) == told
    assert (tmp_path / "c/consensus.png").stat().st_size > 10_000


@pytest.mark.usefixtures("small")
def test_consensus_prints_a_table_of_what_was_asked_for(dcpf):
    result = dcpf("consensus", "small.yaml", "--algorithm", "ratio", "--algorithm", "chebyshev", "--out", "c")
    assert result.exit_code == 0
    assert "ring, 4 nodes, 3 rounds: 4 links, largest degree 2" in result.stdout
    assert result.stdout.index("ratio") < result.stdout.index("chebyshev")
    assert "metropolis" not in result.stdout
