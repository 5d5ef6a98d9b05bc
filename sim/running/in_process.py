"""A whole run in one process and one thread: the same nodes, their messages in memory, in virtual time.

Where links are perfect, node for node and bit for bit what the processes compute, without their start; the
way to run many. Bad links act in virtual time, in which computing takes none: messages arrive when the
conditions say, rounds end at their deadlines, and a run is the same every time.
"""

import time
from collections.abc import Iterable, Iterator, Mapping

import cv2
import numpy as np
from jaxtyping import UInt8
from threadpoolctl import threadpool_limits

from network.conditions import NS
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
from nodes.telemetry import State, Telemetry
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
    run = InProcess(assembly, sources, with_cameras=with_cameras)
    yield from run.run(with_visibility=with_visibility, watched=watched)


class InProcess:
    """A run in virtual time: what happens when, until nothing is left to happen."""

    def __init__(
        self, assembly: Assembly, sources: Mapping[str, FrameSource] | None, *, with_cameras: bool
    ) -> None:
        """A run before its first frame, at time 0; its arguments are those of `run_in_process`."""
        scenario = assembly.scenario
        self._assembly, self._pace = assembly, assembly.pace
        names = sorted(assembly.cameras)
        self._cameras = {name: assembly.smart_camera(name) for name in names if with_cameras}
        self._sources = dict(sources) if sources else {name: assembly.source(name) for name in names}
        self._images: dict[str, UInt8[np.ndarray, "H W 3"]] = {}
        self._central = assembly.central() if scenario.baselines.cpf else None
        central = {self._central.name: self._central} if self._central else {}
        self._nodes: Nodes = {**self._cameras, **central}
        self._network = MemoryNetwork(
            scenario.name, assembly.links, scenario.network.conditions, scenario.seed
        )
        self._telemetry = {name: Telemetry() for name in self._network.counters}
        self._now_ns = 0
        self._begun_ns = 0  # the frame in hand

    def run(self, *, with_visibility: bool, watched: bool) -> Iterator[Told]:
        """All frames, one after the other."""
        last = self._assembly.scenario.frames - 1
        for frame in range(last + 1):
            yield from self._begin(frame)
            yield from self._pass_time(self._next_begin_ns(frame) if frame < last else None)
            if watched:
                for name, camera in self._cameras.items():
                    yield camera.preview(frame, self._images[name])
            truth = self._assembly.truth_message(frame, with_visibility=with_visibility)
            if truth is not None:
                yield truth
            if frame == 0:
                yield from self._statuses("running", frame)
        yield from self._drain()
        yield from self._statuses("done", last)
        for source in self._sources.values():
            source.close()

    def _begin(self, frame: int) -> Iterator[EstimateMessage]:
        """Every camera takes its picture, and says its first."""
        self._begun_ns = self._now_ns
        self._images = {name: source.read(frame) for name, source in sorted(self._sources.items())}
        for name, image in self._images.items():
            if self._central is not None:
                self._network.post(name, PixelsMessage(name, frame, image), self._now_ns)
            camera = self._cameras.get(name)
            if camera is None:
                continue
            began = time.perf_counter()
            outgoing = camera.on_frame(frame, image)
            self._telemetry[name].local_filter_s.append(time.perf_counter() - began)
            yield from self._speak(name, outgoing)

    def _next_begin_ns(self, frame: int) -> int | None:
        """When the frame after this one begins: in lockstep when nobody waits any more, which is None."""
        if self._pace.kind == "lockstep":
            return None
        return round(NS * self._pace.begin_s(frame + 1))

    def _pass_time(self, until_ns: int | None) -> Iterator[EstimateMessage]:
        """Everything that happens until then, or until nobody waits any more."""
        while True:
            yield from self._deliver()
            deadlines = self._deadlines_ns()
            if until_ns is None and not deadlines:
                return
            events = [each for each in (self._network.next_ns, *deadlines.values()) if each is not None]
            next_ns = min(events, default=None)
            if next_ns is None or (until_ns is not None and next_ns > until_ns):
                break
            self._now_ns = next_ns
            yield from self._deliver()
            # what arrives at the deadline is in time
            for name, deadline_ns in deadlines.items():
                if deadline_ns <= self._now_ns and self._deadline_ns(name) == deadline_ns:
                    yield from self._speak(name, self._cameras[name].on_round_deadline())
        if until_ns is not None:
            self._now_ns = until_ns

    def _deadlines_ns(self) -> dict[str, int]:
        """When the round of each camera that waits is over."""
        return {name: self._deadline_ns(name) for name, each in self._cameras.items() if each.waiting_for}

    def _deadline_ns(self, name: str) -> int:
        round_ = self._cameras[name].rounds_done + 1
        return self._begun_ns + round(NS * self._pace.round_deadline_s(round_))

    def _deliver(self) -> Iterator[EstimateMessage]:
        """What has arrived, and what it brings forth at once."""
        while (arrival_ns := self._network.next_ns) is not None and arrival_ns <= self._now_ns:
            yield from self._deliver_next()

    def _drain(self) -> Iterator[EstimateMessage]:
        """What is still on its way when all is done; it counts as late, not as lost."""
        while (arrival_ns := self._network.next_ns) is not None:
            self._now_ns = max(self._now_ns, arrival_ns)
            yield from self._deliver_next()

    def _deliver_next(self) -> Iterator[EstimateMessage]:
        delivered = self._network.deliver()
        if delivered is None:
            return
        receiver, message = delivered
        node = self._nodes.get(receiver)
        replies: Iterable[Message] = ()
        if isinstance(node, SmartCamera) and isinstance(message, ConsensusMessage):
            replies = node.on_message(message)
        elif isinstance(node, Central) and isinstance(message, PixelsMessage):
            replies = node.on_message(message)
        yield from self._speak(receiver, replies)

    def _speak(self, sender: str, messages: Iterable[Message]) -> Iterator[EstimateMessage]:
        for message in messages:
            self._network.post(sender, message, self._now_ns)
            if isinstance(message, EstimateMessage):
                yield message

    def _statuses(self, state: State, frame: int) -> Iterator[StatusMessage]:
        for name in self._network.counters:
            counters = self._cameras[name].counters if name in self._cameras else {}
            traffic = self._network.counters[name]
            yield self._telemetry[name].status(name, state, frame, traffic, counters)
