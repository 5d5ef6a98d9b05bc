"""A network in memory: many nodes in one thread, with the bytes and the counts of the real one.

Messages are encoded, queued and decoded in the order in which they were posted, so that a run is the same
every time and equal to one of processes, bit for bit.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

from network import codec
from network.errors import RefusedMessage
from network.messages import Message, PeerMessage
from network.transport import Links, Traffic


@dataclass(frozen=True, slots=True)
class _Parcel:
    sender: str
    receiver: str
    kind: type[PeerMessage]
    data: bytes


class MemoryNetwork:
    """Carries the messages of all nodes of a run.

    Attributes:
        counters: What each node has sent and refused.
    """

    def __init__(self, run: str, links: Mapping[str, Links]) -> None:
        """A network in which all nodes are there.

        Args:
            run: Name of the run.
            links: Every node with the nodes that it is linked to.
        """
        self.counters = {name: Traffic() for name in links}
        self._run = run
        self._links = dict(links)
        self._alive = set(links)
        self._queue: deque[_Parcel] = deque()

    def leave(self, name: str) -> None:
        """A node is gone: nothing more is delivered to it."""
        self._alive.discard(name)
        self._queue = deque(parcel for parcel in self._queue if parcel.receiver != name)

    def join(self, name: str) -> None:
        """A node is back."""
        self._alive.add(name)

    def post(self, sender: str, message: Message) -> None:
        """Sends a message of a node to whom it concerns; a public one is encoded and counted only."""
        data = codec.encode(self._run, message)
        if isinstance(message, PeerMessage):
            receivers = [name for name in self._links[sender].receivers(message) if name in self._alive]
            self.counters[sender].count(message.kind, len(data), len(receivers))
            self._queue.extend(_Parcel(sender, receiver, type(message), data) for receiver in receivers)
        else:
            self.counters[sender].count(message.kind, len(data), 1)

    def deliver(self) -> tuple[str, PeerMessage] | None:
        """The next message with its receiver, None when nothing is on its way."""
        while self._queue:
            parcel = self._queue.popleft()
            try:
                return parcel.receiver, codec.decode(parcel.kind, self._run, parcel.sender, parcel.data)
            except RefusedMessage as refusal:
                self.counters[parcel.receiver].refuse(parcel.sender, refusal.reason)
        return None
