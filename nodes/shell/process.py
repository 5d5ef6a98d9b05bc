"""The shell around a node: the one place that listens, speaks, and looks at the clock.

A node's life is four lines: announce, wait for the start, one frame after the other, leave.
"""

import math
import time
from collections.abc import Iterable
from threading import Event

import numpy as np
from jaxtyping import UInt8

from network.links.transport import Links, Transport
from network.wire.messages import (
    ConfirmMessage,
    ConsensusMessage,
    ControlMessage,
    EstimateMessage,
    PixelsMessage,
)
from nodes.imaging.sources import FrameSource
from nodes.shell.pace import Pace
from nodes.shell.returning import LEAD, Returning
from nodes.shell.telemetry import Counters, State, Telemetry
from nodes.smart_camera import SmartCamera

AHEAD = 2
"""Frames that a camera may be ahead of the last one that the sink of its pictures has confirmed."""
REPORT_PERIOD_S = 1.0
"""How often a node tells how it is, while somebody looks."""
PATIENCE_S = 0.25
"""How long a wait lasts at most before the shell looks whether it has been told to stop."""


class Shell:
    """What the shells of a smart camera and of the central node share: start, clock, stop."""

    def __init__(self, name: str, transport: Transport, pace: Pace, frames: int, stopped: Event) -> None:
        """A shell before the start.

        Args:
            name: The node.
            transport: Its way to the others.
            pace: When frames begin and end.
            frames: How many there are.
            stopped: Set from outside when the node is to leave.
        """
        self.name, self.transport, self.pace, self.frames = name, transport, pace, frames
        self.telemetry = Telemetry()
        self._stopped = stopped
        self._start_s = 0.0
        self._reported_s = 0.0

    def wait_for_start(self, linked: Iterable[str]) -> bool:
        """Announces the node and waits for the start; False if it is told to leave instead.

        Args:
            linked: The nodes that it must hear before it says that it is ready.
        """
        self.transport.announce()
        while not self.stopped:
            missing = self.transport.wait_until_alive(linked, PATIENCE_S)
            # Where a run is under way, those that are missing may be so for good.
            ready = not missing or any(
                self.transport.ask(name, PATIENCE_S) for name in linked if name not in missing
            )
            if ready:
                # Said again until the start, for a launcher that comes later.
                self.report("ready", -1, {})
            order = self.transport.wait_for_control(PATIENCE_S if ready else 0)
            if order is not None:
                return self._obey(order)
        return False

    def leave(self, frame: int, counters: Counters, *, finished: bool) -> None:
        """Tells the last and stays until everybody is done: a goodbye could overtake the last messages.

        Args:
            frame: The last frame that the node has finished.
            counters: What it has counted.
            finished: Whether that was the run's last.
        """
        limit = time.monotonic() + self.pace.deadline_s
        order = None
        while order is None or order.action != "stop":
            # Said again until the end, for a router that is away.
            self.report("done" if finished else "failed", frame, counters)
            if self.stopped or time.monotonic() >= limit:
                return
            order = self.transport.wait_for_control(PATIENCE_S)

    def _obey(self, order: ControlMessage) -> bool:
        if order.action == "stop":
            self._stopped.set()
            return False
        self._start_s = order.start_time_s if order.start_time_s is not None else time.time()
        return True

    @property
    def stopped(self) -> bool:
        """Whether the node is to leave."""
        return self._stopped.is_set()

    def await_frame(self, index: int) -> bool:
        """Waits for a frame's time; False where it is over already, or the node is to leave."""
        order = self.transport.wait_for_control(0)
        if order is not None and order.action == "stop":
            self._stopped.set()
        if self.pace.kind == "realtime":
            early = self.begins_in_s(index)
            if early < -1 / self.pace.rate_hz and index > 0:
                self.telemetry.late += 1
                return False
            self._stopped.wait(max(0.0, early))
        return not self.stopped

    def begins_in_s(self, index: int) -> float:
        """How long it is until a frame's time; in lockstep, frames begin at once."""
        if self.pace.kind == "lockstep":
            return 0.0
        return self._start_s + self.pace.begin_s(index) - time.time()

    def began(self, index: int) -> float:
        """When a frame that begins now is taken to have begun, on the monotonic clock."""
        return time.monotonic() + self.begins_in_s(index)

    def show(self, node: SmartCamera, index: int, image: UInt8[np.ndarray, "H W 3"]) -> None:
        """Shows a frame that is done to those who look, if anybody does."""
        if self.transport.watched:
            self.transport.send(node.preview(index, image))
            self.report_now_and_then(index, node.counters)

    def report_now_and_then(self, index: int, counters: Counters) -> None:
        """Tells those who look how the node is, once a second."""
        if self.transport.watched and time.monotonic() - self._reported_s >= REPORT_PERIOD_S:
            self._reported_s = time.monotonic()
            self.report("running", index, counters)

    def send(self, messages: Iterable[ConsensusMessage | EstimateMessage | ConfirmMessage]) -> None:
        """Sends what a node has to say, in order."""
        for message in messages:
            self.transport.send(message)

    def report(self, state: State, frame: int, counters: Counters) -> None:
        """Tells everybody how the node is."""
        self.transport.send(self.telemetry.status(self.name, state, frame, self.transport.counters, counters))


