"""A network in memory: many nodes in one thread, with the bytes and the counts of the real one.

Messages are encoded, queued and decoded in the order in which they arrive, in virtual time; those that arrive
at the same time, in the order in which they were posted. A run is the same every time and, where links are
perfect, equal to one of processes, bit for bit.
"""

import heapq
from collections.abc import Mapping
from dataclasses import dataclass, field

from network.errors import RefusedMessage
from network.links.conditions import Channel, ConditionsOptions
from network.links.transport import Links, Traffic
from network.wire import codec
from network.wire.messages import ConsensusMessage, Message, PeerMessage


@dataclass(frozen=True, slots=True, order=True)
class _Parcel:
    arrival_ns: int
    number: int
    sender: str = field(compare=False)
    receiver: str = field(compare=False)
    kind: type[PeerMessage] = field(compare=False)
    data: bytes = field(compare=False)


class MemoryNetwork:
    """Carries the messages of all nodes of a run.

    Attributes:
        counters: What each node has sent, received and refused.
    """

    def __init__(
        self,
        run: str,
        links: Mapping[str, Links],
        conditions: ConditionsOptions | None = None,
        seed: int = 0,
    ) -> None:
        """A network in which all nodes are there.

        Args:
            run: Name of the run.
            links: Every node with the nodes that it is linked to.
            conditions: What links do to the messages of the rounds; None for nothing.
            seed: The scenario's, for what links do by chance.
        """
        self.counters = {name: Traffic() for name in links}
        self._run = run
        self._links = dict(links)
        self._alive = set(links)
        self._parcels: list[_Parcel] = []  # a heap
        self._posted = 0
        self._channels = {
            (source, target): Channel(conditions, seed, source, target)
            for source, its in links.items()
            for target in its.neighbors
            if conditions is not None and not conditions.are_perfect
        }

    def leave(self, name: str) -> None:
        """A node is gone: nothing more is delivered to it."""
        self._alive.discard(name)
        self._parcels = [parcel for parcel in self._parcels if parcel.receiver != name]
        heapq.heapify(self._parcels)

    def join(self, name: str) -> None:
        """A node is back."""
        self._alive.add(name)

    @property
    def next_ns(self) -> int | None:
        """When the next message arrives, in ns of virtual time; None when nothing is on its way."""
        return self._parcels[0].arrival_ns if self._parcels else None

    def post(self, sender: str, message: Message, now_ns: int = 0) -> None:
        """Sends a message of a node to whom it concerns; a public one is encoded and counted only."""
        data = codec.encode(self._run, message)
        if not isinstance(message, PeerMessage):
            self.counters[sender].count(message.kind, len(data), 1)
            return
        receivers = [name for name in self._links[sender].receivers()[type(message)] if name in self._alive]
        self.counters[sender].count(message.kind, len(data), len(receivers))
        for receiver in receivers:
            arrivals: tuple[int, ...] = (now_ns,)
            if isinstance(message, ConsensusMessage):
                self.counters[sender].sent[receiver] += 1
                channel = self._channels.get((sender, receiver))
                if channel is not None:
                    arrivals = channel.carry(now_ns, len(data), message.frame)
            for arrival_ns in arrivals:
                self._posted += 1
                parcel = _Parcel(arrival_ns, self._posted, sender, receiver, type(message), data)
                heapq.heappush(self._parcels, parcel)

    def deliver(self) -> tuple[str, PeerMessage] | None:
        """The next message with its receiver, None when nothing is on its way."""
        while self._parcels:
            parcel = heapq.heappop(self._parcels)
            counters = self.counters[parcel.receiver]
            try:
                message = codec.decode(parcel.kind, self._run, parcel.sender, parcel.data)
            except RefusedMessage as refusal:
                counters.refuse(parcel.sender, refusal.reason)
                continue
            if isinstance(message, ConsensusMessage):
                counters.received[parcel.sender] += 1
            return parcel.receiver, message
        return None
