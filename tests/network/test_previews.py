"""Previews: JPEGs that say more than their pixels, sent only while somebody looks."""

from contextlib import suppress

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from network.errors import RefusedMessage
from network.links import sessions
from network.links.transport import Links
from network.links.zenoh import ZenohTransport
from network.wire import codec, jpeg, keys
from network.wire.messages import PreviewMessage

IMAGE = np.random.default_rng(0).integers(0, 255, (24, 32, 3), np.uint8)
JPEG = cv2.imencode(".jpg", IMAGE)[1].tobytes()
particles = hnp.arrays(float, st.tuples(st.integers(0, 200), st.just(2)), elements=st.floats(-1e3, 1e3))


def preview(shown=((1.0, 2.0),), picture=JPEG):
    return PreviewMessage("scene1", "C1", 7, 0.7, np.array(shown, dtype=float).reshape(-1, 2), picture)


@given(st.binary(max_size=2000))
def test_a_comment_comes_back_and_the_picture_stays_the_same_to_opencv(comment):
    noted = jpeg.with_comment(JPEG, comment)
    assert jpeg.without_comment(noted) == (JPEG, comment)
    np.testing.assert_array_equal(
        cv2.imdecode(np.frombuffer(noted, np.uint8), cv2.IMREAD_COLOR),
        cv2.imdecode(np.frombuffer(JPEG, np.uint8), cv2.IMREAD_COLOR),
    )
    assert noted[:4] == b"\xff\xd8\xff\xe0"  # the JFIF header stays first


def test_a_picture_without_jfif_header_takes_a_comment_too():
    bare = b"\xff\xd8" + JPEG[20:]
    assert jpeg.without_comment(jpeg.with_comment(bare, b"note")) == (bare, b"note")


def test_what_is_no_jpeg_or_has_no_room_is_said():
    with pytest.raises(ValueError, match="no JPEG"):
        jpeg.with_comment(b"GIF89a", b"")
    with pytest.raises(ValueError, match="takes 65533"):
        jpeg.with_comment(JPEG, bytes(jpeg.MAX_COMMENT_BYTES + 1))
    assert jpeg.without_comment(JPEG) is None


@given(particles, st.integers(0, 10**6))
def test_previews_round_trip(shown, frame):
    sent = PreviewMessage("scene1", "C1", frame, frame / 10, shown, JPEG)
    data = codec.encode("scene1", sent)
    read = codec.decode_preview(data)
    assert (read.run, read.node, read.frame, read.time_s) == ("scene1", "C1", frame, frame / 10)
    np.testing.assert_array_equal(read.particles, shown)
    assert read.jpeg == JPEG
    assert codec.encode("scene1", read) == data


@given(st.binary(max_size=300))
def test_whatever_else_comes_is_refused(data):
    with pytest.raises(RefusedMessage):
        codec.decode_preview(data)


@given(st.integers(0, 200), st.integers(0, 255))
def test_damaged_previews_are_read_or_refused(place, byte):
    data = bytearray(codec.encode("scene1", preview()))
    data[place] = byte
    with suppress(RefusedMessage):
        codec.decode_preview(bytes(data))


def test_oversize_pictures_and_false_comments_are_refused():
    with pytest.raises(RefusedMessage, match="length"):
        codec.decode_preview(bytes(codec.MAX_JPEG_BYTES + 1))
    with pytest.raises(RefusedMessage, match="fields"):
        codec.decode_preview(jpeg.with_comment(JPEG, b'{"run":"scene1"}'))
    flat = b'{"run":"r","node":"n","frame":0,"time_s":0.0,"particles":[[1.0],[2.0]]}'
    with pytest.raises(RefusedMessage, match="shape"):
        codec.decode_preview(jpeg.with_comment(JPEG, flat))


@pytest.mark.processes
@pytest.mark.parametrize("there_before", [False, True])
def test_a_camera_knows_whether_somebody_looks(tmp_path, wait_until, there_before):
    endpoint = f"unixsock-stream/{tmp_path}/r"
    router = sessions.open_router([endpoint])
    viewer = sessions.open_client(endpoint)
    looking = viewer.declare_subscriber(keys.preview("scene1")) if there_before else None
    camera = ZenohTransport(
        "scene1", "C1", Links(), [f"unixsock-stream/{tmp_path}/c"], [endpoint], drop_late_pixels=False
    )
    try:
        if looking is None:
            assert not camera.watched
            looking = viewer.declare_subscriber(keys.preview("scene1"))
        assert wait_until(lambda: camera.watched)
        camera.send(preview())
        sample = looking.recv()
        assert str(sample.encoding) == "image/jpeg"
        assert codec.decode_preview(sample.payload.to_bytes()).frame == 7
        looking.undeclare()
        assert wait_until(lambda: not camera.watched)
    finally:
        for each in (camera, viewer, router):
            each.close()
