"""`dcpf watch`: estimates as they come, a live table in a terminal and JSON lines in a pipe."""

import sys
from typing import Annotated

import typer
from rich.console import Console
from rich.live import Live
from rich.table import Table

from network.wire.messages import EstimateMessage
from sim.commands.shared import AsJson


def watch(
    key: Annotated[str, typer.Argument(metavar="KEYEXPR", help="Which estimates.")] = "dcpf/*/*/estimate",
    connect: Annotated[
        str, typer.Option(metavar="ENDPOINT", help="Zenoh endpoint of a run's router.")
    ] = "tcp/127.0.0.1:7447",
    as_json: AsJson = False,
) -> None:
    """Show estimates live, from now on: before, during and after the start of a run. Ctrl-C ends it."""
    # Only this command's users wait for Zenoh to import.
    from sim.running.listener import estimates

    found = estimates(key, connect)
    if as_json or not sys.stdout.isatty():
        from network.wire.codec import encode_public

        for message in found:
            if message is not None:
                sys.stdout.write(encode_public(message).decode() + "\n")
                sys.stdout.flush()
        return
    latest: dict[tuple[str, str, str], EstimateMessage] = {}
    with Live(_table(latest, connect), console=Console(), refresh_per_second=10, auto_refresh=False) as live:
        for message in found:
            if message is not None:
                latest[message.run, message.estimator, message.node] = message
            else:
                live.update(_table(latest, connect), refresh=True)


def _table(latest: dict[tuple[str, str, str], EstimateMessage], endpoint: str) -> Table:
    waiting = f"waiting for a run at {endpoint}"
    hint = "in metres, in pixels where one camera tracks in its image plane; Ctrl-C to end"
    table = Table(caption=hint if latest else waiting, caption_justify="left")
    for heading in ("run", "estimator", "node", "frame", "position", "±", "sees it", "lost"):
        table.add_column(heading, justify="right" if heading in ("frame", "±") else "left")
    for (run, estimator, node), message in sorted(latest.items()):
        n_axes = len(message.mean) // 2
        position = ", ".join(f"{value:7.3f}" for value in message.mean[:n_axes])
        deviation = float(message.covariance[:n_axes, :n_axes].trace() / n_axes) ** 0.5
        table.add_row(
            run,
            estimator.upper() if estimator != "single" else "alone",
            node,
            str(message.frame),
            position,
            f"{deviation:.3f}",
            "yes" if message.visible else "no",
            "lost" if message.lost else "",
        )
    return table
