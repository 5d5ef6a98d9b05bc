"""The central node, given pictures by hand."""

import numpy as np
import pytest

from network.wire.messages import ConfirmMessage, EstimateMessage, PixelsMessage
from nodes.central import MAX_AHEAD, Central

NAMES = ("C1", "C2", "C3", "C4")


class Bench:
    def __init__(self, room):
        self.room = room
        self.central = Central("central", room.models, room.setup)

    def send(self, frame, *names):
        """What comes back when cameras send their picture of a frame."""
        return [
            message
            for name in names
            for message in self.central.on_message(PixelsMessage(name, frame, self.room.image(name, frame)))
        ]


@pytest.fixture
def bench(room):
    return Bench(room())


def frames_of(messages):
    assert all(isinstance(message, ConfirmMessage) for message in messages[::2])
    assert all(isinstance(message, EstimateMessage) for message in messages[1::2])
    assert [message.frame for message in messages[::2]] == [message.frame for message in messages[1::2]]
    return [message.frame for message in messages[::2]]


def test_it_waits_for_every_camera(bench):
    assert bench.send(0, "C1", "C4", "C2") == []
    assert bench.central.waiting_for == ("C3",)
    assert frames_of(bench.send(0, "C3")) == [0]
    assert bench.central.frame == 1


def test_it_follows_the_target(bench):
    for frame in range(10):
        messages = bench.send(frame, *NAMES)
    estimate = messages[1]
    assert estimate.estimator == "cpf"
    assert estimate.members == NAMES
    assert np.linalg.norm(estimate.mean[:2] - bench.room.position(9)) < 0.1
    assert estimate.visible
    assert not estimate.lost


def test_the_order_of_the_cameras_changes_nothing_to_the_last_bit(room):
    one, other = Bench(room()), Bench(room())
    for frame in range(4):
        left, right = one.send(frame, *NAMES), other.send(frame, *NAMES[::-1])
    assert np.array_equal(left[1].mean, right[1].mean)
    assert np.array_equal(left[1].covariance, right[1].covariance)


def test_a_lost_camera_is_not_waited_for_any_more(bench):
    bench.send(0, *NAMES)
    assert bench.send(1, "C1", "C2", "C4") == []
    assert frames_of(bench.central.on_lost("C3")) == [1]
    assert bench.central.cameras == {"C1", "C2", "C4"}
    assert frames_of(bench.send(2, "C1", "C2", "C4")) == [2]


def test_a_camera_that_was_gone_is_waited_for_when_it_is_hardly_behind(bench):
    bench.send(0, *NAMES)
    bench.central.on_lost("C3")
    for frame in range(1, 5):
        bench.send(frame, "C1", "C2", "C4")
    assert bench.send(2, "C3") == []
    assert "C3" not in bench.central.cameras
    assert bench.send(4, "C3") == []  # too late by one frame
    assert bench.send(5, "C1", "C2", "C4") == []
    (_, estimate) = bench.send(5, "C3")
    assert estimate.members == NAMES


def test_a_camera_that_skips_frames_is_waited_for_until_it_is_known_to(bench):
    bench.send(0, *NAMES)
    assert bench.send(1, "C1", "C2", "C3") == []
    # its next picture is of frame 3: it has left out 1 and 2
    assert frames_of(bench.send(3, "C4")) == [1]
    assert frames_of(bench.send(2, "C1", "C2", "C3")) == [2]
    assert frames_of(bench.send(3, "C1", "C2", "C3")) == [3]


def test_at_the_deadline_the_pictures_that_have_come_must_do(bench):
    bench.send(0, *NAMES)
    bench.send(1, "C1", "C2")
    assert frames_of(bench.central.on_deadline()) == [1]
    assert bench.send(1, "C3") == []  # too late
    assert frames_of(bench.central.on_deadline()) == [2]  # no picture at all: the prediction
    assert frames_of(bench.send(3, *NAMES)) == [3]


def test_pictures_far_ahead_are_ignored(bench):
    bench.send(0, *NAMES)
    for frame in range(1, 200):
        assert bench.send(frame, "C1") == []
    assert len(bench.central._images) == MAX_AHEAD + 1
    assert bench.central.waiting_for == ("C2", "C3", "C4")


def test_a_stranger_is_ignored(bench):
    image = bench.room.image("C1", 0)
    assert bench.central.on_message(PixelsMessage("C9", 0, image)) == ()
    assert bench.central.waiting_for == NAMES
