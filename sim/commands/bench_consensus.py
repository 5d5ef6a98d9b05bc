"""`dcpf bench consensus`: a consensus round among processes, beside bare Zenoh and plain sockets."""

import json
import sys
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from sim.benchmarks.rounds.consensus import SHAPES, SIZES, TURNS, bench_consensus
from sim.commands.shared import AsJson, progress_bar


def consensus(
    sizes: Annotated[
        list[int] | None,
        typer.Option(
            "--nodes", help="Number of nodes; repeat for more.", min=2, max=64, show_default="4 to 32"
        ),
    ] = None,
    turns: Annotated[int, typer.Option(help="Turns of twelve rounds of each way.", min=3)] = TURNS,
    as_json: AsJson = False,
) -> None:
    """Measure a consensus round among processes on a ring and a grid, beside bare Zenoh and plain sockets."""
    chosen = tuple(sizes or SIZES)
    counted = 0

    def done() -> None:
        nonlocal counted
        counted += 1
        bar(counted)

    with progress_bar("bench consensus", len(SHAPES) * len(chosen)) as bar:
        report = bench_consensus(SHAPES, chosen, turns, done)
    if as_json:
        sys.stdout.write(json.dumps(report) + "\n")
        return
    table = Table(title="a round, median over nodes and turns", title_justify="left")
    for heading in ("network", "round", "bare Zenoh", "round / bare", "sockets", "CPU a node"):
        table.add_column(heading, justify="left" if heading == "network" else "right")
    for name, each in report.items():
        table.add_row(
            name,
            f"{each['round_us']:.0f} µs",
            f"{each['bare_zenoh_us']:.0f} µs",
            f"{each['round_us'] / each['bare_zenoh_us']:.2f}",
            f"{each['plain_socket_us']:.0f} µs",
            f"{each['cpu_us']:.0f} µs",
        )
    Console(highlight=False).print(table)
