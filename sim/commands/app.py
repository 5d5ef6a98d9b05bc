"""The `dcpf` command: its sub-commands."""

import logging
import signal
from typing import NoReturn

import typer
from rich.console import Console
from rich.logging import RichHandler

from sim.commands.bench import bench
from sim.commands.clip import clip
from sim.commands.compare import compare
from sim.commands.consensus import consensus
from sim.commands.guard import guarded
from sim.commands.inspect import check, footage, schema
from sim.commands.node import central, node
from sim.commands.replay import replay
from sim.commands.report import report
from sim.commands.run import run
from sim.commands.simd import simd
from sim.commands.simulate import simulate
from sim.commands.watch import watch

app = typer.Typer(
    name="dcpf",
    help="Camera-network simulator: distributed colour-based particle filters over Eclipse Zenoh.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for command in (
    *(run, watch, replay, compare, consensus, report, simulate, clip, simd),
    *(node, central, check, schema, footage),
):
    app.command()(guarded(command))
app.add_typer(bench)


def main() -> NoReturn:
    """Runs the command line and exits: 0 done, 1 the run failed, 2 wrong input, 130 interrupted."""
    handler = RichHandler(console=Console(stderr=True), show_path=False, show_time=False)
    logging.basicConfig(level=logging.WARNING, format="%(message)s", handlers=[handler])
    # SIGTERM is an interruption like Ctrl-C: processes are ended, what was recorded stays.
    signal.signal(signal.SIGTERM, _interrupt)
    app()
    raise SystemExit(0)


def _interrupt(*_: object) -> NoReturn:
    raise KeyboardInterrupt
