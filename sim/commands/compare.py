"""`dcpf compare`: many runs, paired by seed, over any keys of the scenario: a table, figures, and files."""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from sim.commands.shared import (
    AsJson,
    Frames,
    Overrides,
    length_text,
    progress_bar,
    require_backend,
    split_overrides,
)
from sim.experiments.found.claims import Verdict
from sim.experiments.options import ExperimentOptions, StudyOptions, is_experiment
from sim.experiments.plan import Plan, make_plan, plan_experiment
from sim.experiments.sweeps import parse_sweep
from sim.results.recorder import RecordingError
from sim.results.results import length
from sim.scenario.document import read_document
from sim.scenario.parsing import ScenarioError


def compare(
    scenarios: Annotated[
        list[Path], typer.Argument(metavar="SCENARIO...", help="Scenario files, or one experiment file.")
    ],
    runs: Annotated[
        int | None,
        typer.Option(
            help="Seeds of each scenario, from the scenario's on; 10 by default.", min=1, show_default=False
        ),
    ] = None,
    frames: Frames = None,
    overrides: Overrides = None,
    sweeps: Annotated[
        list[str] | None,
        typer.Option(
            "--sweep",
            metavar="KEY=VALUES",
            help="Sweep any key of the scenario: network.iterations=1:20, filter.model_update.alpha=0:0.5:0.1"
            " or network.graph=ring,star. Several make a grid; the first is the figure's axis.",
        ),
    ] = None,
    jobs: Annotated[int | None, typer.Option(help="Processes; all cores by default.", min=1)] = None,
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Dask scheduler to compute on instead, such as tcp://10.0.0.1:8786."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the results; what is finished there is not computed again.", show_default=False
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run scenarios or an experiment with several seeds and compare DCPF, CPF and the single cameras."""
    # What computes and draws takes its time to import; --help does not wait for it.
    import joblib

    from sim.experiments.computing.engine import compute_here, compute_on_cluster
    from sim.experiments.computing.store import Store
    from sim.experiments.found.claims import judge
    from sim.experiments.found.reporting import report, write_files
    from sim.experiments.found.shown import fingerprint, is_shown
    from sim.experiments.run import compute_missing, findings_of
    from sim.pictures.experiment import write_figures
    from sim.report.experiment import experiment_report
    from sim.report.page import FILE, write_page

    given = [*split_overrides(overrides), *([("frames", str(frames))] if frames else [])]
    plan = _plan(scenarios, sweeps or [], given, runs)
    for group in plan.groups:
        require_backend(group.scenario_run)
    results = out or Path("runs") / f"{plan.options.name}-{datetime.now(UTC).strftime('%Y%m%dT%H%M%S.%fZ')}"
    store = Store(results / "parts")
    engine = (
        partial(compute_on_cluster, address=cluster)
        if cluster
        else partial(compute_here, n_jobs=jobs or joblib.cpu_count())
    )
    done: dict[str, Mapping[str, Any]] = {}
    try:
        compute_missing(plan, store, engine, done, partial(progress_bar, "parts of runs"))
    finally:
        # However it ends, the page shows what is there; what is whole has its files first.
        findings = findings_of(plan, done)
        verdicts = judge(findings)
        found = report(findings, verdicts)
        mark = fingerprint(found)
        if findings.groups and not is_shown(results / FILE, mark):
            with _writing(results):
                if not any(findings.missing.values()):
                    write_files(findings, found, verdicts, results)
                    write_figures(findings, results)
                write_page(experiment_report(findings, verdicts, mark), results / FILE)
    if as_json:
        sys.stdout.write(json.dumps(found) + "\n")
    else:
        _print({label: each for label, each in found.items() if label != "claims"}, verdicts, results)


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise RecordingError(
            f"{folder}: cannot be written: {error.strerror}: free space, or name another --out"
        ) from error


def _plan(paths: list[Path], sweeps: list[str], given: list[tuple[str, str]], runs: int | None) -> Plan:
    """What to compute: the experiment of a file, or one study over the scenarios and sweeps."""
    experiments = [document for document in map(read_document, paths) if is_experiment(document)]
    if experiments:
        document, *_ = experiments
        if len(paths) > 1:
            raise ScenarioError(f"{document.path}: is an experiment: give it alone, or scenarios only")
        if sweeps:
            raise ScenarioError(f"{document.path}: is an experiment with sweeps of its own: take --sweep out")
        return plan_experiment(document, given, runs)
    chosen = {sweep.key: sweep.values for sweep in map(parse_sweep, sweeps)}
    if len(chosen) < len(sweeps):
        raise ScenarioError("--sweep: a key is swept twice: give its values in one list")
    study = StudyOptions(plot="error" if chosen else "strips", sweep=chosen)
    options = ExperimentOptions(
        name="compare", runs=runs or 10, scenarios=tuple(map(str, paths)), studies={"comparison": study}
    )
    return make_plan(options, Path(), given, lambda _, key: f"--sweep {key}")


def _print(found: dict[str, Any], verdicts: Sequence[Verdict], folder: Path) -> None:
    # In a pipe, no line need fit a terminal.
    console = Console(highlight=False, width=None if sys.stdout.isatty() else 200)
    for settings, rows in groupby(found.items(), key=lambda item: tuple(item[1]["settings"])):
        _print_table(console, settings, dict(rows))
    for label, each in found.items():
        if not each["settings"]:
            _print_more(console, label, each)
    for verdict in verdicts:
        claim = f"{verdict.study}, {verdict.label}, {verdict.claim}"
        console.print(f"{claim}: {verdict.in_words}: {verdict.text}", soft_wrap=True)
    console.print(f"figures, plots and report.html in {folder}", soft_wrap=True)


def _print_table(console: Console, keys: tuple[str, ...], rows: dict[str, Any]) -> None:
    """A table of groups with the same swept keys: median and worst run, or the median alone of many."""
    table = Table()
    for heading in ("scenario", *keys, "over the runs"):
        table.add_column(heading, no_wrap=True)
    for heading in ("DCPF", "CPF", "best single", "DCPF/CPF", "ANEES"):
        table.add_column(heading, justify="right", no_wrap=True)
    for label, each in rows.items():
        name = label.removesuffix(", ".join(f"{key}={value}" for key, value in each["settings"].items()))
        statistics = [("median", name.strip(), "median"), ("worst", f"  {each['runs']} runs", "max")]
        for title, row, statistic in statistics[: 1 if keys else 2]:
            table.add_row(
                row,
                *each["settings"].values(),
                title,
                *(
                    _length(length(each, "rmse")[track], statistic, each["unit"])
                    for track in ("dcpf", "cpf", "best_single")
                ),
                _figure(each["ratio_dcpf_cpf"], statistic),
                _figure(each["anees"]["dcpf"], statistic),
            )
    console.print(table)


def _print_more(console: Console, label: str, each: dict[str, Any]) -> None:
    shares = {name.upper(): share for name, share in each["lost_fraction"].items() if share is not None}
    lost = ", in ".join(f"{share:.0%} by {name}" for name, share in shares.items())
    found = [f"target lost in {lost.replace(' by', ' of the runs by', 1)}"] if lost else []
    if len(each["summaries"][0]["cameras"]) > 1:
        disagreement = _length(length(each, "disagreement"), "median", each["unit"])
        found.append(f"nodes disagree by {disagreement}")
    if found:
        console.print(f"{label}: {'; '.join(found)}", soft_wrap=True)
    indefinite = each["indefinite_local_fraction"]
    if indefinite and indefinite["max"]:
        share = f"{indefinite['median']:.0%}"
        console.print(f"  Eq. 17's ratio was no density in {share} of the local results", soft_wrap=True)


def _length(values: dict[str, float] | None, statistic: str, unit: str) -> str:
    return length_text(None if values is None else values[statistic], unit)


def _figure(values: dict[str, float] | None, statistic: str) -> str:
    return "–" if values is None else f"{values[statistic]:.2f}"
