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
from nodes.sources import FrameSource
from nodes.telemetry import Telemetry
from sim.assembly import Assembly

Told = EstimateMessage | TruthMessage | StatusMessage | PreviewMessage
"""What a run tells the outside."""
Nodes = Mapping[str, SmartCamera | Central]
"""The nodes of a run by name."""


def run_in_process(
    assembly: Assembly,
    sources: Mapping[str, FrameSource] | None = None,
    *,
    with_cameras: bool = True,
    with_visibility: bool = True,
    watched: bool = False,
) -> Iterator[Told]:
    """Runs a scenario and yields what it would publish, frame after frame.

    Args:
        assembly: The scenario, put together.
        sources: Where each camera's pictures come from, in place of the assembly's.
        with_cameras: Whether the cameras track, or only send their pictures to the central node.
        watched: Whether somebody looks at the cameras' pictures.
        with_visibility: Whether the truth says what each camera sees of the target.

    Raises:
        SourceError: A video cannot be read.
    """
    # As in the processes, so that no sum is split in another way.
    cv2.setNumThreads(1)
    threadpool_limits(1)
    scenario = assembly.scenario
    names = sorted(assembly.cameras)
    cameras = {name: assembly.smart_camera(name) for name in names if with_cameras}
    sources = sources or {name: assembly.source(name) for name in names}
    central = assembly.central() if scenario.baselines.cpf else None
    nodes: Nodes = {**cameras, central.name: central} if central else cameras
    network = MemoryNetwork(scenario.name, assembly.links)
    telemetry = {name: Telemetry() for name in network.counters}
    for frame in range(scenario.frames):
        images = {name: sources[name].read(frame) for name in names}
        for name in names:
            if central is not None:
                network.post(name, PixelsMessage(name, frame, images[name]))
            camera = cameras.get(name)
            if camera is None:
                continue
            began = time.perf_counter()
            outgoing = camera.on_frame(frame, images[name])
            telemetry[name].local_filter_s.append(time.perf_counter() - began)
            yield from _speak(network, name, outgoing)
        yield from _converse(network, nodes)
        if watched:
            yield from (camera.preview(frame, images[name]) for name, camera in cameras.items())
        truth = assembly.truth_message(frame, with_visibility=with_visibility)
        if truth is not None:
            yield truth
        if frame in (0, scenario.frames - 1):
            for name in network.counters:
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
        node = nodes.get(receiver)
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
