"""The bare exchange over Zenoh as it comes, in a process of its own: Zenoh's threads are set once for all."""

import os
import socket
import struct
import traceback
from collections.abc import Iterable

from network.graphs.graph import Graph
from sim.benchmarks.rounds.exchange import BareZenoh, Exchange

_TIMES = struct.Struct("<dd")
_TURN = b"t"


class UntunedZenoh(Exchange):
    """`BareZenoh` in a process of its own, without `network.links.runtime`; it takes its own times."""

    def __init__(self, run: str, name: str, graph: Graph, prefix: str, closed: Iterable[int]) -> None:
        """Forks; so call it before this process has threads.

        Args:
            run: Name of the run.
            name: The node.
            graph: Who talks to whom.
            prefix: Of the sockets' paths.
            closed: Open files of this process that are not for the other one.
        """
        self._end, other = socket.socketpair()
        self._process = os.fork()
        if self._process == 0:
            self._end.close()
            for descriptor in closed:
                os.close(descriptor)
            code = 1
            try:
                _serve(run, name, graph, prefix, other)
                code = 0
            except Exception:  # noqa: BLE001 - of whatever kind: who started the processes reads it
                traceback.print_exc()
            finally:
                os._exit(code)
        other.close()

    def turn(self) -> None:
        """A turn over there."""
        self.timed()

    def timed(self) -> tuple[float, float]:
        """Times as they were over there: the orders between the two processes are not among them."""
        self._end.sendall(_TURN)
        times: tuple[float, float] = _TIMES.unpack(self._end.recv(_TIMES.size, socket.MSG_WAITALL))
        return times

    def close(self) -> None:
        """Ends the process."""
        self._end.close()
        os.waitpid(self._process, 0)


def _serve(run: str, name: str, graph: Graph, prefix: str, end: socket.socket) -> None:
    os.environ.pop("ZENOH_RUNTIME", None)
    bare = BareZenoh(run, name, graph, prefix)
    while end.recv(len(_TURN)):
        end.sendall(_TIMES.pack(*bare.timed()))
    bare.close()
