"""Smart cameras joined by links made by hand: whatever the network does, the filter is the same."""

import numpy as np
import pytest

from network.averaging.weights import MetropolisWeights
from network.graphs.graph import ring
from network.rounds.consensus import Consensus
from network.rounds.membership import Membership
from network.wire.messages import ConsensusMessage, EstimateMessage
from nodes.estimators.estimator import SirEstimator
from nodes.filtering.fusion import FusionOptions
from nodes.smart_camera import SmartCamera

NAMES = ("C1", "C2", "C3", "C4")
N_ROUNDS = 6


class Bench:
    """Nodes on a ring; each link keeps its order, which link speaks next is up to `rng`."""

    def __init__(self, room, seed=0, *, with_single=False):
        net = ring(NAMES)
        self.room, self.rng = room, np.random.default_rng(seed)
        self.nodes = {
            name: SmartCamera(
                room.models[name],
                room.setup,
                [
                    Consensus(
                        name,
                        net.neighbors(name),
                        MetropolisWeights(),
                        N_ROUNDS,
                        membership=Membership(name, net, N_ROUNDS),
                    )
                ],
                SirEstimator(name, "single", room.setup) if with_single else None,
            )
            for name in NAMES
        }
        self.links = {(a, b): [] for a in NAMES for b in net.neighbors(a)}
        self.estimates = {}

    def hear(self, name, outgoing):
        for message in outgoing:
            if isinstance(message, EstimateMessage):
                self.estimates[message.frame, name, message.estimator] = message
            else:
                for (sender, _), queue in self.links.items():
                    if sender == name:
                        queue.append(message)

    def deliver(self, n_messages=10**6):
        """So many messages, or as many as there are."""
        while n_messages and (busy := [link for link, queue in self.links.items() if queue]):
            sender, receiver = link = busy[self.rng.integers(len(busy))]
            assert sender != receiver
            self.hear(receiver, self.nodes[receiver].on_message(self.links[link].pop(0)))
            n_messages -= 1

    def start(self, frame, names):
        for name in names:
            self.hear(name, self.nodes[name].on_frame(frame, self.room.image(name, frame)))

    def frame(self, frame):
        names = list(self.nodes)
        self.rng.shuffle(names)
        for name in names:
            self.start(frame, [name])
            self.deliver(self.rng.integers(4))
        self.deliver()

    def leave(self, gone):
        """A node is gone, and with it what it had not sent yet; its neighbours see it."""
        del self.nodes[gone]
        self.links = {link: queue for link, queue in self.links.items() if gone not in link}
        for name in ring(NAMES).neighbors(gone):
            if name in self.nodes:
                self.hear(name, self.nodes[name].on_lost(gone))

    def error(self, frame, name):
        return np.linalg.norm(self.estimates[frame, name, "dcpf"].mean[:2] - self.room.position(frame))


@pytest.mark.parametrize(
    "fusion",
    [
        FusionOptions(),
        FusionOptions(rule="quadratic_fit"),
        FusionOptions(rule="eq17", local_particles="own", proposal="prior"),
    ],
    ids=lambda options: options.rule,
)
def test_the_order_of_delivery_changes_nothing_to_the_last_bit(room, fusion):
    benches = [Bench(room(fusion=fusion), seed, with_single=True) for seed in (1, 2)]
    for bench in benches:
        for frame in range(3):
            bench.frame(frame)
    one, other = (bench.estimates for bench in benches)
    assert one.keys() == other.keys()
    assert len(one) == 3 * 4 * 2
    for key, estimate in one.items():
        assert np.array_equal(estimate.mean, other[key].mean)
        assert np.array_equal(estimate.covariance, other[key].covariance)
        assert estimate.ess == other[key].ess


def test_the_network_follows_the_target_and_agrees(room):
    bench = Bench(room())
    for frame in range(10):
        bench.frame(frame)
    assert max(bench.error(9, name) for name in NAMES) < 0.15
    found = [bench.estimates[9, name, "dcpf"] for name in NAMES]
    assert np.ptp([estimate.mean[:2] for estimate in found], axis=0).max() < 0.1
    assert all(estimate.visible and not estimate.lost for estimate in found)
    assert {estimate.iterations for estimate in found} == {N_ROUNDS}
    assert {estimate.members for estimate in found} == {NAMES}


def test_frame_zero_is_the_start_that_everybody_was_told(room):
    bench = Bench(room())
    bench.frame(0)
    for name in NAMES:
        np.testing.assert_array_equal(bench.estimates[0, name, "dcpf"].mean, bench.room.setup.start.mean)


def test_a_neighbour_lost_in_the_middle_of_a_frame_does_not_stop_the_others(room):
    bench = Bench(room())
    for frame in range(4):
        bench.frame(frame)
    bench.start(4, NAMES)
    bench.deliver(7)
    assert (4, "C1", "dcpf") not in bench.estimates
    bench.leave("C2")
    bench.deliver()
    for frame in range(5, 9):
        bench.frame(frame)
    for name in ("C1", "C3", "C4"):
        assert bench.estimates[4, name, "dcpf"].members == ("C1", "C3", "C4")
        assert bench.error(8, name) < 0.2


