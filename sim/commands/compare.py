"""`dcpf compare`: many runs in process, paired by seed: a table, a plot, and the figures."""

import json
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import joblib
import typer
from rich.console import Console
from rich.table import Table

from sim.commands.shared import (
    AsJson,
    Frames,
    Overrides,
    length_text,
    progress_bar,
    read_scenario,
    split_overrides,
)
from sim.running.experiment import compare as compare_runs
from sim.running.experiment import run_many
from sim.running.recorder import RecordingError
from sim.running.results import length


def compare(
    scenarios: Annotated[list[Path], typer.Argument(metavar="SCENARIO...", help="Scenario files.")],
    runs: Annotated[int, typer.Option(help="Seeds of each scenario, from the scenario's on.", min=1)] = 10,
    frames: Frames = None,
    overrides: Overrides = None,
    jobs: Annotated[int | None, typer.Option(help="Processes; all cores by default.", min=1)] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the results.", show_default=False)] = None,
    as_json: AsJson = False,
) -> None:
    """Run scenarios with several seeds and compare DCPF, CPF and the single cameras."""
    folder = out or Path("runs") / f"compare-{datetime.now(UTC).strftime('%Y%m%dT%H%M%S.%fZ')}"
    given = [*split_overrides(overrides), *([("frames", str(frames))] if frames else [])]
    first = [read_scenario(path, overrides, frames=frames) for path in scenarios]
    _make(folder)
    report: dict[str, Any] = {}
    with progress_bar("runs", len(scenarios) * runs) as bar:
        for path, scenario in zip(scenarios, first, strict=True):
            seeds = range(scenario.seed, scenario.seed + runs)
            summaries = []
            for summary in run_many([path], given, seeds, jobs or joblib.cpu_count()):
                summaries.append(summary)
                bar(len(summaries) + runs * len(report))
            label = f"{scenario.name} ({scenario.preset})"
            if label in report:
                label = f"{path} ({scenario.preset})"
            report[label] = {**compare_runs(summaries), "summaries": summaries}
    try:
        (folder / "comparison.json").write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
        _plot(report, folder)
    except OSError as error:
        raise RecordingError(
            f"{folder}: cannot be written: {error.strerror}: free space, or name another --out"
        ) from error
    if as_json:
        sys.stdout.write(json.dumps(report) + "\n")
    else:
        _print(report, folder)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be made: {error.strerror}: name another --out") from error


def _plot(report: dict[str, Any], folder: Path) -> None:
    # Matplotlib takes its time to import, and only this needs it.
    from sim.pictures.comparison import plot_comparison
    from sim.pictures.plots import write_figure

    rows = [{**run, "scenario": label} for label, each in report.items() for run in each["summaries"]]
    write_figure(plot_comparison(rows), folder / "comparison")


def _print(report: dict[str, Any], folder: Path) -> None:
    console = Console(highlight=False)
    table = Table()
    table.add_column("scenario", no_wrap=True)
    table.add_column("over the runs", no_wrap=True)
    for heading in ("DCPF", "CPF", "best single", "DCPF/CPF", "ANEES"):
        table.add_column(heading, justify="right", no_wrap=True)
    for label, each in report.items():
        rmse, unit = length(each, "rmse"), each["unit"]
        for title, row, statistic in (
            ("median", label, "median"),
            ("worst", f"  {each['runs']} runs", "max"),
        ):
            table.add_row(
                row,
                title,
                *(_length(rmse[name], statistic, unit) for name in ("dcpf", "cpf", "best_single")),
                _figure(each["ratio_dcpf_cpf"], statistic),
                _figure(each["anees"]["dcpf"], statistic),
            )
    console.print(table)
    for label, each in report.items():
        lost = each["lost_fraction"]
        disagreement = _length(length(each, "disagreement"), "median", each["unit"])
        console.print(
            f"{label}: target lost in {lost['dcpf']:.0%} of the runs by DCPF, in {lost['cpf']:.0%} by CPF;"
            f" nodes disagree by {disagreement}",
            soft_wrap=True,
        )
        indefinite = each["indefinite_local_fraction"]
        if indefinite and indefinite["max"]:
            share = f"{indefinite['median']:.0%}"
            console.print(f"  Eq. 17's ratio was no density in {share} of the local results", soft_wrap=True)
    console.print(f"figures and plots in {folder}", soft_wrap=True)


def _length(values: dict[str, float] | None, statistic: str, unit: str) -> str:
    return length_text(None if values is None else values[statistic], unit)


def _figure(values: dict[str, float] | None, statistic: str) -> str:
    return "–" if values is None else f"{values[statistic]:.2f}"
