"""`dcpf node` and `dcpf central`: one process of a run, started by hand, on this host or another."""

import logging
import threading
from typing import Annotated

import typer

from sim.assembly import Assembly
from sim.commands.shared import Frames, Overrides, ScenarioPath, Seed, read_scenario
from sim.scenario.parsing import ScenarioError

Name = Annotated[str, typer.Argument(metavar="NAME", help="The camera.", show_default=False)]
Listen = Annotated[
    list[str] | None, typer.Option(metavar="ENDPOINT", help="Zenoh endpoint to listen on; repeat for more.")
]
Connect = Annotated[
    list[str] | None,
    typer.Option(metavar="ENDPOINT", help="Zenoh endpoint to connect to: the router, neighbours; repeat."),
]
RunName = Annotated[str | None, typer.Option("--name", help="Name of the run, in place of the scenario's.")]


def node(
    name: Name,
    scenario: ScenarioPath,
    seed: Seed = None,
    frames: Frames = None,
    overrides: Overrides = None,
    run_name: RunName = None,
    listen: Listen = None,
    connect: Connect = None,
) -> None:
    """Run one node of a scenario; a `dcpf run --by-hand NAME` elsewhere starts its frames."""
    chosen = read_scenario(scenario, overrides, seed=seed, frames=frames, name=run_name)
    # The node's needs are not the command line's: Zenoh takes its time to import.
    from sim.running.endpoints import hand_endpoints
    from sim.running.node import run_node, stop_on_signals

    logging.getLogger().setLevel(logging.INFO)
    stopped = threading.Event()
    stop_on_signals(stopped)
    assembly, usual = Assembly(chosen), hand_endpoints(chosen)
    if name not in usual.nodes:
        raise ScenarioError(f"{scenario}: has no node {name}: its nodes are {', '.join(usual.nodes)}")
    run_node(
        assembly, name, listen or [usual.nodes[name]], connect or usual.connects(name, assembly), stopped
    )


def central(
    scenario: ScenarioPath,
    seed: Seed = None,
    frames: Frames = None,
    overrides: Overrides = None,
    run_name: RunName = None,
    listen: Listen = None,
    connect: Connect = None,
) -> None:
    """Run the central node of a scenario: `dcpf node` with its name."""
    name = read_scenario(scenario, overrides).central.name
    node(name, scenario, seed, frames, overrides, run_name, listen, connect)