def test_at_the_deadline_the_rounds_done_must_do(room):
    bench = Bench(room())
    bench.frame(0)
    bench.start(1, ("C1", "C2"))  # the others are late
    bench.deliver()
    node = bench.nodes["C1"]
    assert node.awaited() == ("C4",)
    bench.hear("C1", node.on_deadline(1))
    cut = bench.estimates[1, "C1", "dcpf"]
    assert cut.iterations == node.rounds.done - N_ROUNDS < N_ROUNDS
    assert bench.error(1, "C1") < 0.3
    assert node.awaited() == ()
    assert node.on_deadline(1) == ()  # the frame is over already


def test_the_rounds_go_on_by_themselves_and_the_second_half_waits_for_who_asks(room):
    bench, beside = Bench(room()), Bench(room())
    for each in (bench, beside):
        each.frame(0)
        each.start(1, NAMES)
    beside.deliver()
    while busy := [link for link, queue in bench.links.items() if queue]:
        _, receiver = link = busy[0]
        bench.hear(receiver, bench.nodes[receiver].rounds.take(bench.links[link].pop(0)))
    for name, node in bench.nodes.items():
        assert node.awaited() == ()
        assert (1, name, "dcpf") not in bench.estimates
        bench.hear(name, node.on_rounds_over())
        assert bench.estimates[1, name, "dcpf"].iterations == N_ROUNDS
        np.testing.assert_array_equal(
            bench.estimates[1, name, "dcpf"].mean, beside.estimates[1, name, "dcpf"].mean
        )
        assert node.on_rounds_over() == ()


def test_a_camera_that_sees_nothing_is_told_the_looks_and_sends_nothing_but_zeros(room):
    bench = Bench(room(turned_away=("C3",)))
    bench.frame(0)
    blind, seeing = bench.nodes["C3"], bench.nodes["C1"]
    assert seeing._appearance.own
    assert not blind._appearance.own
    # six rounds are not all: a mean of what the three see, whatever its weights
    looks = [bench.nodes[name]._appearance.histograms for name in ("C1", "C2", "C4")]
    assert np.all(blind._appearance.histograms <= np.max(looks, axis=0) + 1e-12)
    assert np.all(blind._appearance.histograms >= np.min(looks, axis=0) - 1e-12)
    for frame in range(1, 8):
        sent = blind.on_frame(frame, bench.room.image("C3", frame))
        assert not any(sent[0].payload)
        bench.hear("C3", sent)
        bench.start(frame, ("C1", "C2", "C4"))
        bench.deliver()
    assert bench.error(7, "C3") < 0.2
    assert not bench.estimates[7, "C3", "dcpf"].visible


def test_where_nobody_sees_anything_the_prediction_stands_and_the_target_is_lost(room):
    bench = Bench(room(turned_away=NAMES))
    for frame in range(5):
        bench.frame(frame)
    assert [bench.estimates[frame, "C1", "dcpf"].lost for frame in range(5)] == [False] * 4 + [True]
    # nothing was ever learnt: the cloud moves on at the speed that it was told
    expected = bench.room.setup.start.mean[:2] + 0.4 * bench.room.setup.start.mean[2:]
    found = bench.estimates[4, "C1", "dcpf"]
    deviation = np.sqrt(np.diag(found.covariance)[:2] / 150)
    assert np.all(np.abs(found.mean[:2] - expected) < 4 * deviation)
    assert found.ess == pytest.approx(150)


def test_a_peers_nonsense_is_a_result_and_not_an_exception(room):
    bench = Bench(room())
    bench.frame(0)
    bench.start(1, ("C1",))
    node = bench.nodes["C1"]
    nonsense = np.array([-1e12, 3e9, -1e12, 1e15, 0.0])  # the wrong side of the cone
    for round_ in range(1, N_ROUNDS + 1):
        for sender in ("C2", "C4"):
            bench.hear("C1", node.on_message(ConsensusMessage(sender, 1, round_, 2, nonsense)))
    assert np.isfinite(bench.estimates[1, "C1", "dcpf"].mean).all()
    assert node.counters["indefinite_fused"] == 1


def test_frames_that_were_left_out_move_the_target_all_the_same(room):
    blind = Bench(room(turned_away=NAMES), with_single=True)
    for frame in (0, 1, 5):
        blind.frame(frame)
    for kind in ("dcpf", "single"):
        before, after = (blind.estimates[frame, "C1", kind] for frame in (1, 5))
        # nobody sees anything: four frames of 0.1 s at the velocity of the cloud
        np.testing.assert_allclose(after.mean[:2] - before.mean[:2], 0.4 * before.mean[2:], atol=0.06)
        assert np.trace(after.covariance[:2, :2]) > np.trace(before.covariance[:2, :2]) + 3 * 2e-3
