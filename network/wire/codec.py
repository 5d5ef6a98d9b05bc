"""Bytes on the wire: everything about how messages are written and read lives here.

Messages between nodes are little-endian and begin with one header of 24 bytes:

| offset | type | field |
|---|---|---|
| 0 | u8 | version of this layout, 1 |
| 1 | u8 | kind in the lower four bits: 1 consensus, 2 pixels, 3 confirm |
|   |    | encoding in the next three: consensus: 0 float64, 1 float32, 2 float16; others 0 |
|   |    | highest bit: consensus: whether links are told to be down; others 0 |
| 2 | 3 x u16 | consensus: numbers in the payload K, round, sender's degree; pixels: height, width, 0 |
| 8 | u64 | run: BLAKE2b of its name, 8 bytes |
| 16 | u32 | sender: BLAKE2b of its name, 4 bytes |
| 20 | u32 | frame |
| 24 | | consensus: K numbers, float16 ones after an i16 e and times 2^e, then 2 x u32 for each link that is |
|    | | down, its number and a frame; pixels: height x width x 3, BGR |

A preview is a JPEG that any viewer shows; what else it says is JSON in the picture's comment.

Reading never trusts: what is not exactly such a message is refused with its reason.
"""

import json
import math
import struct
from dataclasses import replace
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float, Int
from pydantic import TypeAdapter, ValidationError

from network.errors import RefusedMessage
from network.wire import jpeg
from network.wire.header import HEADER, TELLS_DOWN, read_header, write_header
from network.wire.messages import (
    ConfirmMessage,
    ConsensusMessage,
    ControlMessage,
    EstimateMessage,
    Message,
    PeerMessage,
    PixelsMessage,
    PreviewMessage,
    PublicMessage,
    StateMessage,
    StatusMessage,
    TruthMessage,
)
from network.wire.quantization import ENCODINGS, LARGEST, Encoding, are_below, half_exponent

MAX_PIXELS = 64_000_000
MAX_JSON_BYTES = 1_000_000
MAX_JPEG_BYTES = 20_000_000
MAX_MAGNITUDE = LARGEST["float64"]
"""Larger numbers are refused like infinity: sums and products of them would overflow."""

_FORMATS: dict[Encoding, str] = {"float64": "d", "float32": "f", "float16": "e"}
_EXPONENT = struct.Struct("<h")
_DOWN = struct.Struct("<II")
_JSON: dict[type, TypeAdapter[Any]] = {
    kind: TypeAdapter(kind)
    for kind in (EstimateMessage, ControlMessage, StateMessage, StatusMessage, TruthMessage, PreviewMessage)
}
_JSON_REASONS = {"json_invalid": "json", "finite_number": "not-finite", "value_error": "shape"}

_Public = TypeVar("_Public", bound=PublicMessage)


def encode(run: str, message: Message) -> bytes:
    """Any message in bytes.

    Raises:
        ValueError: A number in it is not finite.
    """
    match message:
        case ConsensusMessage():
            return encode_consensus(run, message)
        case PixelsMessage():
            return encode_pixels(run, message)
        case ConfirmMessage():
            return encode_confirm(run, message)
        case PreviewMessage():
            return encode_preview(message)
        case _:
            return encode_public(message)


def decode(kind: type[PeerMessage], run: str, sender: str, data: bytes) -> PeerMessage:
    """A message of one node to another.

    Args:
        kind: What is expected.
        run: The run that it must belong to.
        sender: The node that it must come from.
        data: What came.

    Raises:
        RefusedMessage: It is something else.
    """
    if kind is ConsensusMessage:
        return decode_consensus(run, sender, data)
    if kind is PixelsMessage:
        return decode_pixels(run, sender, data)
    return decode_confirm(run, sender, data)


def encode_consensus(run: str, message: ConsensusMessage) -> bytes:
    """A round's value in bytes.

    Raises:
        ValueError: A number in it is not finite.
        OverflowError: One is beyond what its encoding holds.
    """
    _, _, round_, degree, payload, encoding, down = message
    if not are_below(payload, MAX_MAGNITUDE):
        raise ValueError(
            f"{message.sender} has a value that is not finite in frame {message.frame}: {payload}"
        )
    code = ENCODINGS.index(encoding) << 4 | (TELLS_DOWN if down else 0)
    data = write_header(run, message, len(payload), round_, degree, code)
    if encoding == "float16":
        exponent = half_exponent(payload)
        payload = tuple(math.ldexp(number, -exponent) for number in payload)
        data += _EXPONENT.pack(exponent)
    data += _numbers(encoding, len(payload)).pack(*payload)
    for report in down:
        data += _DOWN.pack(*report)
    return data


def decode_consensus(run: str, sender: str, data: bytes) -> ConsensusMessage:
    """A round's value.

    Raises:
        RefusedMessage: The data are not such a message.
    """
    frame, size, round_, degree, code = read_header(ConsensusMessage, run, sender, data)
    encoding = ENCODINGS[code >> 4 & 0x07]
    numbers, start = _numbers(encoding, size), HEADER.size + _EXPONENT.size * (encoding == "float16")
    told = len(data) - start - numbers.size
    if told % _DOWN.size or told < 0 or (told > 0) != bool(code & TELLS_DOWN):
        raise RefusedMessage("length")
    if round_ < 1:
        raise RefusedMessage("round")
    payload = numbers.unpack_from(data, start)
    if encoding == "float16":
        # an exponent beyond all floats gives infinity, which is refused
        (exponent,) = _EXPONENT.unpack_from(data, HEADER.size)
        with np.errstate(over="ignore", invalid="ignore"):
            payload = tuple(np.ldexp(payload, exponent).tolist())
    if not are_below(payload, MAX_MAGNITUDE):
        raise RefusedMessage("not-finite")
    down = tuple(_DOWN.iter_unpack(data[-told:])) if told else ()
    return ConsensusMessage(sender, frame, round_, degree, payload, encoding, down)


