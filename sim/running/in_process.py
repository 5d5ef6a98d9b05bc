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

from network.links.conditions import NS
from network.links.memory import MemoryNetwork
from network.wire.messages import (
    ConsensusMessage,
    EstimateMessage,
    Message,
    PixelsMessage,
    PreviewMessage,
    StatusMessage,
    TruthMessage,
)
from nodes.central import Central
from nodes.imaging.sources import FrameSource
from nodes.shell.telemetry import State, Telemetry
from nodes.smart_camera import SmartCamera
from sim.assembly import Assembly
from sim.faults.schedule import Absence, absences, slowness_s

Told = EstimateMessage | TruthMessage | StatusMessage | PreviewMessage
"""What a run tells the outside."""
Nodes = dict[str, SmartCamera | Central]
"""The nodes of a run by name."""
LEASE_NS = NS
"""How long a node that hangs still counts as there: the lease of the real network's links."""


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
        self._absences = absences(scenario.faults)
        self._away: set[str] = set()
        self._noticed_ns: dict[str, int] = {}  # when the others will know that a node is away
        self._slow: dict[str, tuple[int, int]] = {}  # when a node will be done with which frame's picture
        self._now_ns = 0
        self._begun_ns: list[int] = []  # by frame

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
        self._begun_ns.append(self._now_ns)
        self._images = {name: source.read(frame) for name, source in sorted(self._sources.items())}
        for absence in self._absences:
            if absence.begin == frame:
                self._leave(absence)
            elif absence.end == frame:
                # its first message is there before the others begin the frame
                self._return(absence)
                yield from self._open(absence.node, frame)
                yield from self._deliver()
        back = {absence.node for absence in self._absences if absence.end == frame}
        for name in self._images.keys() - self._away - back - self._slow.keys():
            late_ns = round(NS * slowness_s(self._assembly.scenario.faults, name, frame))
            self._slow[name] = (self._now_ns + late_ns, frame)
        yield from self._take_pictures()

    def _take_pictures(self) -> Iterator[EstimateMessage]:
        """The local filters of those that are done with it by now."""
        for name, (due_ns, frame) in sorted(self._slow.items()):
            if due_ns > self._now_ns:
                continue
            del self._slow[name]
            yield from self._open(name, frame)

    def _open(self, name: str, frame: int) -> Iterator[EstimateMessage]:
        """A camera's picture is there: its local filter, and its first message."""
        image = self._images[name]
        if self._central is not None:
            self._network.post(name, PixelsMessage(name, frame, image), self._now_ns)
        camera = self._cameras.get(name)
        if camera is None:
            return
        began = time.perf_counter()
        outgoing = camera.on_frame(frame, image)
        self._telemetry[name].local_filter_s.append(time.perf_counter() - began)
        yield from self._speak(name, outgoing)

    def _leave(self, absence: Absence) -> None:
        """A node is killed, which its neighbours see at once, or hangs, which they see after a lease."""
        name = absence.node
        self._network.leave(name)
        self._away.add(name)
        self._slow.pop(name, None)
        self._noticed_ns[name] = self._now_ns + (0 if absence.forgets else LEASE_NS)

    def _return(self, absence: Absence) -> None:
        """A node is back, and goes on with the newest of what its neighbours know."""
        name = absence.node
        self._network.join(name)
        self._away.discard(name)
        self._noticed_ns.pop(name, None)
        if name not in self._cameras:
            return
        if absence.forgets:
            self._cameras[name] = self._nodes[name] = self._assembly.smart_camera(name)
        there = [other for other in self._assembly.links[name].neighbors if other not in self._away]
        if there:
            state = max((self._cameras[other].state for other in there), key=lambda state: state.frame)
            self._cameras[name].on_return(self._images[name], state)

    def _notice(self) -> Iterator[EstimateMessage]:
        """Nodes that are away are seen to be."""
        for name, noticed_ns in sorted(self._noticed_ns.items()):
            if noticed_ns > self._now_ns:
                continue
            del self._noticed_ns[name]
            links = self._assembly.links[name]
            for other in (*links.neighbors, *links.sinks):
                if other in self._nodes and other not in self._away:
                    yield from self._speak(other, self._nodes[other].on_lost(name))

    def _next_begin_ns(self, frame: int) -> int | None:
        """When the frame after this one begins: in lockstep when nobody waits any more, which is None."""
        if self._pace.kind == "lockstep":
            return None
        return round(NS * self._pace.begin_s(frame + 1))

    def _pass_time(self, until_ns: int | None) -> Iterator[EstimateMessage]:
        """Everything that happens until then, or until nobody waits any more."""
        while True:
            yield from self._notice()
            yield from self._take_pictures()
            yield from self._deliver()
            deadlines = self._deadlines_ns()
            due = [*deadlines.values(), *(due_ns for due_ns, _ in self._slow.values())]
            if self._central is not None:
                # it waits until it notices
                due += [ns for name, ns in self._noticed_ns.items() if name in self._central.waiting_for]
            if until_ns is None and not due:
                return
            events = [*due, *self._noticed_ns.values()]
            if self._network.next_ns is not None:
                events.append(self._network.next_ns)
            if not events or (until_ns is not None and min(events) > until_ns):
                break
            self._now_ns = max(self._now_ns, min(events))
            yield from self._notice()
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
            if name not in self._away
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
        node = self._nodes.get(receiver)
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
        for name in self._network.counters:
            counters = self._cameras[name].counters if name in self._cameras else {}
            traffic = self._network.counters[name]
            yield self._telemetry[name].status(name, state, frame, traffic, counters)
