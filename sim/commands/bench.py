"""`dcpf bench`: what the filter costs on this machine."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from sim.benchmarks.settings import SCENARIOS
from sim.commands.guard import guarded
from sim.commands.shared import AsJson, progress_bar

bench = typer.Typer(
    name="bench", help="Measure the filter on this machine.", no_args_is_help=True, rich_markup_mode=None
)
ScenarioFolder = Annotated[
    Path, typer.Option("--scenarios", help="Folder of the shipped scenarios.", show_default="this checkout's")
]


def filter_(folder: ScenarioFolder = SCENARIOS, as_json: AsJson = False) -> None:
    """Compare the filter with a loop of cv2.calcHist and cv2.compareHist over the particles."""
    from sim.benchmarks.filtering import bench_filter, n_rounds

    counted = 0

    def done() -> None:
        nonlocal counted
        counted += 1
        bar(counted)

    with progress_bar("bench filter", n_rounds()) as bar:
        report = bench_filter(folder, done)
    if as_json:
        sys.stdout.write(json.dumps(report) + "\n")
        return
    columns = [name for name in report["step"]["A"] if name != "loop_ms"]
    table = Table(title="times faster than the loop", title_justify="left")
    for heading in ("", "setting", *columns, "loop"):
        table.add_column(heading, justify="left" if heading in ("", "setting") else "right")
    for what, settings in report.items():
        for letter, figures in settings.items():
            ratios = [f"{figures[name]:.1f} x" for name in columns]
            table.add_row(what, letter, *ratios, f"{figures['loop_ms']:.2f} ms")
    Console(highlight=False).print(table)


bench.command("filter")(guarded(filter_))
