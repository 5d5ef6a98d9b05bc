"""Who is counted: against the connected parts of the graph, whatever has gone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from network.averaging.weights import MetropolisWeights
from network.graphs import graph
from network.graphs.graph import Graph
from network.rounds.consensus import Consensus
from network.rounds.membership import Membership
from network.wire import codec
from network.wire.messages import ConsensusMessage

NAMES = tuple("ABCDEFGH")


class Network:
    """Nodes on a graph; links that are cut carry nothing, and each end has dropped the other."""

    def __init__(self, net, iterations):
        self.net, self.cut, self.dead = net, set(), set()
        self.nodes = {
            name: Consensus(
                name,
                net.neighbors(name),
                MetropolisWeights(),
                iterations,
                membership=Membership(name, net, iterations),
            )
            for name in net.names
        }

    def sever(self, a, b):
        self.cut.add((a, b) if a < b else (b, a))
        return [(name, m) for name, other in ((a, b), (b, a)) for m in self.nodes[name].drop(other)]

    def heal(self, a, b):
        self.cut.discard((a, b) if a < b else (b, a))
        self.nodes[a].restore(b)
        self.nodes[b].restore(a)

    def frame(self, index, value=1.0):
        queue = [
            (name, m)
            for name, node in self.nodes.items()
            if name not in self.dead
            for m in node.begin(index, np.array([value]))
        ]
        self.deliver(queue)

    def deliver(self, queue):
        while queue:
            sender, message = queue.pop(0)
            data = codec.encode("run", message)
            read = codec.decode(ConsensusMessage, "run", sender, data)
            for receiver in self.net.neighbors(sender):
                pair = (sender, receiver) if sender < receiver else (receiver, sender)
                if receiver not in self.dead and pair not in self.cut:
                    queue.extend((receiver, m) for m in self.nodes[receiver].receive(read))

    def members(self):
        return {name: node.members for name, node in self.nodes.items() if name not in self.dead}


@st.composite
def broken(draw):
    """A connected graph, and which of its links to cut; beartype forbids to make it here."""
    names = NAMES[: draw(st.integers(2, 8))]
    tree = [(name, draw(st.sampled_from(names[:i]))) for i, name in enumerate(names) if i]
    extra = draw(st.lists(st.tuples(st.sampled_from(names), st.sampled_from(names)), max_size=8))
    return names, [*tree, *((a, b) for a, b in extra if a != b)], draw(st.sets(st.integers(0, 14)))


@given(broken(), st.integers(1, 9))
@settings(max_examples=60, deadline=None)
def test_each_part_counts_its_own_nodes(drawn, iterations):
    names, edges, chosen = drawn
    net = Graph.from_edges(names, edges)
    cut = [edge for number, edge in enumerate(sorted(net.edges)) if number in chosen]
    network = Network(net, iterations)
    network.frame(0)
    assert set(network.members().values()) == {tuple(sorted(net.names))}
    for a, b in cut:
        network.sever(a, b)
    # as many frames as a report may need to cross the network
    for index in range(1, len(net.names) + 1):
        network.frame(index)
    parts = Graph(net.names, net.edges - frozenset(cut)).components()
    for name, members in network.members().items():
        (part,) = (part for part in parts if name in part)
        assert members == tuple(sorted(part))
    # healed, nobody tells of them any more, and the reports run out
    for a, b in cut:
        network.heal(a, b)
    for index in range(9, 9 + 2 * len(net.names)):
        network.frame(index)
    assert set(network.members().values()) == {tuple(sorted(net.names))}


@pytest.mark.parametrize("shape", ["ring", "path", "complete", "grid"])
def test_a_death_is_known_to_all_in_the_same_frame(shape):
    net = getattr(graph, shape)(NAMES[:6])
    network = Network(net, 12)
    network.frame(0)
    network.dead.add("F")
    for neighbor in net.neighbors("F"):
        network.nodes[neighbor].drop("F")
    network.frame(1)
    assert set(network.members().values()) == {tuple("ABCDE")}


def test_a_death_in_the_middle_of_a_frame_is_known_to_all_in_that_frame():
    net = graph.ring(NAMES[:4])
    network = Network(net, 12)
    firsts = [m for name in "ABCD" for m in [(name, x) for x in network.nodes[name].begin(0, np.ones(1))]]
    network.dead.add("C")  # after its first message
    queue = list(firsts)
    # everybody hears everybody's first; then the neighbours see that it has died
    network.deliver(queue)
    queue = [(name, m) for name in "BD" for m in network.nodes[name].drop("C")]
    network.deliver(queue)
    assert network.members() == dict.fromkeys("ABD", tuple("ABD"))
    assert all(network.nodes[name].done for name in "ABD")


def test_who_is_left_out_by_the_other_end_leaves_it_out_too():
    """The average stays, where otherwise one end would move towards the other alone."""
    net = graph.path(NAMES[:3])
    network = Network(net, 40)
    network.nodes["A"].drop("B")  # a false alarm, and only one end knows
    queue = []
    for name, value in zip("ABC", (0.0, 3.0, 6.0), strict=True):
        queue += [(name, m) for m in network.nodes[name].begin(0, np.array([value]))]
    network.deliver(queue)
    assert network.members() == {"A": ("A",), "B": ("B", "C"), "C": ("B", "C")}
    np.testing.assert_allclose([network.nodes[name].value[0] for name in "ABC"], [0.0, 4.5, 4.5])


def test_who_has_left_out_a_frame_is_no_member_of_it():
    """It was awaited, and its first word is of a later frame."""
    network = Network(graph.ring(NAMES[:4]), 6)
    queue = [(name, m) for name in "ACD" for m in network.nodes[name].begin(3, np.array([1.0]))]
    queue += [("B", m) for m in network.nodes["B"].begin(5, np.array([1.0]))]
    network.deliver(queue)
    members = network.members()
    assert {name: members[name] for name in "ACD"} == dict.fromkeys("ACD", ("A", "C", "D"))


def test_nothing_is_told_where_every_link_is_up():
    membership = Membership("A", graph.ring(NAMES), 12)
    assert membership.reports(5) == ()
    assert membership.members(5) == NAMES


def test_what_cannot_be_is_not_believed():
    membership = Membership("A", graph.ring(NAMES[:4]), 12)
    # no such link, of a frame to come, of one long past
    membership.hear([(99, 5), (0, 6), (0, 4)], 5)
    assert membership.members(5) == NAMES[:4]
    membership.hear([(0, 5), (3, 5)], 5)
    assert membership.members(5) != NAMES[:4]


def test_a_report_runs_out_when_it_has_crossed_the_network():
    membership = Membership("A", graph.path(NAMES), 3)  # 7 links, 3 rounds: 3 frames
    membership.hear([(6, 10)], 10)
    assert [membership.members(frame) == NAMES for frame in (10, 12, 13)] == [False, False, True]


def test_who_is_behind_counts_by_its_own_frame_whatever_those_ahead_tell():
    net = graph.path(["A", "B", "C"])
    node = Consensus("B", ("A", "C"), MetropolisWeights(), 3, membership=Membership("B", net, 3))
    node.drop("C")
    # C, which has been apart, is eight frames ahead, and tells of the link there
    number = sorted(net.edges).index(("B", "C"))
    node.receive(ConsensusMessage("C", 9, 1, 0, (0.0,), down=((number, 9),)))
    node.restore("C")

    node.begin(1, np.array([1.0]))

    assert node.members == ("A", "B")
