"""What a consensus round costs among processes: beside a bare exchange over Zenoh, and over plain sockets."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable

from network.links.runtime import NODE_RUNTIME
from sim.running.children import RunFailed

SHAPES = ("ring", "grid")
SIZES = (4, 8, 16, 32)
TURNS = 25
"""How often each way has its turn of twelve rounds."""
LIMIT_S = 180.0
SETTLE_S = 0.05
"""For each node: how long subscriptions take to be known, on a busy machine."""


def bench_consensus(
    shapes: tuple[str, ...] = SHAPES,
    sizes: tuple[int, ...] = SIZES,
    turns: int = TURNS,
    done: Callable[[], object] = lambda: None,
) -> dict[str, dict[str, float]]:
    """Measures rounds among processes, one network after the other.

    Args:
        shapes: Graphs by their names in a scenario.
        sizes: Numbers of nodes.
        turns: How often each way has its turn.
        done: Called after each network.

    Returns:
        For each network, such as `ring-4`: medians over turns and nodes, in µs, of a round's time
        (`round_us`), of an exchange of the same bytes over Zenoh as it comes (`bare_zenoh_us`), with its
        threads set as a node sets them (`bare_zenoh_tuned_us`), and over sockets (`plain_socket_us`); with
        `_cpu_us` in place of `_us`, the processor time that a round takes a node.

    Raises:
        RunFailed: The nodes did not get through.
    """
    report = {}
    for shape in shapes:
        for n in sizes:
            report[f"{shape}-{n}"] = _measure(shape, n, turns)
            done()
    return report


def _measure(shape: str, n: int, turns: int) -> dict[str, float]:
    with tempfile.TemporaryDirectory(prefix="dcpf-") as folder:
        order = {"shape": shape, "n": n, "folder": folder, "turns": turns, "settle_s": 0.5 + SETTLE_S * n}
        process = subprocess.Popen(
            [sys.executable, "-m", "sim.benchmarks.rounds.nodes", json.dumps(order)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | NODE_RUNTIME,
        )
        try:
            stdout, stderr = process.communicate(timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            stdout, stderr = process.communicate()
    if process.returncode or not stdout:
        words = stderr.strip().splitlines()[-1] if stderr.strip() else "they did not get through"
        raise RunFailed(f"{n} nodes on a {shape}: {words}")
    figures: dict[str, float] = json.loads(stdout)
    return {name: round(value, 1) for name, value in figures.items()}
