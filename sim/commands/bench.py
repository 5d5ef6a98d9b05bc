"""`dcpf bench`: what filter and network cost on this machine."""

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from nodes.threads import n_cores
from sim.benchmarks.settings import SCENARIOS
from sim.commands.bench_consensus import consensus
from sim.commands.guard import guarded
from sim.commands.shared import AsJson, progress_bar
from sim.results.recorder import RecordingError

bench = typer.Typer(
    name="bench",
    help="Measure this machine.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
ScenarioFolder = Annotated[
    Path, typer.Option("--scenarios", help="Folder of the shipped scenarios.", show_default="this checkout's")
]


@contextmanager
def counting_bar(what: str, total: int) -> Iterator[Callable[[], None]]:
    """A bar that is told only that one thing more is done."""
    counter = count(1)
    with progress_bar(what, total) as bar:
        yield lambda: bar(next(counter))


def make_folder(folder: Path) -> None:
    """Makes a folder for results.

    Raises:
        RecordingError: It cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be made: {error.strerror}: name another --out") from error


def filter_(folder: ScenarioFolder = SCENARIOS, as_json: AsJson = False) -> None:
    """Compare the filter with a loop of cv2.calcHist and cv2.compareHist over the particles."""
    from sim.benchmarks.filtering import bench_filter, n_rounds

    with counting_bar("bench filter", n_rounds()) as done:
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


def parallel(
    folder: ScenarioFolder = SCENARIOS,
    threads: Annotated[
        int | None, typer.Option(help="Threads, at most and by default all cores.", min=1, max=64)
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for a plot and the figures.")] = None,
    as_json: AsJson = False,
) -> None:
    """Compare the filter's steps, and a whole clip, by one thread and by several."""
    from sim.benchmarks.parallel import CLIP_PARTICLES, PARTICLES, bench_parallel

    if out is not None:
        make_folder(out)
    with counting_bar("bench parallel", len(PARTICLES) + len(CLIP_PARTICLES)) as done:
        report = bench_parallel(folder, min(threads or n_cores(), n_cores()), done)
    if out is not None:
        from sim.pictures.parallel import plot_parallel
        from sim.pictures.plots import write_figure

        (out / "parallel.json").write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
        write_figure(plot_parallel(report), out / "parallel")
    if as_json:
        sys.stdout.write(json.dumps(report) + "\n")
    else:
        _print_parallel(report)


def _print_parallel(report: dict[str, Any]) -> None:
    console, k = Console(highlight=False), report["threads"]
    table = Table(title=f"one thread and {k}, ms a frame", title_justify="left")
    for heading in ("particles", "likelihood", "", "resampling", "", "shuffle"):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in report["steps"]:
        cells = [f"{row['particles']:,}"]
        for step in ("likelihood", "resampling"):
            one, several = row["ms"][step]["sequential"], row["ms"][step]["parallel"]
            verdict = f"{one / several:.2f} x" if row["threads_used"][step] > 1 else "one used"
            cells += [f"{one:.3g}, {several:.3g}", verdict]
        table.add_row(*cells, f"{row['ms']['shuffle']['sequential']:.3g}")
    console.print(table)
    for n, rate in report["frames_per_s_by_particles"].items():
        console.print(
            f"the clip with {n:,} particles: {rate['sequential']:.1f} frames/s by one thread,"
            f" {rate['parallel']:.1f} by what {k} threads make of it",
            soft_wrap=True,
        )


bench.command("filter")(guarded(filter_))
bench.command("parallel")(guarded(parallel))
bench.command("consensus")(guarded(consensus))
