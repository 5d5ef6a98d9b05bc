"""Plays a recording over Zenoh: the same keys, the same bytes, nodes that come and go, at any speed.

The replay is the run's router and all of its nodes at once: whoever listens cannot tell it from a run.
"""

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol, runtime_checkable

import zenoh

from network.links import sessions
from network.links.publishers import has_listeners, publish_again
from network.wire import keys
from network.wire.messages import PreviewMessage
from sim.replay.playback import Playback
from sim.results.recorder import expected_tracks
from sim.scenario.model import Scenario

LISTENERS_S = 1.0
"""How long the first frame waits for somebody who listens."""
MOMENT_S = 0.005


@runtime_checkable
class Recording(Protocol):
    """What was told in a run.

    Attributes:
        scenario: As run.
        frames: How many are recorded.
    """

    scenario: Scenario
    frames: int

    def at(self, frame: int, *, pictures: bool) -> Iterator[tuple[str, bytes]]:
        """What was told of a frame: keys of the network and payloads."""

    def alive_at(self, frame: int) -> set[str] | None:
        """The nodes that were heard of at a frame; None where nobody listened for them."""

    def close(self) -> None:
        """Gives back what it holds open."""


class Replay:
    """A recording that is played.

    Attributes:
        playback: Where it stands; may be replaced by `steer` at any time.
    """

    def __init__(self, recording: Recording, endpoint: str, playback: Playback) -> None:
        """Opens the router where the run's was, or elsewhere.

        Args:
            recording: What is played.
            endpoint: Where listeners find it.
            playback: Where it begins, and how fast.

        Raises:
            NetworkError: The endpoint cannot be had.
        """
        self.playback = playback
        self._recording = recording
        self._steering = threading.Lock()
        self._session = sessions.open_router([endpoint])
        run = recording.scenario.name
        self._previews = [
            self._session.declare_publisher(keys.preview(run, camera.name))
            for camera in recording.scenario.cameras
        ]
        self._nodes = {node for _, node in expected_tracks(recording.scenario)}
        self._listened = self._session.declare_publisher(keys.estimate(run, min(self._nodes)))
        self._tokens: dict[str, zenoh.LivelinessToken] = {}
        self._told, self._seen = -1, False

    def run(self, progress: Callable[[int], None], audience: Callable[[float], bool] | None = None) -> None:
        """Plays until the end.

        Args:
            progress: Told how many frames have been played.
            audience: Waits so many seconds for somebody who looks on, if there will be any: playing begins
                with them, and it stays at the end, for they may turn it back.
        """
        self._show_nodes(0)
        while audience is not None and not audience(LISTENERS_S):
            pass
        self._wait_for_listeners(LISTENERS_S)
        self.steer(Playback.play)
        ended = False
        while audience is not None or not ended:
            now, playback = time.monotonic(), self.playback
            self._tell(playback.frame(now))
            progress(self._told + 1)
            ended = playback.ended(now)
            time.sleep(MOMENT_S)

    def _wait_for_listeners(self, timeout_s: float) -> None:
        limit = time.monotonic() + timeout_s
        while not has_listeners(self._listened) and time.monotonic() < limit:
            time.sleep(MOMENT_S)

    def steered(self, order: Mapping[str, Any]) -> dict[str, Any]:
        """Obeys an order of the page, if it is one, and tells how the playback is."""
        match order:
            case {"order": "play"}:
                self.steer(Playback.play)
            case {"order": "pause"}:
                self.steer(Playback.pause)
            case {"order": "seek", "value": int(frame)}:
                self.steer(lambda playback, now: playback.seek(frame, now))
            case {"order": "speed", "value": int(speed) | float(speed)}:
                self.steer(lambda playback, now: playback.at_speed(float(speed), now))
        now, playback = time.monotonic(), self.playback
        return {
            "type": "playback",
            "frame": playback.frame(now),
            "frames": playback.frames,
            "paused": playback.paused or playback.ended(now),
            "speed": playback.speed,
        }

    def steer(self, change: Callable[[Playback, float], Playback]) -> None:
        """Changes how it is played."""
        with self._steering:
            self.playback = change(self.playback, time.monotonic())

    def close(self) -> None:
        """Leaves the network."""
        sessions.close(self._session)

    def _tell(self, frame: int) -> None:
        """Tells everything up to a frame; of one that was jumped to, only that."""
        before, self._seen = self._seen, any(map(has_listeners, self._previews))
        if frame == self._told:
            if self._seen and not before:
                self._publish(frame, lambda key: key.endswith(PreviewMessage.kind))  # somebody has come
            return
        onwards = self._told < frame <= self._told + self._recording.scenario.rate_hz
        for index in range(self._told + 1, frame + 1) if onwards else (frame,):
            self._show_nodes(index)
            self._publish(index, lambda _: True, pictures=self._seen and index == frame)
        self._told = frame

    def _publish(self, frame: int, wanted: Callable[[str], bool], *, pictures: bool = True) -> None:
        """Tells again what was told of a frame.

        Args:
            frame: The frame.
            wanted: Which keys.
            pictures: Whether there is any use for pictures: whoever plays faster than can be looked at sees
                the last one only.
        """
        for key, data in self._recording.at(frame, pictures=pictures):
            if wanted(key):
                publish_again(self._session, key, data)

    def _show_nodes(self, frame: int) -> None:
        """Nodes that are there at a frame have their token."""
        heard = self._recording.alive_at(frame)
        alive = self._nodes if heard is None else heard & self._nodes
        for node in alive - self._tokens.keys():
            token = self._session.liveliness().declare_token(keys.alive(self._recording.scenario.name, node))
            self._tokens[node] = token
        for node in self._tokens.keys() - alive:
            self._tokens.pop(node).undeclare()  # type: ignore[no-untyped-call]  # zenoh's stub has none here
