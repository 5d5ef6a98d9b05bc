"""Consensus rounds against the power of the weight matrix, and against everything that can go wrong."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from network.averaging.weights import ConstantWeights, MetropolisWeights
from network.graphs import graph
from network.graphs.graph import Graph
from network.rounds.consensus import Consensus
from network.wire.messages import ConsensusMessage

METROPOLIS = MetropolisWeights()
NAMES = tuple("ABCDEFGH")


def weight_matrix(net, weights):
    """W with a(t) = W a(t-1), from the definition."""
    W = np.eye(len(net.names))
    for i, a in enumerate(net.names):
        for j, b in enumerate(net.names):
            if b in net.neighbors(a):
                W[i, j] = weights.weight(net.degree(a), net.degree(b))
                W[i, i] -= W[i, j]
    return W


class Bench:
    """Nodes joined by links that keep the order of each pair's messages; which link speaks next is random."""

    def __init__(self, net, weights, iterations, rng):
        self.nodes = {name: Consensus(name, net.neighbors(name), weights, iterations) for name in net.names}
        self.rng = rng
        self.links = {(a, b): [] for a in net.names for b in net.neighbors(a)}

    def send(self, name, messages):
        for message in messages:
            for receiver in self.nodes[name].neighbors:
                self.links[name, receiver].append(message)

    def frame(self, frame, values):
        late = list(self.nodes)
        self.rng.shuffle(late)
        while True:
            busy = [link for link, queue in self.links.items() if queue]
            if late and (not busy or self.rng.random() < 0.3):
                name = late.pop()
                self.send(name, self.nodes[name].begin(frame, values[name]))
            elif busy:
                link = busy[self.rng.integers(len(busy))]
                self.send(link[1], self.nodes[link[1]].receive(self.links[link].pop(0)))
            else:
                return {name: node.value for name, node in self.nodes.items()}


@st.composite
def connected(draw):
    """Names and edges of a connected graph; the test makes it, beartype draws random numbers itself."""
    names = NAMES[: draw(st.integers(1, 8))]
    tree = [(name, draw(st.sampled_from(names[:i]))) for i, name in enumerate(names) if i]
    extra = draw(st.lists(st.tuples(st.sampled_from(names), st.sampled_from(names)), max_size=8))
    return names, [*tree, *((a, b) for a, b in extra if a != b)]


@given(connected(), st.integers(0, 9), st.integers(0, 2**32))
@settings(max_examples=40, deadline=None)
def test_rounds_equal_the_power_of_the_matrix(drawn, iterations, seed):
    net = Graph.from_edges(*drawn)
    rng = np.random.default_rng(seed)
    for weights in (METROPOLIS, ConstantWeights(epsilon=0.9 / max(net.max_degree, 1))):
        bench = Bench(net, weights, iterations, rng)
        power = np.linalg.matrix_power(weight_matrix(net, weights), iterations)
        for frame, size in enumerate((3, 5, 5)):  # the payload may change its size between frames
            values = rng.normal(size=(len(net.names), size))
            found = bench.frame(frame, dict(zip(net.names, values, strict=True)))
            np.testing.assert_allclose(
                np.array([found[name] for name in net.names]), power @ values, atol=1e-12
            )
            for node in bench.nodes.values():
                assert node.done
                assert node.rounds_done == (iterations if node.neighbors else 0)
                assert not node.counters


@given(connected(), st.integers(0, 2**32))
@settings(max_examples=25, deadline=None)
def test_the_order_of_arrival_changes_no_bit(drawn, seed):
    net = Graph.from_edges(*drawn)
    values = dict(zip(net.names, np.random.default_rng(seed).normal(size=(len(net.names), 4)), strict=True))
    first, second = (
        Bench(net, METROPOLIS, 6, np.random.default_rng([seed, run])).frame(0, values) for run in (0, 1)
    )
    for name in net.names:
        np.testing.assert_array_equal(first[name], second[name])


@pytest.mark.parametrize(
    ("build", "rounds"),
    [(graph.path, 400), (graph.ring, 120), (graph.star, 160), (graph.grid, 120), (graph.complete, 1)],
)
def test_many_rounds_reach_the_average(build, rounds):
    rng = np.random.default_rng(5)
    net = build(NAMES)
    values = rng.normal(size=(8, 2))
    found = Bench(net, METROPOLIS, rounds, rng).frame(0, dict(zip(NAMES, values, strict=True)))
    for value in found.values():
        np.testing.assert_allclose(value, values.mean(axis=0), atol=1e-9)


