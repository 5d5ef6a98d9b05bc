"""`dcpf compare`: the same files however they are computed, nothing computed twice, and its mistakes."""

import csv
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from distributed import LocalCluster

from sim.experiments.computing import engine

from .conftest import BRIEF

SWEEP = ["--sweep", "network.iterations=1:2", "--runs", "2", *BRIEF]
OF_THE_MACHINE = {"timing.json", "time.svg", "time.png"}


def files(folder):
    """What a command has written, without what depends on the machine."""
    return {
        path.name: path.read_bytes()
        for path in folder.iterdir()
        if path.is_file() and path.name not in OF_THE_MACHINE
    }


def test_a_sweep_has_a_line_for_every_setting_and_seed(compare, small):
    result = compare(small, *SWEEP, "--jobs", 1, "--out", "out", "--json")

    report = json.loads(result.stdout)
    assert list(report) == [f"small (robust) network.iterations={t}" for t in (1, 2)]
    cells = [json.loads(line) for line in Path("out/cells.jsonl").read_text().splitlines()]
    assert [(cell["settings"]["network.iterations"], cell["seed"]) for cell in cells] == [
        ("1", 0),
        ("1", 1),
        ("2", 0),
        ("2", 1),
    ]
    assert all(len(cell["errors_m"]["dcpf"]) == 2 for cell in cells)
    with Path("out/summary.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["estimator"] for row in rows] == ["dcpf", "cpf", "best single"] * 2
    # CPF knows nothing of rounds: the same runs, not similar ones.
    assert rows[1]["rmse_mean"] == rows[4]["rmse_mean"]
    assert rows[0]["rmse_mean"] != rows[3]["rmse_mean"]


@pytest.mark.processes
def test_one_job_two_jobs_and_a_cluster_write_equal_files(compare, small):
    with LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as cluster:
        on_cluster = compare(small, *SWEEP, "--cluster", cluster.scheduler_address, "--out", "cluster")
    here = compare(small, *SWEEP, "--jobs", 1, "--out", "one")
    in_two = compare(small, *SWEEP, "--jobs", 2, "--out", "two")

    assert [on_cluster.exit_code, here.exit_code, in_two.exit_code] == [0, 0, 0]
    assert files(Path("one")) == files(Path("two")) == files(Path("cluster"))


def test_what_is_finished_is_not_computed_again(compare, small, monkeypatch):
    first = compare(small, *SWEEP, "--jobs", 1, "--out", "out", "--json")
    before = files(Path("out"))
    parts = sorted(Path("out/parts").iterdir())
    # One is lost, one was cut short.
    parts[0].unlink()
    parts[1].write_text(parts[1].read_text()[:100])
    computed = []
    compute = engine.compute
    monkeypatch.setattr(
        engine, "compute", lambda part, code: computed.append(part.key) or compute(part, code)
    )

    second = compare(small, *SWEEP, "--jobs", 1, "--out", "out", "--json")

    assert sorted(computed) == [parts[0].stem, parts[1].stem]
    assert second.stdout == first.stdout
    assert files(Path("out")) == before


def test_a_page_that_shows_it_all_is_not_drawn_again(compare, small):
    def times():
        return {path.name: path.stat().st_mtime_ns for path in Path("out").iterdir() if path.is_file()}

    first = compare(small, *SWEEP, "--jobs", 1, "--out", "out", "--json")
    before = times()

    second = compare(small, *SWEEP, "--jobs", 1, "--out", "out", "--json")

    assert second.stdout == first.stdout
    assert times() == before
    # other figures, or no page: all is drawn
    compare(small, *SWEEP, "--runs", 1, "--jobs", 1, "--out", "out")
    assert all(drawn > before[name] for name, drawn in times().items())
    Path("out/report.html").unlink()
    compare(small, *SWEEP, "--runs", 1, "--jobs", 1, "--out", "out")
    assert Path("out/report.html").exists()


def test_parts_are_shared_between_settings_that_they_do_not_depend_on(compare, small):
    compare(small, *SWEEP, "--jobs", 1, "--out", "out")

    # Two seeds of two numbers of rounds, and CPF once a seed.
    assert len(list(Path("out/parts").iterdir())) == 2 * 2 + 2


@pytest.mark.processes
def test_an_interruption_keeps_what_is_finished_and_leaves_no_process(small, tmp_path):
    command = [sys.executable, "-m", "sim", "compare", str(small), "--runs", "200", "--jobs", "2", *BRIEF]
    out = tmp_path / "out"

    with subprocess.Popen(
        [*command, "--out", str(out)], stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        until = time.monotonic() + 60
        while not list(out.glob("parts/*.json")) and time.monotonic() < until:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=30)

    assert process.returncode == 130
    assert told.strip().endswith("dcpf: interrupted")
    assert "Traceback" not in told
    kept = list(out.glob("parts/*.json"))
    assert 0 < len(kept) < 400
    assert all(json.loads(path.read_text())["tracks"] for path in kept)
    until = time.monotonic() + 10
    while (left := session(process.pid)) and time.monotonic() < until:
        time.sleep(0.05)
    assert not left


def session(leader):
    """The living processes of a session."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, of = stat.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue  # it has ended meanwhile
        if int(of) == leader and state != "Z":
            found.append(stat.parent.name)
    return found


def test_an_experiment_has_its_figures_its_claims_and_its_page(compare, tiny):
    result = compare(tiny, "--frames", 3, "--jobs", 1, "--out", "out")

    assert result.exit_code == 0
    studies = ["rounds", "graphs", "ways", "frames", "bytes", "time", "strips"]
    figures = {f"{name}.{kind}" for name in [*studies, "tiny-robust"] for kind in ("svg", "png")}
    others = {
        "comparison.json",
        "cells.jsonl",
        "summary.csv",
        "timing.json",
        "claims.md",
        "parts",
        "report.html",
    }
    assert {path.name for path in Path("out").iterdir()} == figures | others
    claims = json.loads(Path("out/comparison.json").read_text())["claims"]
    assert [(each["label"], each["claim"]) for each in claims] == [
        ("small (robust)", claim) for claim in ("flat", "within", "noisier")
    ]
    text = Path("out/claims.md").read_text()
    assert all(each["text"] in text for each in claims)
    assert "network.iterations" in result.stdout


MISTAKES = {
    "no values": (["small.yaml", "--sweep", "frames"], "--sweep frames: has no key and ="),
    "a key elsewhere": (
        ["small.yaml", "--sweep", "filter.alpha=0,1"],
        "filter.alpha is not a key of the scenario: did you mean filter.model_update.alpha?",
    ),
    "a key misspelt": (["small.yaml", "--sweep", "network.iteration=1"], "did you mean network.iterations?"),
    "a range backwards": (["small.yaml", "--sweep", "frames=5:2"], "frames=5:2: 5:2 is empty"),
    "a key twice": (
        ["small.yaml", "--sweep", "frames=3", "--sweep", "frames=4"],
        "a key is swept twice",
    ),
    "a value that is none": (["small.yaml", "--sweep", "frames=x"], "frames must be a whole number"),
    "too many cameras": (["small.yaml", "--sweep", "cameras=3:5"], "has 4 cameras, not 5"),
    "an experiment and more": (["tiny.yaml", "small.yaml"], "tiny.yaml: is an experiment: give it alone"),
    "an experiment and a sweep": (
        ["tiny.yaml", "--sweep", "frames=3"],
        "sweeps of its own: take --sweep out",
    ),
    "nobody there": (["small.yaml", "--cluster", "tcp://127.0.0.1:9"], "no Dask scheduler answers there"),
}


@pytest.mark.usefixtures("tiny")
@pytest.mark.parametrize(("arguments", "sentence"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_one_sentence(compare, monkeypatch, arguments, sentence):
    monkeypatch.setattr(engine, "_CONNECT_S", 1)

    result = compare(*arguments)

    assert result.exit_code == 2
    assert sentence in result.stderr
    assert result.stderr.strip().count("\n") == 0


def test_workers_with_another_program_are_refused(compare, small, monkeypatch):
    monkeypatch.setattr(engine, "code_version", lambda: "another")

    result = compare(small, *SWEEP, "--jobs", 1)

    assert result.exit_code == 2
    assert "the workers run another version of dcpf" in result.stderr


@pytest.mark.parametrize(
    ("baselines", "sentence"),
    [
        ("true", "target lost in 0% of the runs by DCPF, in 0% by CPF; nodes disagree"),
        ("false", "target lost in 0% of the runs by DCPF; nodes disagree"),
    ],
)
def test_nothing_is_said_of_a_filter_that_did_not_run(compare, small, baselines, sentence):
    given = [*BRIEF, "--set", f"baselines.cpf={baselines}", "--runs", 1, "--jobs", 1, "--out", "out"]

    result = compare(small, *given)

    assert result.exit_code == 0
    assert sentence in result.stdout
