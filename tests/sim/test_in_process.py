"""A run in one process: what it tells, and what it counts, against a calculation by hand."""

import pytest

from network.wire.codec import encode_public
from network.wire.messages import EstimateMessage, StatusMessage, TruthMessage
from sim.results.results import Results, summarize
from sim.scenario.loading import load_scenario

HEADER, NUMBER = 24, 8
PICTURE = 3 * 160 * 120
LINKS = {"ring": 4, "path": 3, "star": 3, "complete": 6}


def test_everybody_tells_its_status_at_the_start_and_at_the_end(small, told):
    statuses = [message for message in told(small) if isinstance(message, StatusMessage)]

    found = {(each.node, each.state, each.frame) for each in statuses}
    assert len(statuses) == len(found)
    names = ["A", "B", "C", "D", "central"]
    assert found == {(n, s, k) for n in names for s, k in (("running", 0), ("done", 5))}


def test_each_frame_has_its_estimates_and_its_truth(small, told):
    messages = told(small)

    tracks = {(m.frame, m.estimator, m.node) for m in messages if isinstance(m, EstimateMessage)}
    assert len(tracks) == 6 * 9
    assert [m.frame for m in messages if isinstance(m, TruthMessage)] == list(range(6))


@pytest.mark.parametrize("graph", LINKS)
@pytest.mark.parametrize(
    ("preset", "numbers"),
    [
        ("robust", 2 + 3),  # η and the upper triangle of Λ, of the position
        ("paper", 2 * (4 + 10)),  # u and p, v and r, of the state
    ],
)
def test_the_network_carries_what_the_paper_says(small, told, graph, preset, numbers):
    overrides = [
        ("frames", "3"),
        ("network.graph", graph),
        ("preset", preset),
        ("network.iterations", "12"),
        ("network.consensus", "{algorithm: metropolis}"),
    ]

    network = summary_of(small, told(small, *overrides), *overrides)["network"]

    # Both ends of each link send a message in each round.
    messages = 12 * 2 * LINKS[graph]
    assert network["messages_per_frame"] == messages
    assert network["bytes_per_frame"] == {
        "dcpf": messages * (HEADER + NUMBER * numbers),
        "cpf": 4 * (HEADER + PICTURE),
    }
    assert network["late"] == network["refused"] == 0


def test_a_ring_of_four_with_twelve_rounds_sends_96_messages(small, told):
    overrides = [("network.iterations", "12")]

    network = summary_of(small, told(small, *overrides), *overrides)["network"]

    assert network["messages_per_frame"] == 96
    assert network["bytes_per_frame"]["dcpf"] == 96 * (24 + 8 * 5) == 6144


def test_without_rounds_nothing_is_sent(small, told):
    overrides = [("network.iterations", "0"), ("baselines", "{cpf: false}")]

    summary = summary_of(small, told(small, *overrides), *overrides)

    assert summary["network"]["messages_per_frame"] == 0
    assert summary["network"]["bytes_per_frame"] == {"dcpf": 0, "cpf": 0}
    assert summary["rmse_m"]["cpf"] is None
    assert summary["ratio_dcpf_cpf"] is None


def test_the_order_of_the_cameras_changes_nothing(small, told):
    edges = ("network.graph", "[[A, B], [B, C], [C, D]]")
    there = load_scenario(small).cameras
    backwards = [camera.model_dump(mode="json", exclude_none=True) for camera in reversed(there)]

    assert estimates(told(small, edges)) == estimates(told(small, edges, ("cameras", str(backwards))))


def test_a_camera_more_changes_no_other_cameras_own_filter(small, told):
    without_d = [
        camera.model_dump(mode="json", exclude_none=True) for camera in load_scenario(small).cameras[:3]
    ]

    four = [message for message in told(small) if getattr(message, "estimator", "") == "single"]
    three = [
        message
        for message in told(small, ("cameras", str(without_d)))
        if getattr(message, "estimator", "") == "single"
    ]

    assert estimates(three) == estimates([message for message in four if message.node != "D"])


@pytest.mark.parametrize("n", [1, 2])
def test_few_cameras_do(small, told, n):
    cameras = [c.model_dump(mode="json", exclude_none=True) for c in load_scenario(small).cameras[:n]]
    overrides = [("cameras", str(cameras))]

    summary = summary_of(small, told(small, *overrides), *overrides)

    assert summary["rmse_m"]["dcpf"] < 0.5
    assert (summary["disagreement_m"] == 0) == (n == 1)
    assert summary["network"]["messages_per_frame"] == (0 if n == 1 else 6)


def test_two_frames_are_the_shortest_run(small, told):
    messages = told(small, ("frames", "2"))

    assert {m.frame for m in messages if isinstance(m, EstimateMessage)} == {0, 1}
    summary = summary_of(small, messages, ("frames", "2"))
    assert summary["rmse_m"]["dcpf"] < 0.5
    assert summary["network"]["messages_per_frame"] == 3 * 8


def test_two_particles_are_poor_but_no_accident(small, told):
    few = ("filter.n_particles", "2")

    summary = summary_of(small, told(small, few), few)

    assert summary["rmse_m"]["dcpf"] > 0
    assert summary["anees"]["dcpf"] is None  # some frame's covariance was zero


def summary_of(path, messages, *overrides):
    results = Results(load_scenario(path, overrides))
    for message in messages:
        results.add(message)
    return summarize(results, processes=1)


def estimates(messages):
    return sorted(encode_public(message) for message in messages if isinstance(message, EstimateMessage))