def test_the_paper_s_ring():
    """Residual after t rounds on the ring of four is bounded by the second eigenvalue of I - εL."""
    net, weights = graph.ring(NAMES[:4]), ConstantWeights(epsilon=0.325)
    contraction = np.sort(np.abs(1 - 0.325 * np.linalg.eigvalsh(net.laplacian())))[-2]
    values = np.random.default_rng(1).normal(size=(4, 1))
    found = Bench(net, weights, 12, np.random.default_rng(2)).frame(0, dict(zip(NAMES, values, strict=False)))
    residual = np.linalg.norm(np.array([found[name] for name in net.names]) - values.mean())
    assert residual <= contraction**12 * np.linalg.norm(values - values.mean())


def says(sender, frame, round_, *payload, degree=1):
    return ConsensusMessage(sender, frame, round_, degree, tuple(map(float, payload)))


def node(iterations=3, neighbors=("A", "B")):
    return Consensus("M", neighbors, METROPOLIS, iterations)


def test_alone_or_without_rounds_a_node_is_done_at_once():
    for lonely in (node(neighbors=()), node(iterations=0)):
        assert lonely.begin(0, np.array([7.0])) == ()
        assert lonely.done
        assert lonely.rounds_done == 0
        assert lonely.waiting_for() == ()
        np.testing.assert_array_equal(lonely.value, [7.0])


def test_one_round_in_numbers():
    m = node(iterations=1)
    (first,) = m.begin(4, np.array([0.0]))
    assert (first.sender, first.frame, first.round, first.degree) == ("M", 4, 1, 2)
    assert m.waiting_for() == ("A", "B")
    assert m.receive(says("B", 4, 1, 9.0, degree=1)) == ()
    assert m.waiting_for() == ("A",)
    assert m.receive(says("A", 4, 1, 8.0, degree=3)) == ()
    assert m.done
    np.testing.assert_allclose(m.value, [8 / 4 + 9 / 3])


def test_neighbours_that_began_earlier_are_waited_for_no_more():
    m = node(iterations=2)
    m.receive(says("A", 0, 1, 1.0))
    m.receive(says("B", 0, 1, 1.0))
    messages = m.begin(0, np.array([1.0]))
    assert [message.round for message in messages] == [1, 2]


def test_a_neighbour_may_be_one_round_ahead_or_in_the_next_frame():
    m = node(iterations=1)
    m.begin(0, np.array([0.0]))
    m.receive(says("A", 0, 1, 3.0))
    m.receive(says("A", 1, 1, 3.0, 6.0))  # done, and in the next frame, whose vector is longer
    assert m.waiting_for() == ("B",)
    m.receive(says("B", 0, 1, 3.0))
    assert m.done
    m.begin(1, np.array([0.0, 0.0]))
    assert m.waiting_for() == ("B",)
    m.drop("B")
    np.testing.assert_allclose(m.value, [1.0, 2.0])


def test_what_is_of_no_use_is_counted_and_changes_nothing():
    m = node()
    m.begin(5, np.array([0.0]))
    m.receive(says("A", 5, 1, 3.0))
    for stray in (
        says("Z", 5, 1, 1e9),
        says("A", 5, 1, 1e9),
        says("A", 4, 3, 1e9),
        says("B", 4, 1, 1e9),
    ):
        assert m.receive(stray) == ()
    assert m.counters == {"stranger": 1, "duplicate": 1, "old": 2}
    assert m.waiting_for() == ("B",)
    m.receive(says("B", 5, 1, 3.0))
    np.testing.assert_allclose(m.value, [2.0])


def test_a_payload_of_the_wrong_length_is_not_used_and_not_waited_for():
    m = node(iterations=1)
    m.receive(says("A", 0, 1, 1.0, 2.0))
    m.begin(0, np.array([0.0]))
    assert m.waiting_for() == ("B",)
    m.receive(says("B", 0, 1, 1.0, 2.0))
    assert m.done
    assert m.counters == {"shape": 2}
    np.testing.assert_array_equal(m.value, [0.0])


def test_a_lost_message_is_told_by_the_next_one():
    m = node()
    m.begin(0, np.array([0.0]))
    m.receive(says("A", 0, 1, 3.0))
    (second,) = m.receive(says("B", 0, 2, 6.0))  # B's first is lost
    np.testing.assert_allclose(second.payload, [1.0])
    assert m.waiting_for() == ("A",)


def test_neighbours_that_left_the_frame_are_not_waited_for():
    m = node()
    m.begin(0, np.array([0.0]))
    m.receive(says("A", 2, 1, 3.0))
    assert m.waiting_for() == ("B",)
    m.receive(says("B", 3, 1, 3.0))
    assert m.done
    m.begin(2, np.array([0.0]))
    assert m.waiting_for() == ("A",)  # B is in frame 3 already
    assert m.rounds_done == 1


