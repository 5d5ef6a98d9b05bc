"""A whole run in one process and one thread: the same nodes, their messages in memory.

Node for node and bit for bit what the processes compute, without their start; the way to run many.
"""

import time
from collections.abc import Iterable, Iterator, Mapping

import cv2
from threadpoolctl import threadpool_limits

from network.memory import MemoryNetwork
from network.messages import (
    ConsensusMessage,
    EstimateMessage,
    Message,
    PixelsMessage,
    PreviewMessage,
    StatusMessage,
    TruthMessage,
)
from nodes.central import Central
from nodes.smart_camera import SmartCamera
from nodes.telemetry import Telemetry
from sim.assembly import Assembly

Told = EstimateMessage | TruthMessage | StatusMessage | PreviewMessage
"""What a run tells the outside."""
Nodes = Mapping[str, SmartCamera | Central]
"""The nodes of a run by name."""


def run_in_process(assembly: Assembly, *, watched: bool = False) -> Iterator[Told]:
    """Runs a scenario and yields what it would publish, frame after frame.

    Args:
        assembly: The run.
        watched: Whether somebody looks at the cameras' pictures.

    Raises:
        SourceError: A video cannot be read.
    """
    # As in the processes, so that no sum is split in another way.
    cv2.setNumThreads(1)
    threadpool_limits(1)
    scenario = assembly.scenario
    cameras = {name: assembly.smart_camera(name) for name in sorted(assembly.cameras)}
    sources = {name: assembly.source(name) for name in cameras}
    central = assembly.central() if scenario.baselines.cpf else None
    nodes: Nodes = {**cameras, central.name: central} if central else cameras
    network = MemoryNetwork(scenario.name, assembly.links)
    telemetry = {name: Telemetry() for name in nodes}
    for frame in range(scenario.frames):
        images = {name: source.read(frame) for name, source in sources.items()}
        for name, camera in cameras.items():
            if central is not None:
                network.post(name, PixelsMessage(name, frame, images[name]))
            began = time.perf_counter()
            outgoing = camera.on_frame(frame, images[name])
            telemetry[name].local_filter_s.append(time.perf_counter() - began)
            yield from _speak(network, name, outgoing)
        yield from _converse(network, nodes)
        if watched:
            yield from (camera.preview(frame, images[name]) for name, camera in cameras.items())
        truth = assembly.truth_message(frame)
        if truth is not None:
            yield truth
        if frame in (0, scenario.frames - 1):
            for name in nodes:
                counters = cameras[name].counters if name in cameras else {}
                yield telemetry[name].status(
                    name, "running" if frame == 0 else "done", frame, network.counters[name], counters
                )
    for source in sources.values():
        source.close()


def _converse(network: MemoryNetwork, nodes: Nodes) -> Iterator[EstimateMessage]:
    """Delivers messages, and what they bring forth, until nothing is on its way."""
    while (delivered := network.deliver()) is not None:
        receiver, message = delivered
        node = nodes[receiver]
        if isinstance(node, SmartCamera) and isinstance(message, ConsensusMessage):
            replies: Iterable[Message] = node.on_message(message)
        elif isinstance(node, Central) and isinstance(message, PixelsMessage):
            replies = node.on_message(message)
        else:
            continue
        yield from _speak(network, receiver, replies)


def _speak(network: MemoryNetwork, sender: str, messages: Iterable[Message]) -> Iterator[EstimateMessage]:
    for message in messages:
        network.post(sender, message)
        if isinstance(message, EstimateMessage):
            yield message