def run_camera(node: SmartCamera, source: FrameSource, links: Links, shell: Shell) -> None:
    """The life of a smart camera.

    Args:
        node: The camera.
        source: Its pictures.
        links: Its neighbours, and the central node if there is one.
        shell: Its shell.
    """
    first = source.read(0)
    if not shell.wait_for_start(links.neighbors + links.sinks):
        return
    confirmed, done = -1.0, -1
    begun: dict[int, float] = {}
    returning = Returning(shell.transport, links.neighbors, shell.pace)
    index, state = 0, returning.newest()
    while index < shell.frames:
        # who was away goes on ahead of the others
        if state is not None:
            index = max(index, state.frame + LEAD)
        if index >= shell.frames or not shell.await_frame(index):
            index += 1
            continue
        image = source.read(index) if index else first
        if state is not None:
            node.on_return(image, state)
            state = None
        elif (state := returning.missed(node, index)) is not None:
            continue
        # pixels to the central node, which confirms them in lockstep
        if links.sinks:
            if shell.pace.kind == "lockstep":
                confirmed = _await_confirmation(links.sinks[0], index - AHEAD, confirmed, shell)
            shell.transport.send(PixelsMessage(node.name, index, image))
        # local filter
        began = time.perf_counter()
        outgoing = node.on_frame(index, image)
        shell.telemetry.local_filter_s.append(time.perf_counter() - began)
        # rounds with the neighbours, and the fusion filter at their end
        shell.send(outgoing)
        begun[index] = shell.began(index)
        begun = {each: begun[each] for each in node.open_rounds}
        _rounds(node, begun, shell, frame=index + 1)
        shell.transport.offer(node.state)
        if done < 0 and not shell.stopped:
            shell.report("running", index, node.counters)
        done = done if shell.stopped else index
        shell.show(node, index, image)
        index += 1
    _rounds(node, begun, shell)
    source.close()
    shell.leave(done, node.counters, finished=not shell.stopped)


def _rounds(node: SmartCamera, begun: dict[int, float], shell: Shell, frame: int | None = None) -> None:
    """Passes messages between the neighbours and the node until its frames are done.

    Args:
        node: The node.
        begun: When its frames began, on the monotonic clock.
        shell: Its shell.
        frame: In real time, the frame at whose time the rounds of those before it are left for later.
    """
    began, rounds = time.perf_counter(), node.rounds.done
    realtime = shell.pace.kind == "realtime"
    while not shell.stopped:
        # the fusion filter, where a frame's rounds are over
        shell.send(node.on_rounds_over())
        if not node.open_rounds:
            break
        left_s = shell.begins_in_s(frame) if frame is not None and realtime else PATIENCE_S
        if left_s <= 0:
            break
        # rounds, as the neighbours' messages come
        left_s = min(
            left_s, PATIENCE_S, *(end - time.monotonic() for end in _ends(node, begun, shell).values())
        )
        shell.transport.exchange(node.rounds.take, node.awaited, left_s)
        # those who are gone, or late
        gone = sorted({name for name in node.awaited() if not shell.transport.alive(name)})
        for name in gone:
            shell.send(node.on_lost(name))
        for each, end in {} if gone else _ends(node, begun, shell).items():
            if time.monotonic() >= end:
                shell.send(node.on_round_deadline(each))
                break  # who is lost by it is lost for the other frames' rounds, too
    # those of which the time is up
    for each in list(node.open_rounds):
        if frame is not None and each + shell.pace.lag_frames < frame:
            shell.telemetry.late += 1
            shell.send(node.on_deadline(each))
    rounds = max(node.rounds.done - rounds, 1)
    shell.telemetry.consensus_round_s.append((time.perf_counter() - began) / rounds)


def _ends(node: SmartCamera, begun: dict[int, float], shell: Shell) -> dict[int, float]:
    """When the rounds that the node is in are over whatever has come, by frame, on the monotonic clock."""
    return {
        each: begun[each] + shell.pace.round_deadline_s(round_) for each, round_ in node.open_rounds.items()
    }


def _await_confirmation(sink: str, frame: int, confirmed: float, shell: Shell) -> float:
    """Waits until the sink has confirmed a frame, or is gone; returns the last frame that it has confirmed.

    A sink that misses its deadline is not waited for again: infinity.
    """
    limit = time.monotonic() + shell.pace.deadline_s
    while confirmed < frame and shell.transport.alive(sink) and not shell.stopped:
        message = shell.transport.receive(sink, PATIENCE_S)
        if isinstance(message, ConfirmMessage):
            confirmed = message.frame
        elif time.monotonic() > limit:
            return math.inf
    return confirmed
