"""A camera's rounds with its neighbours: whom it waits for, who is gone and who is back, in all frames.

One state machine averages one frame at a time; where the rounds of several frames overlap, there is one for
each of them, and what is known of a neighbour holds for all.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet

import numpy as np
from jaxtyping import Float

from network.links.transport import LostMessage
from network.rounds.consensus import Consensus
from network.wire.messages import ConsensusMessage, PeerMessage

SILENT_ROUNDS = 12
"""Rounds in a row without a word of a neighbour after which it is gone: by 30% loss, one in a million."""

Outgoing = tuple[ConsensusMessage, ...]


class Rounds:
    """The averaging of a camera, over its frames."""

    def __init__(self, lanes: Sequence[Consensus]) -> None:
        """No frame yet.

        Args:
            lanes: The state machines: as many as frames whose rounds may overlap.
        """
        self._lanes = tuple(lanes)
        self._silent: Counter[str] = Counter()
        self._frame = 0

    def of(self, frame: int) -> Consensus:
        """The averaging of a frame."""
        return self._lanes[frame % len(self._lanes)]

    def begin(self, frame: int, value: Float[np.ndarray, " K"]) -> Outgoing:
        """Opens a frame's rounds with the camera's own value."""
        self._frame = frame
        return self.of(frame).begin(frame, value)

    def under_way(self, frames: Iterable[int]) -> dict[int, int]:
        """Those of some frames whose rounds are not over, and the round, from 1, that each is in."""
        return {frame: lane.rounds_done + 1 for frame in frames if not (lane := self.of(frame)).done}

    def awaited(self, frames: Iterable[int]) -> tuple[str, ...]:
        """Neighbours that some frames wait for; none where the first frame's rounds are over."""
        awaited: tuple[str, ...] = ()
        for frame in frames:
            awaited += self.of(frame).waiting_for()
            if not awaited:
                break
        return awaited

    def take(self, message: PeerMessage | LostMessage) -> Outgoing:
        """Takes what a link brings: a neighbour's message, or that it is lost; all else is passed over."""
        if isinstance(message, ConsensusMessage):
            return self.receive(message)
        return self.miss(message) if isinstance(message, LostMessage) else ()

    def receive(self, message: ConsensusMessage) -> Outgoing:
        """Takes a neighbour's message; who was gone and speaks of these frames is counted on again."""
        if self._silent:
            self._silent.pop(message.sender, None)
        if message.sender in self.gone and message.frame > self._frame - len(self._lanes):
            self.restore(message.sender)
        return self.of(message.frame).receive(message)

    def restore(self, neighbor: str) -> None:
        """Counts on a neighbour again, from the next frame on."""
        for lane in self._lanes:
            lane.restore(neighbor)

    def lose(self, neighbor: str) -> Outgoing:
        """A neighbour is gone: the rounds go on without it."""
        self._silent.pop(neighbor, None)
        return sum((lane.drop(neighbor) for lane in self._lanes), ())

    def expire(self, frame: int) -> Outgoing:
        """Does a frame's round without those that are late; they have been silent for one more."""
        self._silent.update(self.of(frame).waiting_for())
        return self.of(frame).expire() + self._lose_the_silent()

    def miss(self, lost: LostMessage) -> Outgoing:
        """Does a round without a message that is lost; its sender has been silent for one more."""
        self._silent[lost.sender] += lost.sender not in self.gone
        return self.of(lost.frame).miss(lost.sender, lost.frame, lost.round) + self._lose_the_silent()

    def cut(self) -> None:
        """Ends the rounds of all frames."""
        for lane in self._lanes:
            lane.cut()

    def _lose_the_silent(self) -> Outgoing:
        """Who has said nothing for a whole dozen of rounds is taken to be gone."""
        silent = sorted(name for name, rounds in self._silent.items() if rounds >= SILENT_ROUNDS)
        return sum((self.lose(name) for name in silent), ())

    @property
    def gone(self) -> AbstractSet[str]:
        """The neighbours that it goes on without."""
        return self._lanes[0].gone

    @property
    def heard(self) -> Mapping[str, int]:
        """The latest frame in which each neighbour has spoken, -1 for one that never has."""
        names = self._lanes[0].neighbors
        return {name: max(lane.heard[name] for lane in self._lanes) for name in names}

    @property
    def done(self) -> int:
        """Rounds done since the first frame."""
        return sum(lane.rounds_in_all for lane in self._lanes)

    @property
    def counters(self) -> Mapping[str, int]:
        """Messages that were of no use, by reason, and rounds and frames that were not whole."""
        return dict(sum((lane.counters for lane in self._lanes), Counter[str]()))
