"""A whole run in one process and one thread: the same nodes, their messages in memory, in virtual time.

Where links are perfect, node for node and bit for bit what the processes compute, without their start; the
way to run many. Bad links act in virtual time, in which computing takes none: messages arrive when the
conditions say, rounds end at their deadlines, and a run is the same every time.
"""

import time
from collections.abc import Iterable, Iterator, Mapping

import cv2
from threadpoolctl import threadpool_limits

from network.conditions import NS
from network.memory import MemoryNetwork
from network.messages import (
    ConsensusMessage,
    EstimateMessage,
    Message,
    PixelsMessage,
    StatusMessage,
    TruthMessage,
)
from nodes.central import Central
from nodes.smart_camera import SmartCamera
from nodes.telemetry import State, Telemetry
from sim.assembly import Assembly

Told = EstimateMessage | TruthMessage | StatusMessage
"""What a run tells the outside."""
Nodes = Mapping[str, SmartCamera | Central]
"""The nodes of a run by name."""


def run_in_process(assembly: Assembly) -> Iterator[Told]:
    """Runs a scenario and yields what it would publish, frame after frame.

    Raises:
        SourceError: A video cannot be read.
    """
    # As in the processes, so that no sum is split in another way.
    cv2.setNumThreads(1)
    threadpool_limits(1)
    yield from InProcess(assembly).run()


class InProcess:
    """A run in virtual time: what happens when, until nothing is left to happen."""

    def __init__(self, assembly: Assembly) -> None:
        """A run before its first frame, at time 0."""
        scenario = assembly.scenario
        self._assembly, self._pace = assembly, assembly.pace
        self._cameras = {name: assembly.smart_camera(name) for name in sorted(assembly.cameras)}
        self._sources = {name: assembly.source(name) for name in self._cameras}
        self._central = assembly.central() if scenario.baselines.cpf else None
        central = {self._central.name: self._central} if self._central else {}
        self._nodes: Nodes = {**self._cameras, **central}
        self._network = MemoryNetwork(
            scenario.name, assembly.links, scenario.network.conditions, scenario.seed
        )
        self._telemetry = {name: Telemetry() for name in self._nodes}
        self._now_ns = 0
        self._begun_ns: list[int] = []  # by frame

    def run(self) -> Iterator[Told]:
        """All frames, one after the other."""
        last = self._assembly.scenario.frames - 1
        for frame in range(last + 1):
            yield from self._begin(frame)
            yield from self._pass_time(self._next_begin_ns(frame) if frame < last else None)
            truth = self._assembly.truth_message(frame)
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
        self._begun_ns.append(self._now_ns)
        for name, camera in self._cameras.items():
            image = self._sources[name].read(frame)
            if self._central is not None:
                self._network.post(name, PixelsMessage(name, frame, image), self._now_ns)
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
            for (name, frame, round_), deadline_ns in deadlines.items():
                camera = self._cameras[name]
                if deadline_ns <= self._now_ns and camera.open_rounds.get(frame) == round_:
                    yield from self._speak(name, camera.on_round_deadline(frame))
        if until_ns is not None:
            self._now_ns = until_ns

    def _deadlines_ns(self) -> dict[tuple[str, int, int], int]:
        """When each round that a camera is in is over, by camera, frame and round."""
        return {
            (name, frame, round_): self._begun_ns[frame] + round(NS * self._pace.round_deadline_s(round_))
            for name, camera in self._cameras.items()
            for frame, round_ in camera.open_rounds.items()
        }

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
        node = self._nodes[receiver]
        if isinstance(node, SmartCamera) and isinstance(message, ConsensusMessage):
            yield from self._speak(receiver, node.on_message(message))
            return
        if isinstance(node, Central) and isinstance(message, PixelsMessage):
            yield from self._speak(receiver, node.on_message(message))

    def _speak(self, sender: str, messages: Iterable[Message]) -> Iterator[EstimateMessage]:
        for message in messages:
            self._network.post(sender, message, self._now_ns)
            if isinstance(message, EstimateMessage):
                yield message

    def _statuses(self, state: State, frame: int) -> Iterator[StatusMessage]:
        for name in self._nodes:
            counters = self._cameras[name].counters if name in self._cameras else {}
            traffic = self._network.counters[name]
            yield self._telemetry[name].status(name, state, frame, traffic, counters)
