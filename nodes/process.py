"""The shell around a node: the one place that listens, speaks, and looks at the clock.

A node's life is four lines: announce, wait for the start, one frame after the other, leave.
"""

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass
from threading import Event
from typing import Literal

import numpy as np
from jaxtyping import UInt8

from network.messages import (
    ConfirmMessage,
    ConsensusMessage,
    ControlMessage,
    EstimateMessage,
    PixelsMessage,
)
from network.transport import Links, Transport
from nodes.central import Central
from nodes.smart_camera import SmartCamera
from nodes.sources import FrameSource
from nodes.telemetry import Counters, State, Telemetry

AHEAD = 2
"""Frames that a camera may be ahead of the last one that the sink of its pictures has confirmed."""
REPORT_PERIOD_S = 1.0
"""How often a node tells how it is, while somebody looks."""
PATIENCE_S = 0.25
"""How long a wait lasts at most before the shell looks whether it has been told to stop."""


@dataclass(frozen=True, slots=True)
class Pace:
    """When frames begin and end.

    Attributes:
        kind: `lockstep` or `realtime`.
        rate_hz: Frames a second.
        deadline_s: In lockstep, how long a frame waits for a message before its sender counts as gone.
    """

    kind: Literal["lockstep", "realtime"]
    rate_hz: float
    deadline_s: float


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
            if not missing:
                # Said again until the start, for a launcher that comes later.
                self.report("ready", -1, {})
            order = self.transport.wait_for_control(0 if missing else PATIENCE_S)
            if order is not None:
                return self._obey(order)
        return False

    def wait_for_stop(self) -> None:
        """Stays until everybody is done: a goodbye could overtake the last messages to the others."""
        limit = time.monotonic() + self.pace.deadline_s
        while not self.stopped and time.monotonic() < limit:
            order = self.transport.wait_for_control(PATIENCE_S)
            if order is not None and order.action == "stop":
                return

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
            early = self._start_s + index / self.pace.rate_hz - time.time()
            if early < -1 / self.pace.rate_hz and index > 0:
                self.telemetry.late += 1
                return False
            self._stopped.wait(max(0.0, early))
        return not self.stopped

    def deadline(self, index: int) -> float:
        """When a frame that begins now has to be done, on the monotonic clock."""
        if self.pace.kind == "lockstep":
            return time.monotonic() + self.pace.deadline_s
        left = self._start_s + (index + 1) / self.pace.rate_hz - time.time()
        return time.monotonic() + left

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
    for index in range(shell.frames):
        if not shell.await_frame(index):
            continue
        image = source.read(index) if index else first
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
        began = time.perf_counter()
        _send(outgoing, shell)
        _rounds(node, shell.deadline(index), shell)
        shell.telemetry.consensus_round_s.append((time.perf_counter() - began) / max(node.rounds_done, 1))
        done = done if shell.stopped else index
        if index == 0:
            shell.report("running", index, node.counters)
        shell.show(node, index, image)
    source.close()
    shell.report("failed" if shell.stopped else "done", done, node.counters)
    shell.wait_for_stop()


def _rounds(node: SmartCamera, deadline: float, shell: Shell) -> None:
    """Passes messages between the neighbours and the node until the frame is done."""
    while node.waiting_for and not shell.stopped:
        neighbor = node.waiting_for[0]
        left = deadline - time.monotonic()
        message = shell.transport.receive(neighbor, min(max(left, 0.0), PATIENCE_S))
        if isinstance(message, ConsensusMessage):
            _send(node.on_message(message), shell)
        elif not shell.transport.alive(neighbor):
            _send(node.on_lost(neighbor), shell)
        elif left <= 0 and shell.pace.kind == "realtime":
            shell.telemetry.late += 1
            _send(node.on_deadline(), shell)
        elif left <= 0:
            _send(node.on_lost(neighbor), shell)
            # Those that waited for it as well have a budget of their own.
            deadline = time.monotonic() + shell.pace.deadline_s


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


def run_central(node: Central, shell: Shell) -> None:
    """The life of the central node."""
    if not shell.wait_for_start(node.cameras):
        return
    while node.frame < shell.frames and node.cameras and not shell.stopped:
        index = node.frame
        shell.await_frame(index)
        deadline = shell.deadline(index)
        while node.frame == index and node.cameras and not shell.stopped:
            camera = node.waiting_for[0]
            left = deadline - time.monotonic()
            message = shell.transport.receive(camera, min(max(left, 0.0), PATIENCE_S))
            if isinstance(message, PixelsMessage):
                began = time.perf_counter()
                _send(node.on_message(message), shell)
                if node.frame != index:
                    shell.telemetry.local_filter_s.append(time.perf_counter() - began)
            elif not shell.transport.alive(camera) or (left <= 0 and shell.pace.kind == "lockstep"):
                _send(node.on_lost(camera), shell)
                deadline = shell.deadline(index)
            elif left <= 0:
                shell.telemetry.late += 1
                _send(node.on_deadline(), shell)
        shell.report_now_and_then(node.frame - 1, {})
    shell.report("done" if node.frame == shell.frames else "failed", node.frame - 1, {})
    shell.wait_for_stop()


def _send(messages: Iterable[ConsensusMessage | EstimateMessage | ConfirmMessage], shell: Shell) -> None:
    for message in messages:
        shell.transport.send(message)
