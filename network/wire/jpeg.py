"""Notes inside JPEG pictures: a comment that travels with the picture and that every viewer skips.

A JPEG is a row of segments, each a marker (0xFF and its kind) and a length in two big-endian bytes that
counts itself, until the scan begins (ITU-T T.81, Annex B). The JFIF header, where there is one, stays first.
"""

import struct

_START = b"\xff\xd8"
_JFIF, _COMMENT, _SCAN = 0xE0, 0xFE, 0xDA
_SEGMENT = struct.Struct(">BBH")
MAX_COMMENT_BYTES = 0xFFFF - 2


def with_comment(jpeg: bytes, comment: bytes) -> bytes:
    """A picture with a comment in it.

    Args:
        jpeg: The picture.
        comment: At most ``MAX_COMMENT_BYTES``.

    Raises:
        ValueError: It is no JPEG, or the comment is too long.
    """
    if not jpeg.startswith(_START):
        raise ValueError("the picture is no JPEG: it does not begin with FF D8")
    if len(comment) > MAX_COMMENT_BYTES:
        raise ValueError(f"a comment of {len(comment)} bytes: a JPEG takes {MAX_COMMENT_BYTES}")
    _, kind, length = _SEGMENT.unpack_from(jpeg, 2)
    place = 4 + length if kind == _JFIF else 2
    return b"".join((jpeg[:place], _SEGMENT.pack(0xFF, _COMMENT, len(comment) + 2), comment, jpeg[place:]))


def without_comment(jpeg: bytes) -> tuple[bytes, bytes] | None:
    """A picture without its first comment, and the comment; None if there is none, or it is no JPEG."""
    if not jpeg.startswith(_START):
        return None
    place = 2
    while place + _SEGMENT.size <= len(jpeg):
        marker, kind, length = _SEGMENT.unpack_from(jpeg, place)
        if marker != 0xFF or kind == _SCAN or length < 2 or place + 2 + length > len(jpeg):
            return None
        if kind == _COMMENT:
            return jpeg[:place] + jpeg[place + 2 + length :], jpeg[place + 4 : place + 2 + length]
        place += 2 + length
    return None
