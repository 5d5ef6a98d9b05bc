"""What is heard of a run from outside, as anybody could hear it: what its nodes tell, and who is there."""

import queue
import time
from collections.abc import Callable
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import zenoh

from network.errors import RefusedMessage
from network.wire import codec, keys
from network.wire.messages import EstimateMessage, PreviewMessage, StatusMessage

IDLE_S = 0.1
"""How long nothing may be heard before this is told."""

Heard = EstimateMessage | StatusMessage | PreviewMessage
"""What nodes tell."""


@dataclass(frozen=True, slots=True)
class Token:
    """A node's token has come or gone.

    Attributes:
        node: The node.
        here: Whether it is there from now on.
    """

    node: str
    here: bool


class Hearing:
    """Hears the nodes of a run.

    Attributes:
        last_s: When something was heard last, on the monotonic clock.
    """

    def __init__(self, run: str, nodes: AbstractSet[str], refused: Callable[[str, str], None]) -> None:
        """Hears nothing yet.

        Args:
            run: Name of the run.
            nodes: Its nodes; what comes of others is somebody else's.
            refused: Told the node and the reason where something cannot be used, once for each.
        """
        self.last_s = time.monotonic()
        self._run, self._nodes, self._tell_refused = run, nodes, refused
        self._refused: set[tuple[str, str]] = set()
        self._heard: queue.SimpleQueue[zenoh.Sample] = queue.SimpleQueue()

    def listen(self, session: zenoh.Session, *, previews: bool) -> None:
        """Subscribes to what nodes tell, to their pictures if wanted, and to their tokens."""
        hear = zenoh.handlers.Callback(self._heard.put, indirect=False)
        for key in (keys.estimate, keys.status, *([keys.preview] if previews else [])):
            session.declare_subscriber(key(self._run), hear)
        session.liveliness().declare_subscriber(keys.alive(self._run), hear, history=True)

    @property
    def is_behind(self) -> bool:
        """Whether something has come that was not heard yet."""
        return not self._heard.empty()

    def next(self) -> Heard | Token | None:
        """The next valid message or token, None if there is none for a while."""
        try:
            sample = self._heard.get(timeout=IDLE_S)
        except queue.Empty:
            return None
        self.last_s = time.monotonic()
        _, _, node, kind = str(sample.key_expr).split("/")
        if node not in self._nodes:
            return None
        if kind == "alive":
            return Token(node, sample.kind == zenoh.SampleKind.PUT)
        try:
            return _decode(node, kind, sample.payload.to_bytes())
        except RefusedMessage as refusal:
            if (node, refusal.reason) not in self._refused:
                self._tell_refused(node, refusal.reason)
            self._refused.add((node, refusal.reason))
            return None


def _decode(node: str, kind: str, data: bytes) -> Heard:
    """What a node tells, under a key of its own.

    Raises:
        RefusedMessage: It is something else, or of somebody else.
    """
    message: Heard
    if kind == "estimate":
        message = codec.decode_public(EstimateMessage, data)
    elif kind == "preview":
        message = codec.decode_preview(data)
    else:
        message = codec.decode_public(StatusMessage, data)
    if message.node != node:
        raise RefusedMessage("sender")
    return message
