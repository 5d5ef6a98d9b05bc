"""`dcpf simd`: what a frame of the tracker costs on the emulated processor, beside the paper's figures."""

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from jaxtyping import UInt8
from rich.console import Console
from rich.table import Table

from network.streams import stream
from nodes.simd.pipeline import LINE_INTERVAL_US, VGA_LINES
from nodes.simd.report import PAPER_TOTAL_US, PAPER_US, PAPER_WORDS, FrameReport, Step
from nodes.simd.tracker import SimdTracker
from nodes.simd.tracker_options import TrackerOptions
from sim.commands.shared import AsJson, split_overrides, yes_no
from sim.scenario.complaints import validate
from sim.scenario.document import Document
from sim.scenario.parsing import ScenarioError

HEIGHT, WIDTH = 240, 256
"""The paper's picture."""


def simd(
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Set an option of the tracker, such as simd.arithmetic=fixed20.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="A picture of the line intervals, .svg and .png.", show_default=False),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Count a frame of the paper's tracker on the emulated SIMD processor, row by row of its tables."""
    options = read_options(overrides)
    report = frame_report(options)
    if out is not None:
        _draw(report, out)
    if as_json:
        sys.stdout.write(json.dumps(as_dictionary(report)) + "\n")
    else:
        _print(report)


def read_options(overrides: list[str] | None) -> TrackerOptions:
    """The paper's tracker with what the command line says instead.

    Raises:
        ScenarioError: An option is not as it must be.
    """
    document = Document(Path("the tracker"), {}, {(): "the tracker"})
    for key, value in split_overrides(overrides):
        document = document.with_value(key, value)
    return validate(document, TrackerOptions)


def frame_report(options: TrackerOptions) -> FrameReport:
    """Runs a frame and counts it: its instructions are the same whatever the picture shows.

    Raises:
        ScenarioError: The processor cannot run it.
    """
    images = [_picture(frame) for frame in range(2)]
    starts = [np.array([64.0 + 40 * target, 120.0]) for target in range(len(options.n_particles))]
    try:
        tracker = SimdTracker(options, stream(0, "simd"))
        tracker.begin(images[0], *starts)
        tracker.step(images[1])
    except ValueError as error:
        raise ScenarioError(str(error)) from error
    return tracker.report()


def _picture(frame: int) -> UInt8[np.ndarray, "H W 3"]:
    """Noise of all hues, so that there is a target anywhere."""
    return stream(0, "simd", f"picture {frame}").integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)


def as_dictionary(report: FrameReport) -> dict[str, Any]:
    """The report for machines."""
    laid_out = report.pipeline
    return {
        "clock_mhz": report.clock_mhz,
        "rows": {
            name: {"paper_us": PAPER_US[name], "counted_us": counted, "ratio": counted / PAPER_US[name]}
            for name, counted in report.microseconds.items()
        },
        "total_us": report.total_us,
        "total_ratio": report.total_us / PAPER_TOTAL_US,
        "cycles": report.cycles,
        "line_memory_words": report.n_words,
        "line_memory": dict(report.words),
        "external_reads": sum(cost.external_reads for cost in report.costs.values()),
        "external_writes": sum(cost.external_writes for cost in report.costs.values()),
        "pipeline": {
            "line_intervals": laid_out.lines,
            "storing_lines": laid_out.storing_lines,
            "storing_us": laid_out.storing_us,
            "reading_lines": laid_out.reading_lines,
            "reading_us": laid_out.reading_us,
            "elements_per_line": laid_out.elements,
            "rest_lines": laid_out.rest_lines,
            "share_of_frame": laid_out.share_of_frame,
            "rate_hz": laid_out.rate_hz,
        },
        "holds_30_fps": laid_out.holds,
    }


def _draw(report: FrameReport, out: Path) -> None:
    # Matplotlib takes its time to import, and only this needs it.
    from sim.pictures.line_intervals import plot_line_intervals
    from sim.pictures.plots import write_figure

    stored = report.costs[Step.BINNING].external_writes / report.pipeline.storing_lines
    write_figure(plot_line_intervals(report.pipeline, stored, VGA_LINES), out.with_suffix(""))


def _print(report: FrameReport) -> None:
    console = Console(highlight=False)
    table = Table("step (Table 1)")
    for heading in ("paper", "counted", "ratio"):
        table.add_column(heading, justify="right")
    for name, counted in report.microseconds.items():
        table.add_row(
            name, f"{PAPER_US[name]:.1f} µs", f"{counted:.1f} µs", f"{counted / PAPER_US[name]:.2f}"
        )
    total = report.total_us
    table.add_section()
    table.add_row("Total", f"{PAPER_TOTAL_US:.0f} µs", f"{total:.0f} µs", f"{total / PAPER_TOTAL_US:.2f}")
    console.print(table)
    memory = Table("line memory (Table 2)")
    memory.add_column("paper", justify="right")
    memory.add_column("allocated", justify="right")
    for name, n_words in PAPER_WORDS.items():
        memory.add_row(name, str(n_words), str(report.words.get(name, 0)))
    memory.add_section()
    memory.add_row("Total", str(sum(PAPER_WORDS.values())), str(report.n_words))
    console.print(memory)
    laid_out = report.pipeline
    console.print(
        f"{report.cycles:,} cycles at {report.clock_mhz:g} MHz, {laid_out.share_of_frame:.0%} of a frame",
        f"{laid_out.storing_lines} line intervals store,"
        f" {laid_out.storing_us / LINE_INTERVAL_US:.0%} of each used",
        f"{laid_out.reading_lines} read {laid_out.elements} elements each,"
        f" {laid_out.reading_us / LINE_INTERVAL_US:.0%} of each used; {laid_out.rest_lines} do the rest",
        f"holds 30 frames/s: {yes_no(laid_out.holds)} ({laid_out.lines} of {VGA_LINES} line intervals)",
        sep="\n",
        soft_wrap=True,
    )
