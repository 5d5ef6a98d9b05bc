"""`dcpf run`: launches a scenario, waits, compares, writes the folder of the run."""

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.console import Console
from rich.table import Table

from sim.assembly import Assembly
from sim.commands import BEGAN_S
from sim.commands.live import DEFAULT_PORT, LOOPBACK, Bind, Live, Port, page, wait_for_audience
from sim.commands.shared import (
    AsJson,
    Frames,
    Overrides,
    ScenarioPath,
    Seed,
    length_text,
    progress_bar,
    read_scenario,
    tell_advice,
    yes_no,
)
from sim.results.provenance import sent_per_frame, versions
from sim.results.recorder import Film, Recorder, default_folder
from sim.results.results import Results, length, summarize
from sim.running.in_process import run_in_process
from sim.scenario.model import Scenario


def run(
    scenario: ScenarioPath,
    seed: Seed = None,
    frames: Frames = None,
    overrides: Overrides = None,
    pace: Annotated[
        Literal["lockstep", "realtime"] | None, typer.Option(help="Pace in place of the scenario's.")
    ] = None,
    in_process: Annotated[
        bool, typer.Option("--in-process", help="One process and one thread, same numbers.")
    ] = False,
    name: Annotated[str | None, typer.Option(help="Name of the run, in place of the scenario's.")] = None,
    by_hand: Annotated[
        list[str] | None,
        typer.Option("--by-hand", metavar="NODE", help="A node that you start yourself, with dcpf node."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the run.", show_default=False)] = None,
    fail_if_lost: Annotated[
        bool, typer.Option("--fail-if-lost", help="Exit with 1 if DCPF lost the target.")
    ] = False,
    record: Annotated[
        bool, typer.Option("--record", help="Record pictures and all as run.mcap, for Rerun and Foxglove.")
    ] = False,
    live: Live = False,
    port: Port = DEFAULT_PORT,
    bind: Bind = LOOPBACK,
    as_json: AsJson = False,
) -> int:
    """Launch a scenario: one process a camera, the central node and a router; then compare DCPF with CPF."""
    chosen = read_scenario(scenario, overrides, seed=seed, frames=frames, pace=pace, name=name)
    folder = out or default_folder(chosen)
    assembly = Assembly(chosen)
    # What is wrong with the start or the truth shall be said before anything is written.
    _ = assembly.start, assembly.truth
    _check_by_hand(by_hand or [], assembly, in_process=in_process)
    tell_advice(chosen)
    if live and in_process:
        raise typer.BadParameter("with --in-process, nothing goes over the network", param_hint="--live")
    with ExitStack() as stack:
        audience = None
        if live:
            server = stack.enter_context(page(assembly, chosen.network.router, (bind, port)))
            audience = partial(wait_for_audience, server)
        recorder = stack.enter_context(Recorder(folder, chosen, _film(assembly) if record else None))
        bar = stack.enter_context(progress_bar(f"{chosen.name}: frames", chosen.frames))
        dead: list[str] = []
        if in_process:
            results = Results(chosen)
            for message in run_in_process(assembly, watched=record):
                recorder.add(message)
                results.add(message)
                bar(results.frames_done)
        else:
            for node in by_hand or []:
                hint = f"waiting for {node}: start it with dcpf node {node} {scenario}, and the same options"
                Console(stderr=True).print(hint, highlight=False, markup=False, soft_wrap=True)
            # Zenoh is imported by those who need it: it takes its time.
            from sim.running.launcher import Launch

            launch = Launch(assembly, recorder, bar, by_hand or [], BEGAN_S, audience=audience)
            results, dead = launch.run(), launch.dead
        summary = summarize(results, processes=1 if in_process else chosen.n_processes)
        summary |= {"died": dead, "sent_per_frame": sent_per_frame(results), "versions": versions()}
        for event in summary["members"]["events"]:
            # The launcher has heard them come and go; without one, the cameras' word for it must do.
            if in_process or event["event"] == "knocked":
                recorder.event(**event)
        recorder.finish(summary)
    if as_json:
        sys.stdout.write(json.dumps(summary) + "\n")
    else:
        _print(summary, chosen, folder)
    lost = bool(summary["lost"]["dcpf"])
    return 1 if dead or (fail_if_lost and lost) else 0


def _film(assembly: Assembly) -> Callable[[Path], Film]:
    # The formats of a recording are for those who record.
    from sim.recording.film import McapFilm

    return partial(McapFilm, assembly=assembly)


def _check_by_hand(names: list[str], assembly: Assembly, *, in_process: bool) -> None:
    unknown = [name for name in names if name not in assembly.links]
    if unknown:
        raise typer.BadParameter(
            f"there is no node {unknown[0]}: the nodes are {', '.join(assembly.links)}",
            param_hint="--by-hand",
        )
    if names and in_process:
        raise typer.BadParameter(
            "with --in-process, no node is left to start by hand", param_hint="--by-hand"
        )


def _print(summary: dict[str, Any], scenario: Scenario, folder: Path) -> None:
    console = Console(highlight=False)
    console.print(
        f"{summary['scenario']}, {summary['preset']} preset, seed {summary['seed']},"
        f" {summary['frames']} frames, {summary['processes']} processes",
        soft_wrap=True,
    )
    table = Table()
    for heading in ("estimator", "RMSE", "lost", "ANEES"):
        table.add_column(heading, justify="left" if heading == "estimator" else "right")
    rmse, lost, anees, unit = length(summary, "rmse"), summary["lost"], summary["anees"], summary["unit"]
    table.add_row(
        "DCPF (all nodes)", length_text(rmse["dcpf"], unit), yes_no(lost["dcpf"]), _plain(anees["dcpf"])
    )
    if scenario.baselines.cpf:
        table.add_row("CPF", length_text(rmse["cpf"], unit), yes_no(lost["cpf"]), _plain(anees["cpf"]))
    for node, value in rmse["single"].items():
        table.add_row(f"{node} alone", length_text(value, unit), yes_no(lost["single"][node]), "")
    console.print(table)
    if summary["ratio_dcpf_cpf"] is not None:
        console.print(f"DCPF / CPF: {summary['ratio_dcpf_cpf']:.2f}")
    sent = summary["network"]["bytes_per_frame"]
    if len(summary["cameras"]) > 1:
        apart = length_text(length(summary, "disagreement"), unit)
        console.print(f"nodes disagree by {apart} in the mean")
    console.print(f"bytes a frame: DCPF {sent['dcpf']:,.0f}, CPF {sent['cpf']:,.0f}")
    indefinite = summary["fusion"]["indefinite_local_fraction"]
    if indefinite:
        console.print(f"Eq. 17's ratio was no density in {indefinite:.0%} of the local results")
    if "simd" in summary:
        console.print(_array_text(summary["simd"], scenario.filter.simd.words), soft_wrap=True)
    for line in (*_trouble_lines(summary["network"]), *_timing_lines(summary["timing"])):
        console.print(line)
    _print_members(console, summary)
    console.print(f"recorded in {folder}", soft_wrap=True)


def _timing_lines(timing: dict[str, Any]) -> Iterator[str]:
    if "first_estimate_s" in timing and "frames_per_s" in timing:
        first, rate = timing["first_estimate_s"], timing["frames_per_s"]
        yield f"first estimate after {first:.1f} s, then {rate:.0f} frames/s"


def _trouble_lines(network: dict[str, Any]) -> Iterator[str]:
    """What bad links have done, if they have."""
    troubles = {"lost": "lost", "late_messages": "late", "duplicated": "duplicated", "dropped": "dropped"}
    if any(network[key] for key in troubles):
        counted = ", ".join(f"{network[key]:,} {text}" for key, text in troubles.items())
        yield f"messages of the rounds: {counted}"
    if network["lag_s"]:
        yield f"estimates come {network['lag_s']:g} s after their pictures"


def _print_members(console: Console, summary: dict[str, Any]) -> None:
    for event in summary["members"]["events"]:
        console.print(f"{event['node']} {event['event']} in frame {event['frame']}")
    if summary["died"]:
        console.print(f"did not reach the end: {', '.join(summary['died'])}")


def _array_text(cost: dict[str, int | float], words: int) -> str:
    return (
        f"on a camera's array: {cost['cycles']:,} cycles, {1e-3 * cost['frame_us']:.1f} ms a frame at"
        f" {cost['clock_mhz']:g} MHz ({cost['share_of_frame']:.0%} of it), {cost['line_memory_words']} of"
        f" {words} words; it holds {cost['rate_hz']:.0f} frames/s"
    )


def _plain(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"
