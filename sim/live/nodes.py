"""The nodes of a run as the page shows them: who is there, who has gone, and what each of them sends.

Sans-I/O: the time is an argument.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from network.wire.messages import StatusMessage

State = Literal["waiting", "alive", "lost", "done", "failed"]
"""Not heard of yet; there; gone without a goodbye; at its end; left before the end."""


@dataclass(slots=True)
class _Node:
    state: State = "waiting"
    since: int = 0
    comings: int = 0
    told: str = ""
    sent: Mapping[str, int] = field(default_factory=dict)
    sent_s: float = 0.0
    bytes_per_s: dict[str, float] = field(default_factory=dict)


class NodeStates:
    """Who is there, and what they send."""

    def __init__(self, names: Iterable[str]) -> None:
        """Nodes of which nothing has been heard."""
        self._nodes = {name: _Node() for name in sorted(names)}

    def see(self, name: str, *, here: bool, frame: int) -> list[dict[str, Any]]:
        """A node's token has come or gone, at a frame."""
        node = self._nodes.get(name)
        if node is None:
            return []
        node.comings += here
        if here:
            node.state = "alive"
        elif node.told in ("done", "failed"):
            node.state = "done" if node.told == "done" else "failed"
        else:
            node.state = "lost"
        node.since, node.told = frame, "" if here else node.told
        node.bytes_per_s = {} if not here else node.bytes_per_s
        return [self._event(name)]

    def take(self, status: StatusMessage, now_s: float) -> list[dict[str, Any]]:
        """A node tells how it is: the bytes that it has sent since it told the last time."""
        node = self._nodes.get(status.node)
        if node is None:
            return []
        node.told = status.state
        counted = status.counters.get("bytes")
        sent = {kind: int(n) for kind, n in counted.items()} if isinstance(counted, Mapping) else {}
        gone_s = now_s - node.sent_s
        grown = {kind: n - node.sent.get(kind, 0) for kind, n in sent.items()}
        if node.sent and gone_s > 0 and min(grown.values(), default=0) >= 0:
            node.bytes_per_s = {kind: round(n / gone_s) for kind, n in grown.items() if n}
        node.sent, node.sent_s = sent, now_s
        return [self._event(status.node)]

    def events(self) -> list[dict[str, Any]]:
        """How all of them are."""
        return [self._event(name) for name in self._nodes]

    def _event(self, name: str) -> dict[str, Any]:
        node = self._nodes[name]
        return {
            "type": "node",
            "node": name,
            "state": node.state,
            "since": node.since,
            "returned": node.state == "alive" and node.comings > 1,
            "bytes_per_s": node.bytes_per_s,
        }
