"""Bad links among real transports: each message fares as its channel, asked beside, says."""

import tempfile
import time

import numpy as np
import pytest

from network.averaging.weights import MetropolisWeights
from network.links.conditions import NS, Channel, ConditionsOptions
from network.links.disturbed import DisturbedTransport
from network.links.transport import Links, LostMessage
from network.links.zenoh import ZenohTransport
from network.rounds.consensus import Consensus
from network.wire.messages import ConsensusMessage

pytestmark = pytest.mark.processes

N = 40
SIZE_BYTES = 24 + 8


def says(frame, round_=1):
    return ConsensusMessage("A", frame, round_, 1, (float(frame),))


@pytest.fixture
def joined():
    """Joins A and B, which hears A over a bad link."""
    made = []

    def join(*, realtime, **conditions):
        options = ConditionsOptions.model_validate(conditions)
        a = ZenohTransport(
            "run", "A", Links(neighbors=("B",)), [f"unixsock-stream/{folder}/A"], [], drop_late_pixels=False
        )
        made.append(a)
        b = DisturbedTransport(
            *("run", "B", Links(neighbors=("A",)), [], [f"unixsock-stream/{folder}/A"]),
            {"A": Channel(options, 7, "A", "B")},
            realtime=realtime,
        )
        made.append(b)
        for each in made:
            each.announce()
        assert a.wait_until_alive(["B"], 5.0) == b.wait_until_alive(["A"], 5.0) == ()
        return a, b, Channel(options, 7, "A", "B")

    with tempfile.TemporaryDirectory(prefix="dcpf-", dir="/tmp") as folder:  # socket paths must be short
        yield join
        for transport in made:
            transport.close()


def test_in_lockstep_what_is_lost_is_told_and_what_comes_twice_is_heard_twice(joined):
    a, b, beside = joined(realtime=False, loss=0.3, duplicates=0.3, delay_s=100.0)
    for frame in range(N):
        a.send(says(frame))
    expected = []
    for frame in range(N):
        copies = len(beside.carry(3600 * NS * frame, SIZE_BYTES, frame))
        expected += [frame] * copies or [LostMessage("A", frame, 1)]

    heard = [b.receive("A", 5.0) for _ in expected]

    assert [each if isinstance(each, LostMessage) else each.frame for each in heard] == expected
    assert any(isinstance(each, LostMessage) for each in heard)
    assert b.counters.received["A"] == sum(not isinstance(each, LostMessage) for each in heard)


def test_in_real_time_messages_come_when_they_are_due_in_their_order_and_the_lost_never(joined):
    a, b, beside = joined(realtime=True, loss=0.3, delay_s=0.1, jitter_s=0.05)
    told_s = time.monotonic()
    for frame in range(N):
        a.send(says(frame))
    expected = [frame for frame in range(N) if beside.carry(3600 * NS * frame, SIZE_BYTES, frame)]

    first = b.receive("A", 5.0)
    first_s = time.monotonic() - told_s
    heard = [first, *(b.receive("A", 5.0) for _ in expected[1:])]

    assert first_s >= 0.1
    assert [message.frame for message in heard] == expected
    assert b.receive("A", 0.05) is None
    assert b.counters.received["A"] == len(expected)


def test_who_is_gone_is_not_waited_for(joined):
    a, b, _ = joined(realtime=True, loss=1.0)
    a.send(says(0))
    a.close()
    began_s = time.monotonic()
    assert b.receive("A", 20.0) is None
    assert time.monotonic() - began_s < 10.0


def test_a_round_is_done_without_a_message_that_is_lost():
    node = Consensus("B", ["A", "C"], MetropolisWeights(), 2)
    node.begin(0, np.array([3.0]))
    assert node.miss("A", 0, 1) == ()
    assert node.waiting_for() == ("C",)
    # a third of the way
    (second,) = node.receive(ConsensusMessage("C", 0, 1, 2, (6.0,)))
    assert second.payload == (4.0,)
    # told again, or late: of no use, and no harm
    assert node.miss("A", 0, 1) == ()
    assert node.waiting_for() == ("A", "C")
    assert node.counters == {"missed": 1}
