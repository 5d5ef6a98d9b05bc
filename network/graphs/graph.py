"""Communication graphs: which nodes talk to each other. Everything about their shape lives here.

A graph is a value: names in the scenario's order and undirected edges. Node processes read it, so it needs
nothing but NumPy.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations, pairwise

import numpy as np
from jaxtyping import Float

Edge = tuple[str, str]
_TOLD = 12  # names in an error message


@dataclass(frozen=True, slots=True)
class Graph:
    """An undirected graph of nodes.

    Attributes:
        names: The nodes, in the order of rows and columns of its matrices.
        edges: Pairs of neighbours, each sorted by name.
    """

    names: tuple[str, ...]
    edges: frozenset[Edge]
    _neighbors: Mapping[str, tuple[str, ...]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        found: dict[str, list[str]] = {name: [] for name in self.names}
        for a, b in self.edges:
            found[a].append(b)
            found[b].append(a)
        sorted_ = {name: tuple(sorted(others)) for name, others in found.items()}
        object.__setattr__(self, "_neighbors", sorted_)

    @staticmethod
    def from_edges(names: Iterable[str], edges: Iterable[Edge]) -> "Graph":
        """A graph from its nodes and the pairs that talk to each other.

        Raises:
            ValueError: A name is there twice, an edge names no node, or it joins a node to itself.
        """
        names = tuple(names)
        known = set(names)
        if len(known) < len(names):
            (name, _), *_ = Counter(names).most_common(1)
            raise ValueError(f"node {name} is in the graph twice: give each node its own name")
        pairs = [_pair(a, b) for a, b in edges]
        for a, b in pairs:
            unknown = sorted({a, b} - known)
            if unknown:
                raise ValueError(
                    f"edge {a}-{b} names {unknown[0]}, which is no node; nodes: {', '.join(names)}"
                )
            if a == b:
                raise ValueError(f"edge {a}-{b} joins a node to itself: remove it")
        return Graph(names, frozenset(pairs))

    @property
    def max_degree(self) -> int:
        """The largest number of neighbours that a node has."""
        return max((self.degree(name) for name in self.names), default=0)

    def neighbors(self, name: str) -> tuple[str, ...]:
        """A node's neighbours, sorted by name.

        Raises:
            ValueError: There is no node of this name.
        """
        if name not in self._neighbors:
            raise ValueError(f"{name} is no node of the graph; nodes: {', '.join(self.names)}")
        return self._neighbors[name]

    def degree(self, name: str) -> int:
        """How many neighbours a node has."""
        return len(self.neighbors(name))

    def components(self) -> tuple[tuple[str, ...], ...]:
        """The connected parts, in the order of their first nodes."""
        parts: list[tuple[str, ...]] = []
        reached: set[str] = set()
        for root in self.names:
            if root in reached:
                continue
            part, frontier = {root}, [root]
            while frontier:
                found = set(self.neighbors(frontier.pop())) - part
                part |= found
                frontier.extend(found)
            reached |= part
            parts.append(tuple(name for name in self.names if name in part))
        return tuple(parts)

    def require_connected(self) -> None:
        """Checks that every node reaches every other one.

        Raises:
            ValueError: The graph falls into parts, which it names.
        """
        parts = self.components()
        if len(parts) > 1:
            listed = _shortened(" | ", [_shortened(", ", part) for part in parts])
            raise ValueError(f"the graph falls into {len(parts)} parts, {listed}: add edges that join them")

    def laplacian(self) -> Float[np.ndarray, "C C"]:
        """Degrees on the diagonal, -1 for each pair of neighbours."""
        row = {name: index for index, name in enumerate(self.names)}
        L = np.zeros((len(row), len(row)))
        for a, b in self.edges:
            i, j = row[a], row[b]
            L[i, j] = L[j, i] = -1.0
            L[i, i] += 1.0
            L[j, j] += 1.0
        return L


def path(names: Sequence[str]) -> Graph:
    """Each node talks to the one before it and the one after it."""
    return Graph.from_edges(names, pairwise(names))


def ring(names: Sequence[str]) -> Graph:
    """A path whose ends meet."""
    closing = [(names[-1], names[0])] if len(names) > 2 else []
    return Graph.from_edges(names, [*pairwise(names), *closing])


def star(names: Sequence[str]) -> Graph:
    """All nodes talk to the first one only."""
    return Graph.from_edges(names, [(names[0], name) for name in names[1:]])


def complete(names: Sequence[str]) -> Graph:
    """Every node talks to every other one."""
    return Graph.from_edges(names, combinations(names, 2))


def grid(names: Sequence[str]) -> Graph:
    """Nodes in rows, as square as their number allows; each talks to those beside, above and below it."""
    columns = math.isqrt(max(len(names) - 1, 0)) + 1
    beside = [
        pair for start in range(0, len(names), columns) for pair in pairwise(names[start : start + columns])
    ]
    return Graph.from_edges(names, [*beside, *zip(names, names[columns:], strict=False)])


def _shortened(between: str, names: Sequence[str]) -> str:
    """Names in a row; of many, the first ones and how many there are more."""
    first, rest = names[:_TOLD], len(names) - _TOLD
    return between.join([*first, f"{rest} more"] if rest > 0 else first)


def _pair(a: str, b: str) -> Edge:
    return (a, b) if a <= b else (b, a)
