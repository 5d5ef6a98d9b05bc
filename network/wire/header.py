"""The header of all messages between nodes: see the layout in ``network.wire.codec``."""

import struct
from functools import lru_cache
from hashlib import blake2b

from network.errors import RefusedMessage
from network.wire.messages import ConfirmMessage, ConsensusMessage, PeerMessage, PixelsMessage
from network.wire.quantization import ENCODINGS

VERSION = 1
TELLS_DOWN = 0x80
"""Set in the kind of a consensus message that tells of links."""
HEADER = struct.Struct("<BBHHHQII")

_KINDS: dict[type[PeerMessage], int] = {ConsensusMessage: 1, PixelsMessage: 2, ConfirmMessage: 3}
_CODES: dict[type[PeerMessage], frozenset[int]] = {
    **{kind: frozenset([number]) for kind, number in _KINDS.items()},
    ConsensusMessage: frozenset(
        _KINDS[ConsensusMessage] | encoding << 4 | tells
        for encoding in range(len(ENCODINGS))
        for tells in (0, TELLS_DOWN)
    ),
}
"""What the kind's byte may be."""


def write_header(run: str, message: PeerMessage, a: int, b: int, c: int, code: int = 0) -> bytes:
    """The header of a message.

    Args:
        run: Name of the run.
        message: The message.
        a: The first of the three numbers that depend on the kind.
        b: The second.
        c: The third.
        code: The upper four bits of the kind.
    """
    code |= _KINDS[type(message)]
    return HEADER.pack(VERSION, code, a, b, c, _digest(run, 8), _digest(message.sender, 4), message.frame)


def read_header(
    kind: type[PeerMessage], run: str, sender: str, data: bytes
) -> tuple[int, int, int, int, int]:
    """Frame, the three numbers that depend on the kind, and the upper four bits of the kind.

    Raises:
        RefusedMessage: The data begin with no such header.
    """
    if len(data) < HEADER.size:
        raise RefusedMessage("length")
    version, code, a, b, c, run_id, sender_id, frame = HEADER.unpack_from(data)
    if version != VERSION:
        raise RefusedMessage("version")
    if code not in _CODES[kind]:
        raise RefusedMessage("kind")
    if run_id != _digest(run, 8):
        raise RefusedMessage("run")
    if sender_id != _digest(sender, 4):
        raise RefusedMessage("sender")
    return frame, a, b, c, code & 0xF0


@lru_cache
def _digest(name: str, size: int) -> int:
    return int.from_bytes(blake2b(name.encode(), digest_size=size).digest(), "little")
