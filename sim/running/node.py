"""One node of a run, in a process of its own: forked by the run's host, or started by hand."""

import os
import signal
import threading
from collections.abc import Sequence

import cv2
from threadpoolctl import threadpool_limits

from network.links.conditions import Channel
from network.links.disturbed import DisturbedTransport
from network.links.runtime import NODE_RUNTIME
from network.links.transport import Transport
from network.links.zenoh import ZenohTransport
from nodes.shell.central_process import run_central
from nodes.shell.process import Shell, run_camera
from sim.assembly import Assembly
from sim.faults.process import FailingProcess
from sim.scenario.parsing import ScenarioError


def run_node(
    assembly: Assembly, name: str, listen: Sequence[str], connect: Sequence[str], stopped: threading.Event
) -> None:
    """Runs one node until its frames are done or it is stopped.

    Args:
        assembly: The run.
        name: A camera of it, or its central node.
        listen: Endpoints to listen on.
        connect: Endpoints to connect to.
        stopped: Set from outside when the node is to leave.

    Raises:
        ScenarioError: The scenario has no such node.
        NetworkError: An endpoint cannot be had.
        SourceError: The camera's video cannot be read.
    """
    scenario = assembly.scenario
    if name not in assembly.links:
        raise ScenarioError(f"{scenario.name} has no node {name}: its nodes are {', '.join(assembly.links)}")
    # One thread a process: as many processes as cameras share the cores.
    os.environ.update(NODE_RUNTIME)
    cv2.setNumThreads(1)
    threadpool_limits(1)
    links = assembly.links[name]
    realtime = scenario.pace == "realtime"
    transport: Transport
    if scenario.network.conditions.are_perfect or links.cameras:
        transport = ZenohTransport(scenario.name, name, links, listen, connect, drop_late_pixels=realtime)
    else:
        channels = {
            other: Channel(scenario.network.conditions, scenario.seed, other, name)
            for other in links.neighbors
        }
        transport = DisturbedTransport(
            scenario.name, name, links, listen, connect, channels, realtime=realtime
        )
    shell = Shell(name, transport, assembly.pace, scenario.frames, stopped)
    try:
        if links.cameras:
            run_central(assembly.central(), links, shell)
        else:
            source = FailingProcess(assembly.source(name), name, scenario.faults)
            run_camera(assembly.smart_camera(name), source, links, shell)
    finally:
        stopped.set()
        transport.close()


def stop_on_signals(stopped: threading.Event) -> None:
    """Makes SIGINT and SIGTERM a request to leave after the step in hand."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
