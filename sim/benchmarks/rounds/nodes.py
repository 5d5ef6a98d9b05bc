"""The processes of `dcpf bench consensus`: this one forks a node for each name and collects what they timed.

Usage: python -m sim.benchmarks.rounds.nodes JSON, with shape, n, folder and turns; JSON comes out.
"""

import json
import os
import sys
import time
import traceback
from collections import deque
from statistics import median
from typing import Any

from network.graphs.graph import Graph
from sim.benchmarks.rounds.exchange import (
    BareZenoh,
    ConsensusRounds,
    Exchange,
    PlainSockets,
    connected,
)
from sim.benchmarks.rounds.untuned import UntunedZenoh
from sim.scenario.model import GRAPHS

_RUN = "bench"


def main() -> int:
    """Forks the nodes, before any thread and any session, and prints the medians over them."""
    order = json.loads(sys.argv[1])
    graph = GRAPHS[order["shape"]]([f"N{index:02}" for index in range(order["n"])])
    ends = connected(graph)
    hold_read, hold_write = os.pipe()
    results: dict[str, int] = {}
    for name in graph.names:
        read, write = os.pipe()
        if os.fork() == 0:
            # From here on, this is the node's process.
            os.close(hold_write)
            code = 1
            try:
                _be_node(name, graph, order, PlainSockets(_RUN, name, ends[name]), write, hold_read)
                code = 0
            except Exception:  # noqa: BLE001 - of whatever kind: who started the processes reads it
                traceback.print_exc()
            finally:
                os._exit(code)
        os.close(write)
        results[name] = read
    told = [_read_all(read) for read in results.values()]
    os.close(hold_write)  # everybody may leave
    for _ in graph.names:
        os.wait()
    if not all(told):
        return 1
    nodes = [json.loads(each) for each in told]
    print(json.dumps({key: median(node[key] for node in nodes) for key in nodes[0]}))  # noqa: T201 - read by who started it
    return 0


def _be_node(
    name: str, graph: Graph, order: dict[str, Any], sockets: PlainSockets, write: int, hold: int
) -> None:
    """A node: all ways in turn, several times over, and then the medians."""
    folder = order["folder"]
    untuned = UntunedZenoh(_RUN, name, graph, f"{folder}/u", (write, hold))  # forks: before all sessions
    consensus = ConsensusRounds(_RUN, name, graph, f"{folder}/t")
    bare = BareZenoh(_RUN, name, graph, f"{folder}/b")
    # a first turn over sockets, which are there already, so that nobody speaks before all can hear
    time.sleep(order["settle_s"])
    sockets.rounds(len(graph.names))
    ways: dict[str, Exchange] = {
        "round": consensus,
        "bare_zenoh": untuned,
        "bare_zenoh_tuned": bare,
        "plain_socket": sockets,
    }
    os.write(write, json.dumps(_timed(ways, sockets, len(graph.names), order["turns"])).encode())
    os.close(write)
    os.read(hold, 1)  # a goodbye could overtake the last messages to the others
    consensus.close()
    bare.close()
    untuned.close()


def _timed(ways: dict[str, Exchange], barrier: PlainSockets, n_nodes: int, turns: int) -> dict[str, float]:
    """The medians of a round's time and of the node's processor time in it, in µs, for each way."""
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in ways}
    order = deque(ways.items())
    for turn in range(turns + 1):
        order.rotate()  # nobody is always the first
        for name, way in order:
            # everybody begins a turn together: after as many rounds as nodes, all have heard of all
            barrier.rounds(n_nodes)
            timed = way.timed()
            if turn:  # the first warms up
                times[name].append(timed)
    medians = {name: [1e6 * median(each) for each in zip(*its, strict=True)] for name, its in times.items()}
    return {f"{name}_us": wall for name, (wall, _) in medians.items()} | {
        f"{name}_cpu_us": cpu for name, (_, cpu) in medians.items()
    }


def _read_all(descriptor: int) -> bytes:
    return b"".join(iter(lambda: os.read(descriptor, 65536), b""))


if __name__ == "__main__":
    sys.exit(main())
