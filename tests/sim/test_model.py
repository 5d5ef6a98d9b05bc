"""What a scenario cannot be: each mistake names its key. And what is resolved stays what it is."""

import numpy as np
import pytest

from network.wire.messages import EstimateMessage
from sim.assembly import Assembly
from sim.results.recorder import Recorder
from sim.running.in_process import run_in_process
from sim.scenario.loading import cameras_of, load_scenario
from sim.scenario.parsing import ScenarioError

IDENTITY = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
MIRROR = "[[-1, 0, 0], [0, 1, 0], [0, 0, 1]]"

MISTAKES = {
    "two calibrations": ([("cameras.A.K", IDENTITY)], "camera A is calibrated in two ways"),
    "half a look": ([("cameras.A.look_at", "null")], "camera A needs position, look_at and focal_px"),
    "half the matrices": (
        [("cameras.A", f"{{name: A, K: {IDENTITY}}}")],
        "camera A needs K, R and t together",
    ),
    "no calibration": ([("cameras.A", "{name: A}")], "camera A is not calibrated"),
    "no size": ([("cameras.A.size_px", "null")], "camera A needs size_px"),
    "straight down": ([("cameras.A.look_at", "[-5, -2, 0]")], "camera A looks straight up or down"),
    "outside": ([("cameras.A.position", "[-50, -2, 2.9]")], "camera A at .* is outside the room: move it"),
    "a mirror": (
        [("cameras.A", f"{{name: A, size_px: [9, 9], K: {IDENTITY}, R: {MIRROR}, t: [0, 0, 1]}}")],
        "camera A: R is no rotation",
    ),
    "no picture": ([("cameras.A.size_px", "[-3, 0]")], r"cameras\[0\]\.size_px\[0\] must be greater than 0"),
    "two of a name": ([("cameras.B.name", "A")], "cameras has two named A"),
    "the central node's name": ([("central.name", "B")], "central.name is B, as is a camera"),
    "a name that is no key": ([("cameras.A.name", "a/b")], r"cameras\[0\]\.name: 'a/b' cannot name"),
    "nobody": ([("target.person", "bob")], "target.person is bob, who is not in world.people.* ann"),
    "a velocity too long": ([("target.start.velocity", "[0, 1, 2]")], "target.start.velocity has 3 numbers"),
    "a position too short": ([("target.start.position", "[0]")], "target.start.position has 1 number"),
    "a volume's velocity": ([("target.space", "volume")], "target.start.velocity has 2 numbers.* 3"),
    "epsilon on a ring": (
        [("preset", "paper"), ("network.consensus.epsilon", "0.5")],
        r"epsilon = 0\.5 .* 2 neighbours: take it below 1/2 = 0\.5",
    ),
    "epsilon on a complete graph": (
        [("preset", "paper"), ("network.graph", "complete"), ("network.consensus.epsilon", "0.4")],
        r"epsilon = 0\.4 .* 3 neighbours: take it below 1/3 = 0\.333",
    ),
    "two parts": ([("network.graph", "[[A, B], [C, D]]")], r"2 parts, A, B \| C, D: add edges"),
    "an edge to nobody": ([("network.graph", "[[A, E]]")], "edge A-E names E, which is no node"),
    "an edge to oneself": ([("network.graph", "[[A, A]]")], "edge A-A joins a node to itself"),
    "world and footage": ([("footage", "{folder: x}")], "world or footage, one of them"),
    "neither": ([("world", "null")], "world or footage, one of them"),
    "footage twice": (
        [("world", "null"), ("footage", "{folder: x, name: y}")],
        "footage needs name or folder",
    ),
    "one frame": ([("frames", "1")], "frames must be greater than or equal to 2, got 1"),
    "no camera": ([("cameras", "[]")], "cameras"),
    "no such key": ([("filter.n_particle", "3")], r"filter.n_particle .*did you mean n_particles\?"),
}


@pytest.mark.parametrize(("overrides", "sentence"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_named_with_its_key(small, overrides, sentence):
    with pytest.raises(ScenarioError, match=sentence) as caught:
        load_scenario(small, overrides)

    assert len(str(caught.value).splitlines()) == (2 if "size_px[1]" in str(caught.value) else 1)
    assert str(small) in str(caught.value) or "--set" in str(caught.value)


@pytest.mark.parametrize(
    "overrides",
    [
        [("network.graph", "[[A, B], [B, C], [C, D]]")],
        [("filter.sampling.grid", "null")],
        [("preset", "paper")],
    ],
)
def test_what_is_resolved_can_be_read_back(small, tmp_path, overrides):
    resolved = load_scenario(small, overrides)

    with Recorder(tmp_path, resolved):
        again = load_scenario(tmp_path / "scenario.yaml")

    assert again == resolved
    for name, camera in cameras_of(resolved).items():
        other = cameras_of(again)[name]
        for part in ("K", "R", "t", "distortion"):
            np.testing.assert_array_equal(getattr(other, part), getattr(camera, part))
    np.testing.assert_array_equal(Assembly(again).start.mean, Assembly(resolved).start.mean)
    for one, other in zip(_estimates(resolved), _estimates(again), strict=True):
        assert (one.node, one.estimator, one.frame) == (other.node, other.estimator, other.frame)
        np.testing.assert_array_equal(one.mean, other.mean)
        np.testing.assert_array_equal(one.covariance, other.covariance)


def _estimates(scenario):
    told = run_in_process(Assembly(scenario.model_copy(update={"frames": 3})))
    return [message for message in told if isinstance(message, EstimateMessage)]


def test_a_run_may_have_a_name_of_its_own(small):
    assert load_scenario(small, [("name", "other")]).name == "other"


@pytest.mark.parametrize(("cpf", "processes"), [("true", 6), ("false", 5)])
def test_a_run_has_a_process_a_camera_a_router_and_perhaps_a_central_node(small, cpf, processes):
    assert load_scenario(small, [("baselines.cpf", cpf)]).n_processes == processes


@pytest.mark.parametrize(
    ("graph", "edges"), [("ring", 4), ("path", 3), ("star", 3), ("complete", 6), ("grid", 4)]
)
def test_graphs_are_over_the_cameras_in_their_order(small, graph, edges):
    found = load_scenario(small, [("network.graph", graph)]).graph

    assert found.names == ("A", "B", "C", "D")
    assert len(found.edges) == edges


def test_the_start_is_the_truth_with_its_error(small):
    exact = load_scenario(small, [("target.start.position_error", "0")])
    given = load_scenario(
        small, [("target.start.position", "[1.0, 2.0]"), ("target.start.position_error", "0")]
    )

    np.testing.assert_allclose(Assembly(exact).start.mean, [0.0, 0.0, 0.0, 1.5], atol=1e-9)
    np.testing.assert_array_equal(Assembly(given).start.mean, [1.0, 2.0, 0.0, 1.5])


def test_a_person_in_a_volume_is_the_middle_of_the_body(small):
    volume = [("target.space", "volume"), ("target.start.velocity", "[0, 1.5, 0]")]

    truth = Assembly(load_scenario(small, volume)).truth

    plane = Assembly(load_scenario(small)).truth
    np.testing.assert_array_equal(truth[:, [0, 1, 3, 4]], plane)
    np.testing.assert_array_equal(truth[:, 2], 1.75 / 2)
    np.testing.assert_array_equal(truth[:, 5], 0.0)
