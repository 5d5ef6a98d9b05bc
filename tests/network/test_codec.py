"""Bytes: round trips, layouts as documented, and nothing but refusals for whatever else comes."""

import dataclasses
import json
import struct
from hashlib import blake2b

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from network.errors import RefusedMessage
from network.wire import codec
from network.wire.messages import (
    ConfirmMessage,
    ConsensusMessage,
    ControlMessage,
    EstimateMessage,
    PixelsMessage,
    PreviewMessage,
    StatusMessage,
    TruthMessage,
    Visibility,
)
from network.wire.quantization import Quantizer

RUN = "scene1"
finite = st.floats(-1e150, 1e150)
payloads = st.lists(finite, max_size=40).map(tuple)

CONSENSUS = ConsensusMessage("C1", 7, 3, 2, (1.5, -2.0, 1e-300))
SINGLE = ConsensusMessage("C1", 7, 3, 2, (1.5, -2.0, 0.25), "float32")
HALF = ConsensusMessage("C1", 7, 3, 2, (1.5 * 2.0**30, -(2.0**31), 0.0), "float16")
PIXELS = PixelsMessage("C1", 7, np.arange(4 * 5 * 3, dtype=np.uint8).reshape(4, 5, 3))
CONFIRM = ConfirmMessage("central", 7)
ESTIMATE = EstimateMessage(
    run=RUN, node="C1", estimator="dcpf", frame=7, time_s=0.7, mean=np.array([0.1, 2.0, 0.0, 1.5]),
    covariance=np.diag([0.1, 0.2, 0.3, 1 / 3]), visible=True, lost=False, ess=120.5, iterations=12,
    members=("C1", "C2"),
)  # fmt: skip
STATUS = StatusMessage(
    "C1", "running", 7, {"late": 3, "messages": {"consensus": 12}}, {"round_ms": {"p50": 0.4}}
)
TRUTH = TruthMessage(
    RUN, 7, 0.7, np.array([0.1, 2.0, 0.0, 1.5]), {"C1": Visibility(in_view=1.0, occluded=0.25)}
)
CONTROL = ControlMessage("start", 1.7e9)
PUBLIC = [ESTIMATE, STATUS, TRUTH, CONTROL, ControlMessage("stop")]


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 2**16 - 1), st.integers(0, 2**16 - 1), payloads)
def test_consensus_round_trip(frame, round_, degree, payload):
    message = ConsensusMessage("C1", frame, round_, degree, payload)
    read = codec.decode(ConsensusMessage, RUN, "C1", codec.encode(RUN, message))
    assert read == message


def test_consensus_layout_as_documented():
    data = codec.encode(RUN, CONSENSUS)
    run, sender = (blake2b(name, digest_size=size).digest() for name, size in ((b"scene1", 8), (b"C1", 4)))
    assert data == struct.pack("<BBHHH8s4sI3d", 1, 1, 3, 3, 2, run, sender, 7, 1.5, -2.0, 1e-300)


def test_rounded_payloads_layout_as_documented():
    run, sender = (blake2b(name, digest_size=size).digest() for name, size in ((b"scene1", 8), (b"C1", 4)))
    header = (3, 3, 2, run, sender, 7)
    assert codec.encode(RUN, SINGLE) == struct.pack("<BBHHH8s4sI3f", 1, 0x11, *header, 1.5, -2.0, 0.25)
    # the largest, 2^31, is written as 2^14
    assert codec.encode(RUN, HALF) == struct.pack(
        "<BBHHH8s4sIh3e", 1, 0x21, *header, 17, 1.5 * 2.0**13, -(2.0**14), 0.0
    )


@pytest.mark.parametrize("encoding", ["float32", "float16"])
@settings(deadline=None)
@given(st.lists(st.floats(-1e37, 1e37), max_size=9).map(tuple), st.integers(0, 2**32))
def test_rounded_payloads_round_trip_to_the_last_bit(encoding, payload, seed):
    for rng in (None, np.random.default_rng(seed)):
        sent = Quantizer(encoding, rng)(payload)
        message = ConsensusMessage("C1", 7, 3, 2, sent, encoding)
        read = codec.decode(ConsensusMessage, RUN, "C1", codec.encode(RUN, message))
        assert read == message


