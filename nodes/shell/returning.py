"""How a node notices that it was away, and how it comes back: frames that the others have done without it.

In lockstep a neighbour that counts on a node cannot be in a later frame than the node's next one. Where all
are, they have gone on: the node was stopped, cut off or has only just been started. It goes on from what the
newest of them knows, some frames ahead of them: they hear it before they get there, and wait for it. Where
some are, the network was in parts, and those that are ahead wait.
"""

import time
from collections.abc import Iterable

from network.links.transport import Transport
from network.wire.messages import ConsensusMessage, StateMessage
from nodes.shell.pace import Pace
from nodes.smart_camera import SmartCamera

LEAD = 3
"""Frames after the last one that a neighbour has done: it is in the first, and may have begun the second."""
ASK_S = 0.5
"""How long a neighbour has for telling what it knows."""
LOOK_S = 0.05
"""How often a node that hears nobody looks whether somebody is back."""
COMPANY = 0.5
"""Part of the deadline for which it does; the central node waits for its next picture until the deadline."""


class Returning:
    """What a node does between two frames so as not to be left behind."""

    def __init__(self, transport: Transport, neighbors: Iterable[str], pace: Pace) -> None:
        """A node before its first frame.

        Args:
            transport: Its way to the others.
            neighbors: Whom it exchanges messages with.
            pace: When frames begin and end.
        """
        self._transport, self._neighbors, self._pace = transport, tuple(neighbors), pace
        self._waited = False
        self._gone: set[str] = set()  # who has gone, also who is back and was not asked since

    def newest(self) -> StateMessage | None:
        """What the neighbour that has come farthest knows of the target; None before frame 1 is done."""
        return max(self._told(self._there()), key=lambda state: state.frame, default=None)

    def missed(self, node: SmartCamera, index: int) -> StateMessage | None:
        """What to go on from where the others have gone on without the node; None where they have not.

        Args:
            node: The node.
            index: Its next frame.
        """
        for name in self._there():
            while (message := self._transport.receive(name, 0)) is not None:
                # where frames overlap, rounds go on meanwhile
                for said in node.rounds.take(message):
                    self._transport.send(said)
                # Parts of a network that hear each other again: who is ahead waits for the others.
                behind = isinstance(message, ConsensusMessage) and message.frame < index
                if behind and self._pace.kind == "lockstep":
                    node.rounds.restore(name)
        if self._pace.kind == "lockstep":
            self._wait_for_company()
            state = self._left_behind(index)
            if state is not None:
                return state
        heard = [node.rounds.heard[name] for name in self._there()]
        # In real time frames are left out all the time; only what is long away knows less than the others.
        patience = 0 if self._pace.kind == "lockstep" else LEAD + self._pace.lag_frames
        return self.newest() if heard and min(heard) > index + patience else None

    def _there(self) -> list[str]:
        return [name for name in self._neighbors if self._transport.alive(name)]

    def _told(self, names: Iterable[str]) -> list[StateMessage]:
        """What neighbours know of the target, those of them that answer."""
        told = [self._transport.ask(name, ASK_S) for name in names]
        return [state for state in told if state is not None]

    def _left_behind(self, index: int) -> StateMessage | None:
        """The newest of neighbours that are all back, and have all done the node's next frame.

        They say nothing to a node that they do not count on. So they are asked, until links that are only
        just up have brought the answers.
        """
        self._gone |= self._transport.gone_meanwhile()
        there = self._there()
        if not there or not self._gone.issuperset(self._neighbors):
            return None
        self._gone.difference_update(there)
        limit = time.monotonic() + ASK_S
        while len(told := self._told(there)) < len(there) and time.monotonic() < limit:
            time.sleep(LOOK_S)
        newest = max(told, key=lambda state: state.frame, default=None)
        return newest if all(state.frame >= index for state in told) else None

    def _wait_for_company(self) -> None:
        """Waits once for one of the neighbours, all of whom are gone: it may be the node that was away."""
        if self._there() or not self._neighbors:
            self._waited = False
            return
        limit = time.monotonic() + (0.0 if self._waited else COMPANY * self._pace.deadline_s)
        while not self._there() and time.monotonic() < limit:
            self._transport.wait_until_alive(self._neighbors, LOOK_S)
        self._waited = True
