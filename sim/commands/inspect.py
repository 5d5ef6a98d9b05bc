"""`dcpf check`, `dcpf schema`, `dcpf footage`: what a scenario says, what it may say, and what it shows."""

import json
import sys
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from sim.assembly import Assembly
from sim.commands.shared import AsJson, Overrides, ScenarioPath, read_scenario, tell_advice
from sim.experiments.options import ExperimentOptions
from sim.footage import fetch
from sim.scenario.model import SPACES, Scenario

_DIALECT = "https://json-schema.org/draft/2020-12/schema"


def check(scenario: ScenarioPath, overrides: Overrides = None, as_json: AsJson = False) -> None:
    """Validate a scenario, with the files that it names, and say what it would run."""
    chosen = read_scenario(scenario, overrides)
    assembly = Assembly(chosen)
    start = assembly.start
    tell_advice(chosen)
    facts: dict[str, Any] = {
        "scenario": chosen.name,
        "preset": chosen.preset,
        "frames": chosen.frames,
        "rate_hz": chosen.rate_hz,
        "cameras": {name: [c.width_px, c.height_px] for name, c in assembly.cameras.items()},
        "graph": sorted(map(list, assembly.graph.edges)),
        "processes": chosen.n_processes,
        "ground_truth": assembly.truth is not None,
        "start": start.mean.tolist(),
    }
    if as_json:
        sys.stdout.write(json.dumps(facts) + "\n")
        return
    table = Table(show_header=False, title=f"{scenario}: is valid", title_justify="left")
    table.add_row(
        "run", f"{chosen.frames} frames at {chosen.rate_hz:g} Hz, {chosen.preset} preset, seed {chosen.seed}"
    )
    for name, camera in assembly.cameras.items():
        x, y, z = camera.center
        place = f"{camera.width_px} x {camera.height_px} pixels, at ({x:.2f}, {y:.2f}, {z:.2f}) m"
        table.add_row(name, f"{place}, talks to {', '.join(assembly.graph.neighbors(name)) or 'nobody'}")
    table.add_row("target", f"{SPACES[chosen.target.space]}, starts at {start.mean.round(2).tolist()}")
    table.add_row("processes", str(chosen.n_processes))
    Console(highlight=False).print(table)


def schema(
    experiment: Annotated[
        bool, typer.Option("--experiment", help="Of experiment files, for dcpf compare.")
    ] = False,
) -> None:
    """Print the JSON Schema of scenario files; editors complete and check keys with it."""
    found = experiment_schema() if experiment else scenario_schema()
    sys.stdout.write(json.dumps(found, indent=2) + "\n")


def scenario_schema() -> dict[str, Any]:
    """The JSON Schema of scenario files: what a preset fills in need not stand in the file."""
    document = Scenario.model_json_schema()
    document["required"].remove("network")
    document["$defs"]["NetworkOptions"]["required"].remove("consensus")
    return {"$schema": _DIALECT, **document}


def experiment_schema() -> dict[str, Any]:
    """The JSON Schema of experiment files."""
    return {"$schema": _DIALECT, **ExperimentOptions.model_json_schema()}


def footage(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="The footage, such as swimcap.", show_default=False)
    ],
) -> None:
    """Fetch real footage with its calibration into your cache, checked by hash."""
    console = Console(stderr=True, highlight=False)
    folder = fetch(name, lambda line: console.print(line, markup=False, soft_wrap=True))
    sys.stdout.write(f"{folder}\n")