@pytest.mark.parametrize(
    ("code", "message", "reason"),
    [
        (0x31, SINGLE, "kind"),  # an encoding that there is not
        (0x11, CONSENSUS, "length"),
        (0x21, SINGLE, "length"),
        (0x01, HALF, "length"),
        (0x12, PIXELS, "kind"),  # pictures have none
        (0x13, CONFIRM, "kind"),
    ],
)
def test_wrong_encodings_are_refused(code, message, reason):
    data = bytearray(codec.encode(RUN, message))
    data[1] = code
    with pytest.raises(RefusedMessage) as refusal:
        codec.decode(type(message), RUN, message.sender, bytes(data))
    assert refusal.value.reason == reason


@pytest.mark.parametrize("exponent", [2**15 - 1, 600])
def test_half_precision_beyond_all_numbers_is_refused(exponent):
    data = bytearray(codec.encode(RUN, HALF))
    data[24:26] = struct.pack("<h", exponent)
    with pytest.raises(RefusedMessage, match="not-finite"):
        codec.decode(ConsensusMessage, RUN, "C1", bytes(data))


def test_pixels_round_trip_without_a_copy():
    data = codec.encode(RUN, PIXELS)
    read = codec.decode(PixelsMessage, RUN, "C1", data)
    assert read.frame == 7
    np.testing.assert_array_equal(read.image, PIXELS.image)
    assert not read.image.flags.writeable
    assert not read.image.flags.owndata
    turned = PixelsMessage("C1", 7, PIXELS.image.transpose(1, 0, 2))  # not contiguous
    np.testing.assert_array_equal(
        codec.decode_pixels(RUN, "C1", codec.encode_pixels(RUN, turned)).image, turned.image
    )


def test_confirm_round_trip():
    assert codec.decode(ConfirmMessage, RUN, "central", codec.encode(RUN, CONFIRM)) == CONFIRM


@pytest.mark.parametrize("message", PUBLIC)
def test_public_round_trip_and_plain_json(message):
    line = codec.encode(RUN, message)
    assert b"\n" not in line
    read = codec.decode_public(type(message), line)
    assert codec.encode_public(read) == line
    plain = json.loads(line)
    assert list(plain) == [field.name for field in dataclasses.fields(message)]


def test_estimates_keep_every_bit():
    mean = np.random.default_rng(0).normal(size=4)
    line = codec.encode_public(dataclasses.replace(ESTIMATE, mean=mean))
    np.testing.assert_array_equal(codec.decode_public(EstimateMessage, line).mean, mean)
    assert json.loads(line)["mean"] == mean.tolist()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda data: data[:-1], "length"),
        (lambda data: data + b"\0", "length"),
        (lambda data: data[:20], "length"),
        (lambda _: b"", "length"),
        (lambda data: b"\2" + data[1:], "version"),
        (lambda data: data[:1] + b"\2" + data[2:], "kind"),
        (lambda data: data[:4] + b"\0\0" + data[6:], "round"),
        (lambda data: data[:8] + b"\0" * 8 + data[16:], "run"),
        (lambda data: data[:16] + b"\0" * 4 + data[20:], "sender"),
        (lambda data: data[:-8] + struct.pack("<d", float("nan")), "not-finite"),
        (lambda data: data[:-8] + struct.pack("<d", float("-inf")), "not-finite"),
        (lambda data: data[:-8] + struct.pack("<d", 1e200), "not-finite"),
    ],
)
def test_refusals_of_consensus_name_their_reason(change, reason):
    with pytest.raises(RefusedMessage) as refusal:
        codec.decode_consensus(RUN, "C1", change(codec.encode(RUN, CONSENSUS)))
    assert refusal.value.reason == reason


