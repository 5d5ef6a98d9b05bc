"""One node of a run as a process of its own: the launcher's child, or started by hand.

Kept light, since every camera of a run imports it: no command line of the tool, no figures, no graph library.
"""

import argparse
import logging
import os
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

import cv2
from threadpoolctl import threadpool_limits

from network.errors import NetworkError
from network.transport import links_of
from network.zenoh import ZenohTransport
from nodes.process import Pace, Shell, run_camera, run_central
from nodes.sources import SourceError
from sim.assembly import Assembly
from sim.running.endpoints import by_hand
from sim.scenario.loading import load_scenario
from sim.scenario.model import Scenario
from sim.scenario.parsing import ScenarioError

_log = logging.getLogger(__name__)
GRACE_S = 4.0
"""After its launcher is gone, a node has this long to leave by itself."""


def run_node(
    scenario: Scenario, name: str, listen: Sequence[str], connect: Sequence[str], stopped: threading.Event
) -> None:
    """Runs one node until its frames are done or it is stopped.

    Args:
        scenario: Resolved.
        name: A camera of it, or its central node.
        listen: Endpoints to listen on; by default those that the scenario says.
        connect: Endpoints to connect to; by default those that the scenario says.
        stopped: Set from outside when the node is to leave.

    Raises:
        ScenarioError: The scenario has no such node.
        NetworkError: An endpoint cannot be had.
        SourceError: The camera's video cannot be read.
    """
    assembly = Assembly(scenario)
    sink = scenario.central.name if scenario.baselines.cpf else None
    links = links_of(assembly.graph, [sink] if sink else [])
    if name not in links:
        raise ScenarioError(f"{scenario.name} has no node {name}: its nodes are {', '.join(links)}")
    # One thread a process: as many processes as cameras share the cores.
    cv2.setNumThreads(1)
    threadpool_limits(1)
    usual = by_hand(scenario)
    transport = ZenohTransport(
        scenario.name,
        name,
        links[name],
        list(listen) or [usual.nodes[name]],
        list(connect) or usual.connects(name, assembly.graph, sink),
        drop_late_pixels=scenario.pace == "realtime",
    )
    pace = Pace(scenario.pace, scenario.rate_hz, scenario.network.deadline_s)
    shell = Shell(name, transport, pace, scenario.frames, stopped)
    try:
        if name == sink:
            run_central(assembly.central(), shell)
        else:
            source = assembly.source(name)
            run_camera(assembly.smart_camera(name), source, links[name].neighbors, sink, shell)
            source.close()
    finally:
        stopped.set()
        transport.close()


def stop_on_signals(stopped: threading.Event) -> None:
    """Makes SIGINT and SIGTERM a request to leave after the step in hand."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())


def _stop_with_launcher(stopped: threading.Event) -> None:
    """Leaves when the launcher does: its end of the pipe closes however it ends."""
    # Not sys.stdin: a thread that holds its lock would stop the interpreter from ending.
    while os.read(0, 1):
        pass
    if not stopped.is_set():
        _log.warning("the launcher is gone")
    stopped.set()
    threading.Timer(GRACE_S, os._exit, args=[1]).start()


def main(arguments: Sequence[str] | None = None) -> int:
    """The launcher's child: `python -m sim.running.node SCENARIO NODE …`, with the launcher at its stdin."""
    parser = argparse.ArgumentParser(prog="python -m sim.running.node")
    parser.add_argument("scenario", type=Path)
    parser.add_argument("node")
    parser.add_argument("--listen", action="append", default=[])
    parser.add_argument("--connect", action="append", default=[])
    parsed = parser.parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    stopped = threading.Event()
    stop_on_signals(stopped)
    threading.Thread(target=_stop_with_launcher, args=[stopped], name="launcher", daemon=True).start()
    try:
        run_node(load_scenario(parsed.scenario), parsed.node, parsed.listen, parsed.connect, stopped)
    except (NetworkError, ScenarioError, SourceError) as error:
        print(error, file=sys.stderr)  # noqa: T201 - the launcher reads it there
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
