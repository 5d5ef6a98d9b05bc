"""What is published over Eclipse Zenoh, and how: by a node, and from outside about a whole run.

Messages of the rounds go first and block, and travel together where several wait, so that a thousand fit into
Zenoh's queue: the thread that empties it sends them (`network.links.runtime`), and must not wait for itself.
Public ones block; pixels and previews give way to all others, and previews, in real time pixels as well, are
dropped where whoever wants them is too slow.
"""

from functools import partial
from typing import Any

import zenoh
from zenoh import CongestionControl, Locality, Priority

from network.wire import codec, keys
from network.wire.messages import (
    ConfirmMessage,
    ConsensusMessage,
    ControlMessage,
    EstimateMessage,
    PixelsMessage,
    PreviewMessage,
    StatusMessage,
    TruthMessage,
)

_ENCODINGS = {
    kind: f"application/json;dcpf.{kind.kind}.v1"
    for kind in (EstimateMessage, StatusMessage, ControlMessage, TruthMessage)
}
_PREVIEW_ENCODING = "image/jpeg"


def declare_publishers(
    session: zenoh.Session, run: str, name: str, *, drop_late_pixels: bool
) -> dict[type, zenoh.Publisher]:
    """Declares everything that a node publishes.

    Args:
        session: The node's.
        run: Name of the run.
        name: The node.
        drop_late_pixels: Whether pictures that do not get through in time are dropped (real time) or waited
            for (lockstep).

    Returns:
        For each kind of message its publisher.
    """
    publish = partial(session.declare_publisher, allowed_destination=Locality.REMOTE)
    rounds = partial(publish, congestion_control=CongestionControl.BLOCK, priority=Priority.REAL_TIME)
    public = partial(publish, congestion_control=CongestionControl.BLOCK)
    pixels_control = CongestionControl.DROP if drop_late_pixels else CongestionControl.BLOCK
    return {
        ConsensusMessage: rounds(keys.consensus(run, name)),
        ConfirmMessage: rounds(keys.confirm(run, name)),
        PixelsMessage: publish(
            keys.pixels(run, name), congestion_control=pixels_control, priority=Priority.DATA_LOW
        ),
        EstimateMessage: public(keys.estimate(run, name), encoding=_ENCODINGS[EstimateMessage]),
        StatusMessage: public(keys.status(run, name), encoding=_ENCODINGS[StatusMessage]),
        # Whoever looks too slowly misses pictures and holds nobody up.
        PreviewMessage: publish(
            keys.preview(run, name),
            encoding=_PREVIEW_ENCODING,
            congestion_control=CongestionControl.DROP,
            priority=Priority.DATA_LOW,
        ),
    }


def has_listeners(publisher: zenoh.Publisher) -> bool:
    """Whether anybody subscribes to what a publisher publishes."""
    status: Any = publisher.matching_status  # not a bool, whatever Zenoh's types say: always true as one
    return bool(status.matching)


def publish_again(session: zenoh.Session, key: str, data: bytes) -> None:
    """Publishes what was told in a run, byte for byte, from outside the nodes."""
    _, _, kind = key.rpartition("/")
    picture = kind == PreviewMessage.kind
    session.put(
        key,
        data,
        encoding=_PREVIEW_ENCODING if picture else f"application/json;dcpf.{kind}.v1",
        congestion_control=CongestionControl.DROP if picture else CongestionControl.BLOCK,
        priority=Priority.DATA_LOW if picture else Priority.DATA,
    )


def publish(session: zenoh.Session, run: str, message: ControlMessage | TruthMessage) -> None:
    """Publishes a message about a whole run, from outside the nodes."""
    key = keys.control(run) if isinstance(message, ControlMessage) else keys.truth(run)
    session.put(
        key,
        codec.encode_public(message),
        encoding=_ENCODINGS[type(message)],
        congestion_control=CongestionControl.BLOCK,
    )
