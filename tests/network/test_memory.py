"""The network in memory: order, counts, nodes that come and go."""

import numpy as np
import pytest

from network.graphs import graph
from network.links.conditions import NS, ConditionsOptions
from network.links.memory import MemoryNetwork
from network.links.transport import Links, links_of
from network.wire import codec
from network.wire.messages import (
    ConfirmMessage,
    ConsensusMessage,
    ControlMessage,
    PixelsMessage,
    StatusMessage,
)

NAMES = ("A", "B", "C", "D")


def made():
    return MemoryNetwork("run", links_of(graph.ring(NAMES), sinks=["central"]))


def says(sender, round_=1):
    return ConsensusMessage(sender, 0, round_, 2, (1.0, 2.0))


def drain(net):
    delivered = []
    while (parcel := net.deliver()) is not None:
        delivered.append(parcel)
    return delivered


def test_messages_go_where_they_concern_somebody_in_order():
    net = made()
    net.post("A", says("A"))
    net.post("C", says("C"))
    net.post("B", PixelsMessage("B", 0, np.zeros((2, 2, 3), np.uint8)))
    net.post("central", ConfirmMessage("central", 0))
    net.post("A", StatusMessage("A", "ready", -1, {}, {}))
    assert [(receiver, message.sender, message.kind) for receiver, message in drain(net)] == [
        ("B", "A", "consensus"),
        ("D", "A", "consensus"),
        ("B", "C", "consensus"),
        ("D", "C", "consensus"),
        ("central", "B", "pixels"),
        *((name, "central", "confirm") for name in NAMES),
    ]


def test_every_receiver_counts():
    net = made()
    net.post("A", says("A"))
    assert net.counters["A"].messages == {"consensus": 2}
    assert net.counters["A"].bytes == {"consensus": 2 * (24 + 16)}
    net.post("central", ConfirmMessage("central", 0))
    assert net.counters["central"].bytes == {"confirm": 4 * 24}
    net.post("A", ControlMessage("stop"))
    assert net.counters["A"].messages["control"] == 1


def test_nodes_that_are_gone_get_nothing():
    net = made()
    net.post("A", says("A"))
    net.leave("B")
    net.post("C", says("C"))
    assert [receiver for receiver, _ in drain(net)] == ["D", "D"]
    assert net.counters["C"].messages == {"consensus": 1}
    net.join("B")
    net.post("A", says("A"))
    assert [receiver for receiver, _ in drain(net)] == ["B", "D"]


def test_what_cannot_be_read_is_counted_and_logged_once(caplog, monkeypatch):
    net = made()
    with monkeypatch.context() as patch:
        patch.setattr(codec, "encode", lambda *_: b"rubbish")
        net.post("A", says("A"))
        net.post("C", says("C"))
    net.post("A", says("A", 2))
    assert [receiver for receiver, _ in drain(net)] == ["B", "D"]
    assert net.counters["B"].refused == {"length": 2}
    assert [record.message for record in caplog.records].count(
        "refused a message of A (length); more of this kind are only counted"
    ) == 2  # B's and D's first


def test_a_node_has_one_part_towards_another():
    with pytest.raises(ValueError, match="B is linked twice"):
        Links(neighbors=("B",), sinks=("B",))


def test_messages_arrive_in_virtual_time_and_what_is_lost_does_not():
    conditions = ConditionsOptions.model_validate({
        "links": [
            {"link": ["A", "B"], "delay_s": 0.2, "duplicates": 1.0},
            {"link": ["A", "D"], "delay_s": 0.1},
            {"link": ["C", "D"], "loss": 1.0, "directed": True},
        ]
    })  # fmt: skip
    net = MemoryNetwork("run", links_of(graph.ring(NAMES), sinks=["central"]), conditions)
    assert net.next_ns is None
    net.post("A", says("A"), NS)
    net.post("C", says("C"), 2 * NS)
    net.post("A", PixelsMessage("A", 0, np.zeros((2, 2, 3), np.uint8)), 3 * NS)
    found = []
    while (at := net.next_ns) is not None:
        receiver, message = net.deliver()
        found.append((at / NS, message.sender, receiver))
    assert found == [
        (1.1, "A", "D"),
        (1.2, "A", "B"),
        (1.2, "A", "B"),
        (2.0, "C", "B"),
        (3.0, "A", "central"),
    ]
    assert net.counters["A"].sent == {"B": 1, "D": 1}
    assert net.counters["C"].sent == {"B": 1, "D": 1}
    assert net.counters["B"].received == {"A": 2, "C": 1}
    assert net.counters["D"].received == {"A": 1}
