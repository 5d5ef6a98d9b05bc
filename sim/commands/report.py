"""`dcpf report`: a run as one page, to be read, sent and printed."""

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from sim.assembly import Assembly
from sim.commands.shared import progress_bar
from sim.running.recorder import FILM, RecordingError, read_run, read_summary
from sim.running.results import summarize


def report(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option(help="The file.", show_default="report.html in the folder")
    ] = None,
) -> None:
    """Make a page of a run: figures, plots, what the cameras saw, what went over the network."""
    # matplotlib and the templates are for this command only.
    from sim.report.page import FILE, write_page
    from sim.report.run import run_report

    results = read_run(run)
    if not results.tracks:
        raise RecordingError(f"{run}: has no estimates yet: there is nothing to report")
    # Of a run that was cut off, what its estimates tell.
    summary = read_summary(run) or summarize(results, processes=0)
    film = run / FILM
    path = out or run / FILE
    with ExitStack() as stack:
        bar = stack.enter_context(progress_bar("report: frames", results.scenario.frames))
        page = run_report(
            results,
            Assembly(results.scenario),
            summary,
            (run / "scenario.yaml").read_text(encoding="utf-8"),
            film=film if film.is_file() else None,
            progress=bar,
        )
    try:
        write_page(page, path)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written: {error.strerror}: name another --out") from error
    Console(highlight=False).print(str(path), soft_wrap=True)
