"""Three ways for a node to exchange a message with each of its neighbours: a round, and its two floors.

All three carry the same bytes over the same graph: the node's own rounds, as a run has them; Zenoh bare, with
the same kind of session, publisher and channels; and plain Unix sockets.
"""

import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

import numpy as np
import zenoh
from zenoh import CongestionControl, Locality, Priority

from network.averaging.metropolis import MetropolisWeights
from network.graphs.graph import Graph
from network.links import sessions
from network.links.transport import Links
from network.links.zenoh import ZenohTransport
from network.rounds.consensus import Consensus
from network.wire import codec, keys
from network.wire.messages import ConsensusMessage
from nodes.rounds import Rounds

N_NUMBERS = 5
"""What a camera sends on a plane."""
ROUNDS = 12
"""Rounds of a turn, as a frame has."""
PATIENCE_S = 20.0


class Exchange(ABC):
    """A way to exchange messages."""

    @abstractmethod
    def turn(self) -> None:
        """Says something to all neighbours and hears all of them, `ROUNDS` times."""

    def timed(self) -> tuple[float, float]:
        """Takes a turn; returns the time of a round and the processor time that it takes the node, in s."""
        began, processor = time.perf_counter(), time.process_time()
        self.turn()
        return (time.perf_counter() - began) / ROUNDS, (time.process_time() - processor) / ROUNDS


class ConsensusRounds(Exchange):
    """The rounds of a run: `network.rounds` over `network.links.zenoh`."""

    def __init__(self, run: str, name: str, graph: Graph, prefix: str) -> None:
        """Opens the node's transport and waits for its neighbours.

        Args:
            run: Name of the run.
            name: The node.
            graph: Who talks to whom.
            prefix: Of the sockets' paths.
        """
        links = Links(neighbors=graph.neighbors(name))
        listen, connect = _endpoints(name, graph, prefix)
        self._transport = ZenohTransport(run, name, links, listen, connect, drop_late_pixels=False)
        self._transport.announce()
        self._transport.wait_until_alive(links.neighbors, PATIENCE_S)
        algorithm = MetropolisWeights().tuned(graph, ROUNDS)
        self._name, self._rounds = name, Rounds([Consensus(name, links.neighbors, algorithm, ROUNDS)])
        self._frame = 0

    def turn(self) -> None:
        """A frame."""
        for said in self._rounds.begin(self._frame, np.arange(N_NUMBERS, dtype=float)):
            self._transport.send(said)
        self._transport.exchange(self._rounds.take, self._awaited, PATIENCE_S)
        if awaited := self._awaited():
            raise TimeoutError(f"{self._name} heard nothing of {', '.join(awaited)}")
        self._frame += 1

    def _awaited(self) -> tuple[str, ...]:
        return self._rounds.awaited((self._frame,))

    def close(self) -> None:
        """Leaves the network."""
        self._transport.close()


class BareZenoh(Exchange):
    """A publisher, a channel for each neighbour, and bytes."""

    def __init__(self, run: str, name: str, graph: Graph, prefix: str) -> None:
        """Opens a session of its own, of the same kind (see `ConsensusRounds`)."""
        listen, connect = _endpoints(name, graph, prefix)
        self._session = sessions.open_peer(listen, connect)
        self._inboxes = [
            self._session.declare_subscriber(keys.consensus(run, other), zenoh.handlers.RingChannel(64))
            for other in graph.neighbors(name)
        ]
        self._publisher = self._session.declare_publisher(
            keys.consensus(run, name),
            congestion_control=CongestionControl.BLOCK,
            priority=Priority.REAL_TIME,
            express=True,
            allowed_destination=Locality.REMOTE,
        )
        self._data = _message(run, name)

    def turn(self) -> None:
        """Puts and receives, and nothing else."""
        for _ in range(ROUNDS):
            self._publisher.put(self._data)
            for inbox in self._inboxes:
                inbox.recv().payload.to_bytes()

    def close(self) -> None:
        """Ends the session."""
        sessions.close(self._session)


class PlainSockets(Exchange):
    """A stream socket for each neighbour: what the operating system takes, and Python to call it."""

    def __init__(self, run: str, name: str, ends: Sequence[socket.socket]) -> None:
        """Ends of connected sockets, one for each neighbour."""
        self._ends, self._data = ends, _message(run, name)

    def turn(self) -> None:
        """Sends and receives, and nothing else."""
        self.rounds(ROUNDS)

    def rounds(self, count: int) -> None:
        """The same for any number of rounds."""
        for _ in range(count):
            for end in self._ends:
                end.sendall(self._data)
            for end in self._ends:
                end.recv(len(self._data), socket.MSG_WAITALL)


def connected(graph: Graph) -> Mapping[str, Sequence[socket.socket]]:
    """A pair of sockets for each edge, whose ends the nodes inherit; in the order of their neighbours."""
    pairs = {edge: socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM) for edge in sorted(graph.edges)}
    return {
        name: [pairs[min(name, other), max(name, other)][name > other] for other in graph.neighbors(name)]
        for name in graph.names
    }


def _message(run: str, name: str) -> bytes:
    return codec.encode(run, ConsensusMessage(name, 1, 1, 2, tuple(map(float, range(N_NUMBERS)))))


def _endpoints(name: str, graph: Graph, prefix: str) -> tuple[list[str], list[str]]:
    """Where a node listens, and the earlier neighbours that it connects to."""
    earlier = [other for other in graph.neighbors(name) if other < name]
    return [f"unixsock-stream/{prefix}{name}"], [f"unixsock-stream/{prefix}{other}" for other in earlier]
