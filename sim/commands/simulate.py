"""`dcpf simulate`: thousands of cameras in one process, with a sensor model in place of pictures."""

import json
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from sim.assembly import Assembly
from sim.commands import BEGAN_S
from sim.commands.shared import (
    AsJson,
    Frames,
    Overrides,
    ScenarioPath,
    Seed,
    length_text,
    progress_bar,
    read_scenario,
)
from sim.results.recorder import RecordingError


def simulate(
    scenario: ScenarioPath,
    cameras: Annotated[
        int | None, typer.Option(help="Cameras of the scenario's layout.", min=1, show_default=False)
    ] = None,
    seed: Seed = None,
    frames: Frames = None,
    overrides: Overrides = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the results.", show_default=False)] = None,
    as_json: AsJson = False,
) -> None:
    """Simulate a network of any size: sensors in place of pictures, Gaussians in place of particles."""
    # SciPy and Matplotlib take their time to import.
    from sim.pictures.plots import write_figure
    from sim.pictures.simulation import plot_simulation
    from sim.simulation.simulation import simulate as simulated_frames
    from sim.simulation.summary import Simulated

    given = [*(overrides or []), *([f"cameras.count={cameras}"] if cameras else [])]
    chosen = read_scenario(scenario, given, seed=seed, frames=frames, rendered=False)
    assembly, found, times = Assembly(chosen), Simulated(chosen), []
    with progress_bar(f"{chosen.name}: frames", chosen.frames) as bar:
        began = time.perf_counter()
        for block in simulated_frames(assembly):
            found.add(block)
            n_frames = len(block.truth)
            times += n_frames * [(time.perf_counter() - began) / n_frames]
            began = time.perf_counter()
            bar(len(times))
    summary = found.summary(float(np.median(times[1:])), time.monotonic() - BEGAN_S)
    folder = out or Path("runs") / f"simulate-{datetime.now(UTC).strftime('%Y%m%dT%H%M%S.%fZ')}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
        write_figure(plot_simulation(found, assembly), folder / "simulation")
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be written: {error.strerror}: name another --out") from error
    if as_json:
        sys.stdout.write(json.dumps(summary) + "\n")
    else:
        _print(summary, folder)


def _print(summary: dict[str, Any], folder: Path) -> None:
    console, rmse, anees = Console(highlight=False), summary["rmse_m"], summary["anees"]
    network, timing = summary["network"], summary["timing"]
    console.print(
        f"{summary['scenario']}, seed {summary['seed']}, {summary['frames']} frames,"
        f" {summary['n_cameras']:,} cameras, {network['links']:,} links, rule {summary['rule']}",
        soft_wrap=True,
    )
    table = Table()
    for heading in ("estimator", "RMSE", "ANEES"):
        table.add_column(heading, justify="left" if heading == "estimator" else "right")
    for title, key in (("all nodes", "dcpf"), ("median node", "median_node"), ("all measurements", "cpf")):
        table.add_row(title, length_text(rmse[key], "m"), f"{anees[key]:.3g}")
    table.add_row("nodes that see", length_text(rmse["seeing"], "m"), "")
    console.print(table)
    console.print(
        f"{summary['seeing_cameras']:.1f} cameras see the target in a frame; nodes disagree by"
        f" {summary['disagreement_m']:.3f} m",
        soft_wrap=True,
    )
    console.print(
        f"{network['algorithm']}, {network['iterations']} rounds of {network['numbers_per_message']} numbers:"
        f" {network['residual']:.2g} of the difference is left",
        soft_wrap=True,
    )
    console.print(
        f"{timing['frame_ms']:.1f} ms a frame, {timing['us_per_camera_and_frame']:.1f} µs a camera,"
        f" {timing['total_s']:.1f} s in all, {summary['peak_memory_mb']:,.0f} MB at most",
        soft_wrap=True,
    )
    console.print(f"figures and picture in {folder}", soft_wrap=True)
