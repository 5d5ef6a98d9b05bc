"""`dcpf report`: a run as one page, to be read, sent and printed."""

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from sim.assembly import Assembly
from sim.commands.shared import progress_bar
from sim.results.provenance import sent_per_frame
from sim.results.recorder import FILM, RecordingError, as_run, expected_tracks, read_run, read_summary
from sim.results.results import Results, summarize
from sim.scenario.document import as_yaml


def report(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="Folder of a run, or a recording (.mcap).", show_default=False),
    ],
    out: Annotated[
        Path | None, typer.Option(help="The file.", show_default="report.html beside the run")
    ] = None,
) -> None:
    """Make a page of a run: figures, plots, what the cameras saw, what went over the network."""
    # matplotlib, the templates, and the formats of recordings are for this command only.
    from sim.report.page import FILE, write_page
    from sim.report.run import run_report

    with ExitStack() as stack:
        if run.suffix == ".mcap":
            from sim.recording.filmed import opened

            results, assembly = stack.enter_context(opened(run))
            _require_estimates(results, run)
            summary, scenario = _told(results), as_yaml(as_run(results.scenario))
            film, folder = run, run.parent
        else:
            results = read_run(run)
            assembly = Assembly(results.scenario)
            _require_estimates(results, run)
            # Of a run that was cut off, what its estimates tell.
            summary = read_summary(run) or summarize(results, processes=0)
            scenario = (run / "scenario.yaml").read_text(encoding="utf-8")
            film, folder = run / FILM, run
        bar = stack.enter_context(progress_bar("report: frames", results.scenario.frames))
        page = run_report(
            results,
            assembly,
            summary,
            scenario,
            film=film if film.is_file() else None,
            progress=bar,
        )
    path = out or folder / FILE
    try:
        write_page(page, path)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written: {error.strerror}: name another --out") from error
    Console(highlight=False).print(str(path), soft_wrap=True)


def _require_estimates(results: Results, run: Path) -> None:
    if not results.tracks:
        raise RecordingError(f"{run}: has no estimates yet: there is nothing to report")


def _told(results: Results) -> Mapping[str, Any]:
    """The summary of a run of which there is a recording and nothing else; it tells no totals if cut off."""
    summary = summarize(results, processes=0)
    if not results.statuses:
        return summary
    nodes = {node for _, node in expected_tracks(results.scenario)}
    died = sorted(nodes - results.statuses.keys())
    return {**summary, "died": died, "sent_per_frame": sent_per_frame(results)}