def test_far_ahead_is_counted_and_goes_unused():
    m = node(neighbors=("A",))
    m.begin(0, np.array([0.0]))
    messages = m.receive(says("A", 0, 3, 3.0))
    assert [message.round for message in messages] == [2, 3]
    assert m.counters == {"ahead": 1}


def test_drop_completes_all_rounds_that_it_held_up():
    m = node()
    m.begin(0, np.array([0.0]))
    m.receive(says("A", 0, 1, 3.0))
    m.receive(says("A", 0, 2, 3.0))
    second, third = m.drop("B")
    assert (second.degree, third.degree) == (1, 1)
    np.testing.assert_allclose(second.payload, [1.0])  # the weight still follows the degree of round 1
    np.testing.assert_allclose(third.payload, [2.0])
    assert m.waiting_for() == ("A",)


def test_drop_keeps_what_was_said_for_this_round_only():
    m = node()
    m.begin(0, np.array([0.0]))
    m.receive(says("A", 0, 1, 3.0))
    m.receive(says("A", 0, 2, 300.0))
    m.drop("A")
    (second,) = m.receive(says("B", 0, 1, 3.0))
    np.testing.assert_allclose(second.payload, [2.0])
    m.receive(says("A", 0, 3, 300.0))
    m.receive(says("B", 0, 2, 2.0))
    np.testing.assert_allclose(m.value, [2.0])
    assert m.counters == {"absent": 1}


def test_without_any_neighbour_left_the_frame_is_over():
    m = node()
    m.begin(0, np.array([0.0]))
    m.drop("A")
    assert m.drop("B") == ()
    assert m.done


def test_restored_neighbours_take_part_from_the_next_frame():
    m = node(iterations=1)
    m.begin(0, np.array([0.0]))
    m.drop("A")
    m.restore("A")
    m.receive(says("B", 0, 1, 0.0))
    assert m.done
    m.receive(says("A", 1, 1, 3.0))
    m.begin(1, np.array([0.0]))
    assert m.waiting_for() == ("B",)


def test_dropped_neighbours_stay_out():
    m = node(iterations=1)
    m.drop("A")
    m.receive(says("A", 0, 1, 3.0))
    (first,) = m.begin(0, np.array([0.0]))
    assert first.degree == 1
    assert m.waiting_for() == ("B",)
    assert m.counters == {"absent": 1}


def test_cut_ends_the_frame_with_the_rounds_done():
    m = node()
    m.begin(0, np.array([0.0]))
    m.receive(says("A", 0, 1, 3.0))
    m.receive(says("B", 0, 1, 3.0))
    m.receive(says("A", 0, 2, 1e9))
    m.cut()
    m.cut()
    assert m.done
    assert m.rounds_done == 1
    assert m.counters["cut"] == 1
    np.testing.assert_allclose(m.value, [2.0])
    m.receive(says("B", 0, 2, 1e9))
    assert m.counters["old"] == 1
    m.begin(2, np.array([0.0]))
    assert m.waiting_for() == ("A", "B")


def test_frames_follow_each_other():
    m = node()
    m.begin(3, np.array([0.0]))
    with pytest.raises(ValueError, match="M cannot begin frame 4: it is in frame 3"):
        m.begin(4, np.array([0.0]))
    m.cut()
    with pytest.raises(ValueError, match="cannot begin frame 3"):
        m.begin(3, np.array([0.0]))


def test_the_value_given_is_not_written_to():
    m, value = node(neighbors=("A",)), np.array([0.0])
    m.begin(0, value)
    m.receive(says("A", 0, 1, 3.0))
    np.testing.assert_array_equal(value, [0.0])


@given(st.data())
@settings(max_examples=50, deadline=None)
def test_no_sequence_of_messages_breaks_a_node(data):
    m = node()
    frame = -1
    for _ in range(30):
        if m.done:
            frame = data.draw(st.integers(frame + 1, frame + 3))
            m.begin(frame, np.zeros(2))
        else:
            draw = data.draw(st.integers(0, 9))
            if draw == 0:
                m.cut()
            elif draw == 1:
                m.drop(data.draw(st.sampled_from("AB")))
            elif draw == 2:
                m.restore(data.draw(st.sampled_from("AB")))
            else:
                sender = data.draw(st.sampled_from("ABZ"))
                at, round_ = data.draw(st.integers(0, frame + 3)), data.draw(st.integers(1, 5))
                m.receive(says(sender, at, round_, *np.zeros(data.draw(st.sampled_from([2, 2, 2, 3])))))
        assert 0 <= m.rounds_done <= 3
        assert m.done == (not m.waiting_for())
        assert sum(map(len, m._inbox.values())) <= 4
        assert len(m._early) <= 2
