"""The life of the central node in its shell: pictures in, confirmations and the centralised estimate out."""

import time
from collections.abc import Iterable

from network.links.transport import Links
from network.wire.messages import PixelsMessage
from nodes.central import Central
from nodes.shell.process import PATIENCE_S, Shell


def run_central(node: Central, links: Links, shell: Shell) -> None:
    """The life of the central node."""
    if not shell.wait_for_start(node.cameras):
        return
    while node.frame < shell.frames and not shell.stopped:
        index = node.frame
        shell.await_frame(index)
        # cameras that were gone and send again
        there = [camera for camera in links.cameras if shell.transport.alive(camera)]
        if not node.cameras and not there:
            break
        _read(node, set(there) - node.cameras, shell, 0 if node.cameras else PATIENCE_S)
        deadline = shell.began(index) + shell.pace.budget_s
        while node.frame == index and node.cameras and not shell.stopped:
            camera = node.waiting_for[0]
            left = deadline - time.monotonic()
            message = shell.transport.receive(camera, min(max(left, 0.0), PATIENCE_S))
            if isinstance(message, PixelsMessage):
                began = time.perf_counter()
                shell.send(node.on_message(message))
                if node.frame != index:
                    shell.telemetry.local_filter_s.append(time.perf_counter() - began)
            elif not shell.transport.alive(camera) or (left <= 0 and shell.pace.kind == "lockstep"):
                shell.send(node.on_lost(camera))
                deadline = shell.began(index) + shell.pace.budget_s
            elif left <= 0:
                shell.telemetry.late += 1
                # those behind the one that was waited for
                _read(node, node.waiting_for, shell)
                if node.frame == index:
                    shell.send(node.on_deadline())
        shell.report_now_and_then(node.frame - 1, {})
    shell.leave(node.frame - 1, {}, finished=node.frame == shell.frames)


def _read(node: Central, cameras: Iterable[str], shell: Shell, timeout_s: float = 0) -> None:
    """Takes all that has come from cameras; waits so long for the next."""
    for camera in sorted(cameras):
        while shell.transport.alive(camera):
            message = shell.transport.receive(camera, timeout_s)
            if not isinstance(message, PixelsMessage):
                break
            shell.send(node.on_message(message))
