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
    table = Table(title="a round in µs, median over nodes and turns", title_justify="left")
    headings = ("network", "round", "bare Zenoh", "round / bare", "tuned", "round / tuned", "sockets", "CPU")
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "network" else "right")
    for name, each in report.items():
        bare, tuned = each["bare_zenoh_us"], each["bare_zenoh_tuned_us"]
        table.add_row(
            name,
            f"{each['round_us']:.0f}",
            f"{bare:.0f}",
            f"{each['round_us'] / bare:.2f}",
            f"{tuned:.0f}",
            f"{each['round_us'] / tuned:.2f}",
            f"{each['plain_socket_us']:.0f}",
            f"{each['round_cpu_us']:.0f}",
        )
    Console(highlight=False).print(table)
