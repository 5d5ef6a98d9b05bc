"""Who is in the network: every node counts the cameras that it is connected to, without a centre.

Each node observes the links to its own neighbours. Those that are down are told along with the rounds' values
and passed on, as in link-state routing (McQuillan, Richer & Rosen 1980, *The new routing algorithm for the
ARPANET*); who is connected follows from the graph without them. Where every link is up, nothing is told.
"""

import math
from collections.abc import Iterable

from network.graphs.graph import Graph

Report = tuple[int, int]
"""A link that was down, by its number among the graph's sorted edges, and the frame in which it was."""


class Membership:
    """What one node knows of the network's links.

    A report is about one frame and counts for as many frames as it may need to cross the network, ⌈(C-1) / t⌉
    with t rounds a frame: a link that is up again is told down by nobody, and the reports about it run out.

    Attributes:
        down: Links that were down lately, by number, each with the last frame; nearly always empty.
    """

    def __init__(self, name: str, graph: Graph, iterations: int) -> None:
        """A node that takes all links to be up.

        Args:
            name: The node.
            graph: The network when all are there; of links that it does not have, nothing is believed.
            iterations: Rounds in each frame: how many links a report travels in one.
        """
        self._name, self._graph = name, graph
        self._edges = sorted(graph.edges)
        self._numbers = {edge: number for number, edge in enumerate(self._edges)}
        self._horizon = max(1, math.ceil((len(graph.names) - 1) / max(iterations, 1)))
        self.down: dict[int, int] = {}

    def lose(self, neighbor: str, frame: int) -> None:
        """The node does without a neighbour in a frame."""
        number = self._number(neighbor)
        if number is not None:
            self._take(number, frame)

    def hear(self, reports: Iterable[Report], frame: int) -> None:
        """Takes what a neighbour tells in a frame; what cannot be is passed over."""
        for number, when in reports:
            if number < len(self._edges) and frame - self._horizon < when <= frame:
                self._take(number, when)

    def is_down(self, neighbor: str, frame: int) -> bool:
        """Whether one of the two ends does without the other in a frame."""
        number = self._number(neighbor)
        return number is not None and self.down.get(number) == frame

    def reports(self, frame: int) -> tuple[Report, ...]:
        """What is to be told in a frame."""
        oldest = frame - self._horizon + 1
        self.down = {number: when for number, when in self.down.items() if when >= oldest}
        return tuple(sorted((number, when) for number, when in self.down.items() if when <= frame))

    def members(self, frame: int) -> tuple[str, ...]:
        """The nodes that the node is connected to, itself among them, sorted by name."""
        down = {self._edges[number] for number, _ in self.reports(frame)}
        if not down:
            return tuple(sorted(self._graph.names))
        parts = Graph(self._graph.names, self._graph.edges - down).components()
        (own,) = (part for part in parts if self._name in part)
        return tuple(sorted(own))

    def _take(self, number: int, frame: int) -> None:
        self.down[number] = max(frame, self.down.get(number, -1))

    def _number(self, neighbor: str) -> int | None:
        edge = (neighbor, self._name) if neighbor < self._name else (self._name, neighbor)
        return self._numbers.get(edge)