def test_pictures_of_impossible_sizes_are_refused():
    data = bytearray(codec.encode(RUN, PIXELS))
    for height, width, reason in ((0, 0, "size"), (65535, 65535, "size"), (5, 5, "length")):
        data[2:6] = struct.pack("<HH", height, width)
        with pytest.raises(RefusedMessage) as refusal:
            codec.decode_pixels(RUN, "C1", bytes(data))
        assert refusal.value.reason == reason


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('"frame":7', '"frame":-7', "fields"),
        ('"frame":7', '"frame":7.5', "fields"),
        ('"frame":7', '"frames":7', "fields"),
        ('"frame":7,', "", "fields"),
        ('"frame":7', '"frame":7,"more":1', "fields"),
        ('"node":"C1"', '"node":"../C1"', "fields"),
        ('"dcpf"', '"best"', "fields"),
        ('"visible":true', '"visible":1', "fields"),
        ("120.5", "NaN", "not-finite"),
        ("120.5", "1e999", "not-finite"),
        ("[0.1,2.0,", "[0.1,Infinity,", "not-finite"),
        ("[0.1,2.0,", "[0.1,", "shape"),
        ("[[0.1,0.0,", "[[0.1,5.0,", "shape"),
        ("[[0.1,0.0,", "[[0.1,", "shape"),
        ('{"run"', '{"run', "json"),
    ],
)
def test_refusals_of_estimates_name_their_reason(old, new, reason):
    line = codec.encode_public(ESTIMATE).decode()
    assert old in line
    with pytest.raises(RefusedMessage) as refusal:
        codec.decode_public(EstimateMessage, line.replace(old, new, 1).encode())
    assert refusal.value.reason == reason


def test_long_json_is_refused_unread():
    with pytest.raises(RefusedMessage, match="length"):
        codec.decode_public(ControlMessage, b" " * 2_000_000)


READERS = [
    *((kind, lambda data, kind=kind: codec.decode(kind, RUN, "C1", data))
      for kind in (ConsensusMessage, PixelsMessage, ConfirmMessage)),
    *((kind, lambda data, kind=kind: codec.decode_public(kind, data))
      for kind in (EstimateMessage, StatusMessage, TruthMessage, ControlMessage)),
]  # fmt: skip
SAMPLES = [codec.encode(RUN, message) for message in (CONSENSUS, SINGLE, HALF, PIXELS, CONFIRM, *PUBLIC)]


def mutated(data):
    """Truncations, extensions, flipped bits and pieces put elsewhere."""
    sample = bytearray(data.draw(st.sampled_from(SAMPLES)))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, max(len(sample) - 1, 0)))
        match data.draw(st.integers(0, 3)):
            case 0:
                del sample[at:]
            case 1:
                sample[at:at] = data.draw(st.binary(max_size=8))
            case 2 if sample:
                sample[at] ^= 1 << data.draw(st.integers(0, 7))
            case _:
                sample[at : at + 8] = struct.pack("<d", data.draw(st.floats()))
    return bytes(sample)


@given(st.data())
@settings(max_examples=150, deadline=None)
def test_damaged_bytes_are_read_or_refused_and_nothing_else(data):
    damaged = mutated(data) if data.draw(st.booleans()) else data.draw(st.binary(max_size=200))
    for kind, read in READERS:
        try:
            message = read(damaged)
        except RefusedMessage:
            continue
        assert isinstance(message, kind)


def test_values_that_are_not_finite_are_our_own_mistake():
    with pytest.raises(ValueError, match="C1 has a value that is not finite in frame 7"):
        codec.encode(RUN, ConsensusMessage("C1", 7, 3, 2, (np.nan,)))
    with pytest.raises(ValueError, match="not JSON compliant"):
        codec.encode(RUN, ControlMessage("start", float("inf")))


@pytest.mark.parametrize(
    "message",
    [
        dataclasses.replace(ESTIMATE, mean=np.full(4, np.nan)),
        dataclasses.replace(TRUTH, mean=np.array([0.1, -np.inf, 0.0, 1.5])),
        PreviewMessage(RUN, "C1", 7, 0.7, np.array([[np.nan, 0.0]]), b""),
    ],
)
def test_no_array_that_is_not_finite_gets_into_json(message):
    with pytest.raises(ValueError, match="not JSON compliant"):
        codec.encode(RUN, message)


@settings(deadline=None)
@given(st.integers(0, 8), st.integers(0, 2**32))
def test_symmetric_matrices_round_trip(size, seed):
    A = np.random.default_rng(seed).normal(size=(size, size))
    A = A + A.T
    packed = codec.pack_symmetric(A)
    assert packed.shape == (size * (size + 1) // 2,)
    np.testing.assert_array_equal(codec.unpack_symmetric(packed, size), A)


def test_symmetric_layout_and_length():
    np.testing.assert_array_equal(codec.pack_symmetric(np.array([[1.0, 2.0], [2.0, 3.0]])), [1, 2, 3])
    with pytest.raises(ValueError, match="4 numbers are not the upper triangle of a 2 x 2 matrix"):
        codec.unpack_symmetric(np.zeros(4), 2)