def encode_pixels(run: str, message: PixelsMessage) -> bytes:
    """A picture in bytes."""
    height, width, _ = message.image.shape
    return b"".join((write_header(run, message, height, width, 0), np.ascontiguousarray(message.image).data))


def decode_pixels(run: str, sender: str, data: bytes) -> PixelsMessage:
    """A picture; its image is a read-only view of the data.

    Raises:
        RefusedMessage: The data are not such a message, or the picture has more than ``MAX_PIXELS``.
    """
    frame, height, width, *_ = read_header(PixelsMessage, run, sender, data)
    if not 0 < height * width <= MAX_PIXELS:
        raise RefusedMessage("size")
    if len(data) != HEADER.size + 3 * height * width:
        raise RefusedMessage("length")
    image = np.frombuffer(data, np.uint8, offset=HEADER.size).reshape(height, width, 3)
    return PixelsMessage(sender, frame, image)


def encode_confirm(run: str, message: ConfirmMessage) -> bytes:
    """A confirmation in bytes."""
    return write_header(run, message, 0, 0, 0)


def decode_confirm(run: str, sender: str, data: bytes) -> ConfirmMessage:
    """A confirmation.

    Raises:
        RefusedMessage: The data are not such a message.
    """
    frame, *_ = read_header(ConfirmMessage, run, sender, data)
    if len(data) != HEADER.size:
        raise RefusedMessage("length")
    return ConfirmMessage(sender, frame)


def encode_public(message: PublicMessage) -> bytes:
    """A public message as one line of JSON.

    Raises:
        ValueError: A number in it is not finite.
    """
    return _to_json(message)


def decode_public(kind: type[_Public], data: bytes) -> _Public:
    """A public message from JSON.

    Raises:
        RefusedMessage: The data are not such a message.
    """
    if len(data) > MAX_JSON_BYTES:
        raise RefusedMessage("length")
    message: _Public = _from_json(kind, data)
    return message


def encode_preview(message: PreviewMessage) -> bytes:
    """A preview: its picture, with everything else in the comment.

    Raises:
        ValueError: There are too many particles for a comment.
    """
    return jpeg.with_comment(message.jpeg, _to_json(message))


def decode_preview(data: bytes) -> PreviewMessage:
    """A preview; the picture itself is not looked into.

    Raises:
        RefusedMessage: The data are not such a message.
    """
    if len(data) > MAX_JPEG_BYTES:
        raise RefusedMessage("length")
    parts = jpeg.without_comment(data)
    if parts is None:
        raise RefusedMessage("jpeg")
    picture, comment = parts
    message: PreviewMessage = _from_json(PreviewMessage, comment)
    return replace(message, jpeg=picture)


@lru_cache
def upper_triangle(size: int) -> tuple[Int[np.ndarray, " K"], Int[np.ndarray, " K"]]:
    """Rows and columns of a matrix's upper triangle, row by row."""
    return np.triu_indices(size)


def pack_symmetric(matrix: Float[np.ndarray, "*C D D"]) -> Float[np.ndarray, "*C K"]:
    """The upper triangle of a symmetric matrix, or of each of many, row by row; K = D (D + 1) / 2."""
    rows, columns = upper_triangle(matrix.shape[-1])
    return matrix[..., rows, columns]


def unpack_symmetric(triangle: Float[np.ndarray, "*C K"], size: int) -> Float[np.ndarray, "*C D D"]:
    """The symmetric matrix of an upper triangle, or those of many.

    Args:
        triangle: What ``pack_symmetric`` gives.
        size: Rows of the matrix.

    Raises:
        ValueError: The triangle does not have size (size + 1) / 2 numbers.
    """
    found = triangle.shape[-1]
    if found != size * (size + 1) // 2:
        raise ValueError(f"{found} numbers are not the upper triangle of a {size} x {size} matrix")
    return triangle[..., _places(size)]


@lru_cache
def _numbers(encoding: Encoding, size: int) -> struct.Struct:
    """So many numbers, one after the other."""
    return struct.Struct(f"<{size}{_FORMATS[encoding]}")


@lru_cache
def _places(size: int) -> Int[np.ndarray, "D D"]:
    """Where in the upper triangle each entry of the matrix stands."""
    places = np.zeros((size, size), dtype=np.intp)
    rows, columns = upper_triangle(size)
    places[rows, columns] = places[columns, rows] = np.arange(len(rows))
    return places


def _to_json(message: PublicMessage | PreviewMessage) -> bytes:
    # not mode="json": that writes numbers that are not finite as null
    fields = _JSON[type(message)].dump_python(message)
    return json.dumps(fields, separators=(",", ":"), allow_nan=False).encode()


def _from_json(kind: type, data: bytes) -> Any:
    try:
        return _JSON[kind].validate_json(data)
    except ValidationError as error:
        found = error.errors(include_url=False, include_context=False)[0]["type"]
        raise RefusedMessage(_JSON_REASONS.get(found, "fields")) from error
