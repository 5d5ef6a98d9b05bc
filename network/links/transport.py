"""What carries a node's messages: the interface, who hears whom, and what is counted.

A node's shell speaks to a ``Transport`` and knows nothing of Zenoh. ``MemoryNetwork`` does the same work for
many nodes in one thread; both count alike.
"""

import logging
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

from network.graphs.graph import Graph
from network.wire.messages import (
    ConfirmMessage,
    ConsensusMessage,
    ControlMessage,
    EstimateMessage,
    PeerMessage,
    PixelsMessage,
    PreviewMessage,
    StateMessage,
    StatusMessage,
)

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Links:
    """Whom one node exchanges messages with.

    Attributes:
        neighbors: Nodes that it runs consensus with, both ways.
        sinks: Nodes that get its pictures and confirm them.
        cameras: Nodes whose pictures it gets and confirms.

    Raises:
        ValueError: Another node has two of these parts; it would speak with two voices under one name.
    """

    neighbors: tuple[str, ...] = ()
    sinks: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        others = Counter(self.neighbors + self.sinks + self.cameras)
        for name, parts in others.items():
            if parts > 1:
                raise ValueError(f"{name} is linked twice: it can be a neighbour, a sink or a camera")

    def heard(self) -> dict[str, type[PeerMessage]]:
        """The nodes that speak to this one, and what each of them sends."""
        return {
            **dict.fromkeys(self.neighbors, ConsensusMessage),
            **dict.fromkeys(self.sinks, ConfirmMessage),
            **dict.fromkeys(self.cameras, PixelsMessage),
        }

    def receivers(self) -> dict[type[PeerMessage], tuple[str, ...]]:
        """The nodes that this one's messages go to, by what they are."""
        return {
            ConsensusMessage: self.neighbors,
            PixelsMessage: self.sinks,
            ConfirmMessage: self.cameras,
        }


def links_of(graph: Graph, sinks: Iterable[str] = ()) -> dict[str, Links]:
    """The links of all nodes: consensus along the graph's edges, pictures from all its nodes to all sinks."""
    sinks = tuple(sinks)
    return {
        **{name: Links(neighbors=graph.neighbors(name), sinks=sinks) for name in graph.names},
        **{name: Links(cameras=graph.names) for name in sinks},
    }


@dataclass(frozen=True, slots=True, eq=False)
class Traffic:
    """What a node has sent and refused.

    Attributes:
        messages: Messages sent, by kind. One to d receivers counts d times; a public one once.
        bytes: Their payloads in bytes, counted likewise.
        refused: Peers' messages that could not be used, by reason.
        sent: Messages of the rounds to each neighbour that was there.
        received: Messages of the rounds that arrived from each neighbour, those that came twice twice.
    """

    messages: Counter[str] = field(default_factory=Counter)
    bytes: Counter[str] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    sent: Counter[str] = field(default_factory=Counter)
    received: Counter[str] = field(default_factory=Counter)

    def count(self, kind: str, size_bytes: int, receivers: int) -> None:
        """Counts a message of one kind that is sent."""
        self.messages[kind] += receivers
        self.bytes[kind] += receivers * size_bytes

    def refuse(self, sender: str, reason: str) -> None:
        """Counts a message that is refused, and logs the first of its reason."""
        if not self.refused[reason]:
            _log.warning("refused a message of %s (%s); more of this kind are only counted", sender, reason)
        self.refused[reason] += 1


@dataclass(frozen=True, slots=True)
class LostMessage:
    """A message of the rounds that is known to be lost: nobody need wait for it.

    Attributes:
        sender: Who sent it.
        frame: Frame of the run.
        round: Round within the frame, from 1.
    """

    sender: str
    frame: int
    round: int


Take = Callable[[PeerMessage | LostMessage], Iterable[ConsensusMessage]]
"""What a node does with a neighbour's message: it answers with some of its own, or none."""


@runtime_checkable
class Transport(Protocol):
    """A node's way to the others.

    Attributes:
        counters: What it has sent and refused.
    """

    counters: Traffic

    def announce(self) -> None:
        """Tells everybody that this node hears: from here on messages to it arrive."""

    def alive(self, name: str) -> bool:
        """Whether a node has announced itself and is there."""

    def gone_meanwhile(self) -> frozenset[str]:
        """Nodes that have gone since this was last called, also those that are back."""

    def wait_until_alive(self, names: Iterable[str], timeout_s: float) -> tuple[str, ...]:
        """Waits until nodes are alive; returns those that are still missing when time is up."""

    def wait_for_control(self, timeout_s: float) -> ControlMessage | None:
        """The next order to this run, None when time is up; 0 only looks."""

    @property
    def watched(self) -> bool:
        """Whether somebody looks at previews: they are sent only then."""

    def send(self, message: PeerMessage | EstimateMessage | StatusMessage | PreviewMessage) -> None:
        """Sends a message of this node to whom it concerns."""

    def receive(self, sender: str, timeout_s: float) -> PeerMessage | LostMessage | None:
        """The next valid message of one of the nodes that are linked to this one.

        Args:
            sender: The node.
            timeout_s: How long to wait for it; 0 only looks.

        Returns:
            Its message, that it was lost where that is known, None when time is up or the sender is gone.
        """

    def exchange(self, take: Take, awaited: Callable[[], Sequence[str]], timeout_s: float) -> None:
        """Hears neighbours and answers them, until nobody is awaited, one of these is gone, or time is up.

        Both functions are called wherever a message comes, one call at a time, and must be quick.

        Args:
            take: Takes the next message of a node that is awaited, or that it is lost; returns what to send.
            awaited: The nodes from whom a message is wanted now, in the order in which they are read.
            timeout_s: How long at most; 0 only reads what has come.

        Raises:
            Exception: What one of the functions has raised.
        """

    def offer(self, state: StateMessage) -> None:
        """Keeps what this node knows, for neighbours that ask."""

    def ask(self, name: str, timeout_s: float) -> StateMessage | None:
        """What another node knows, None where it does not answer in time or has nothing to tell."""

    def close(self) -> None:
        """Leaves the network, within seconds whatever the others do."""
