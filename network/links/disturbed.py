"""Bad links among processes: what Zenoh delivers goes through the scenario's channels before it is heard.

The channels are those of runs in one process, with the same draws for the same messages. In real time they go
by the clock. In lockstep time does not count: whoever is late is waited for, and what is lost is known to be
so at once. Nobody waits for a deadline, and a run has the numbers of one in virtual time in which no message
comes after its round's.
"""

import time
from collections import deque
from collections.abc import Mapping, Sequence

from network.links.conditions import NS, Channel
from network.links.transport import Links, LostMessage
from network.links.zenoh import ZenohTransport
from network.wire import codec
from network.wire.messages import ConsensusMessage, PeerMessage

_LOOK_S = 5e-4
"""How often the links are looked at in real time: what has come is taken at its time."""
_FREE_NS = 3600 * NS
"""In lockstep, the time between two messages of a channel: its line is free again."""


class DisturbedTransport(ZenohTransport):
    """A node's way to the others, over links that lose, delay and double the messages of the rounds."""

    def __init__(
        self,
        run: str,
        name: str,
        links: Links,
        listen: Sequence[str],
        connect: Sequence[str],
        channels: Mapping[str, Channel],
        *,
        realtime: bool,
    ) -> None:
        """Opens the session and declares everything but the node's token.

        Args:
            run: Name of the run.
            name: The node.
            links: The nodes that it is linked to.
            listen: Endpoints where they find it.
            connect: Endpoints of the router and of those that it has to find.
            channels: From each neighbour to this node.
            realtime: Whether time counts; if not, frames are in lockstep.

        Raises:
            NetworkError: An endpoint is malformed, or one to listen on cannot be had.
        """
        super().__init__(run, name, links, listen, connect, drop_late_pixels=realtime)
        self._channels, self._realtime = dict(channels), realtime
        self._now_ns = dict.fromkeys(channels, 0)
        self._due: dict[str, deque[tuple[int, ConsensusMessage]]] = {sender: deque() for sender in channels}

    def _next(self, sender: str) -> PeerMessage | LostMessage | None:
        """The next message of a linked node that its channel has let through by now."""
        if sender not in self._channels:
            return super()._next(sender)
        return self._next_due(sender) if self._realtime else self._next_in_lockstep(sender)

    def _next_due(self, sender: str) -> ConsensusMessage | None:
        for each in self._channels:
            while isinstance(message := super()._next(each), ConsensusMessage):
                self._carry(each, message, time.monotonic_ns())
        due = self._due[sender]
        return due.popleft()[1] if due and due[0][0] <= time.monotonic_ns() else None

    def _next_in_lockstep(self, sender: str) -> PeerMessage | LostMessage | None:
        due = self._due[sender]
        if not due:
            message = super()._next(sender)
            if not isinstance(message, ConsensusMessage):
                return message
            self._now_ns[sender] += _FREE_NS
            if not self._carry(sender, message, self._now_ns[sender]):
                return LostMessage(sender, message.frame, message.round)
        return due.popleft()[1]

    def _may_come(self, sender: str) -> bool:
        """Whether a node is there to say more, or something of it is on its way."""
        return super()._may_come(sender) or bool(self._due.get(sender))

    def _wait_until(self, deadline: float) -> bool:
        """Waits for anything to change, and for what is on its way."""
        if self._realtime and deadline > (soon := time.monotonic() + _LOOK_S):
            deadline = soon
        return super()._wait_until(deadline)

    def _carry(self, sender: str, message: ConsensusMessage, now_ns: int) -> int:
        """Puts a message into its channel; returns how often it will come out."""
        size_bytes = len(codec.encode_consensus(self._run, message))
        arrivals = self._channels[sender].carry(now_ns, size_bytes, message.frame)
        self.counters.received[sender] += len(arrivals) - 1
        self._due[sender].extend((arrival_ns, message) for arrival_ns in arrivals)
        return len(arrivals)
