"""Graphs that a scenario describes: worked out when it is read, named where they cannot be."""

import json
import subprocess
import sys

import networkx as nx
import numpy as np
import pytest

from sim.scenario.graph_files import ENDINGS, read_graph
from sim.scenario.graphs import OverlapGraph, overlapping, sample_places
from sim.scenario.loading import cameras_of, load_scenario
from sim.scenario.parsing import ScenarioError

SQUARE = {("A", "B"), ("B", "C"), ("C", "D"), ("A", "D")}
WRITERS = {
    ".graphml": nx.write_graphml,
    ".gml": nx.write_gml,
    ".gexf": nx.write_gexf,
    ".net": nx.write_pajek,
    ".json": lambda graph, path: path.write_text(json.dumps(nx.node_link_data(graph, edges="edges"))),
    ".adjlist": nx.write_adjlist,
    ".edgelist": nx.write_edgelist,
}


def described(small, text):
    return load_scenario(small, [("network.graph", text)])


def test_cameras_within_range_are_linked(small):
    """The cameras stand in the corners of ten metres by ten."""
    assert described(small, "{kind: geometric, range_m: 10.1}").graph.edges == SQUARE
    assert len(described(small, "{kind: geometric, range_m: 15}").graph.edges) == 6


def test_positions_stand_in_for_the_cameras_own(small):
    places = "{A: [0, 0, 0], B: [1, 0, 0], C: [2, 0, 0], D: [3, 0, 0]}"
    found = described(small, f"{{kind: geometric, range_m: 1, positions: {places}}}")
    assert found.graph.edges == {("A", "B"), ("B", "C"), ("C", "D")}


def test_a_small_world_follows_the_seed(small):
    chosen = ("network.graph", "{kind: watts_strogatz, neighbors: 2, rewiring: 0.5}")
    graphs = []
    for seed in range(30):
        try:
            graphs.append(load_scenario(small, [chosen, ("seed", str(seed))]).graph)
        except ScenarioError as error:
            assert "falls into" in str(error)  # noqa: PT017 - chance may leave parts
    assert len({graph.edges for graph in graphs}) > 1
    assert load_scenario(small, [chosen, ("seed", "3")]) == load_scenario(small, [chosen, ("seed", "3")])


@pytest.mark.parametrize("space", ["plane", "volume"])
def test_overlap_is_what_a_loop_over_the_points_counts(small, space):
    velocity = "[0, 1.5]" if space == "plane" else "[0, 1.5, 0]"
    scenario = load_scenario(small, [("target.space", space), ("target.start.velocity", velocity)])
    cameras = cameras_of(scenario)
    points = sample_places((-10.0, -5.5, 0.9), (10.0, 14.5, 0.9 if space == "plane" else 5.0))
    points = points[:: 7 if space == "plane" else 61]
    shares = {}
    for a, b in [("A", "B"), ("A", "C"), ("A", "D"), ("B", "C"), ("B", "D"), ("C", "D")]:
        seen = {"A": 0, "B": 0, "both": 0}
        for point in points:
            in_a, in_b = (
                bool(cameras[name].contains(cameras[name].project(point[None])[0])[0]) for name in (a, b)
            )
            seen["A"] += in_a
            seen["B"] += in_b
            seen["both"] += in_a and in_b
        shares[a, b] = seen["both"] / min(seen["A"], seen["B"])
    limit = float(np.median(list(shares.values())))
    found = overlapping(OverlapGraph(kind="overlap", share=limit), cameras, points)
    assert found.edges == {pair for pair, share in shares.items() if share >= limit}
    assert 0 < len(found.edges) < 6


def test_places_fill_their_box():
    flat = sample_places((-1.0, 2.0, 0.5), (1.0, 3.0, 0.5))
    assert flat.shape == (3600, 3)
    deep = sample_places((-1.0, 2.0, 0.5), (1.0, 3.0, 2.5))
    np.testing.assert_array_equal([deep.min(axis=0), deep.max(axis=0)], [[-1, 2, 0.5], [1, 3, 2.5]])


def test_all_see_the_same_floor(small):
    assert len(described(small, "{kind: overlap}").graph.edges) == 6


@pytest.mark.parametrize("ending", ENDINGS)
def test_files_of_all_kinds(small, ending):
    for graph in (nx.Graph(sorted(SQUARE)), nx.cycle_graph(4)):
        path = small.parent / f"graph{ending}"
        WRITERS[ending](graph, path)
        found = described(small, f"{{kind: file, path: graph{ending}}}")
        assert found.graph.edges == SQUARE
        assert isinstance(found.network.graph, tuple)


def test_node_links_of_older_networkx(tmp_path):
    path = tmp_path / "graph.json"
    path.write_text(json.dumps(nx.node_link_data(nx.path_graph(3), edges="links")))
    assert read_graph(path, "ABC").edges == {("A", "B"), ("B", "C")}


FILES = {
    "other names": ("g.adjlist", "A B C\nE", "node E is no camera; the cameras are A, B, C, D"),
    "too few": ("g.adjlist", "A B C", "camera D is not in it"),
    "parts": (
        "g.adjlist",
        "A B\nC D",
        r"network.graph of kind file: the graph falls into 2 parts, A, B \| C, D",
    ),
    "a loop": ("g.edgelist", "A A\nA B\nB C\nC D", "edge A-A joins a node to itself"),
    "no graph": ("g.graphml", "what is this", "is no .graphml graph: .*: write it with networkx"),
    "no JSON": ("g.json", "{", "is no .json graph"),
    "no links": ("g.json", '{"nodes": []}', "is no .json graph"),
    "no GML": ("g.gml", "graph [", "is no .gml graph"),
    "an unknown ending": ("g.txt", "A B", r"is no graph file by its ending: take one of \.graphml"),
    "arrows": ("g.json", '{"directed": true, "nodes": [], "links": []}', "its edges have directions"),
}


@pytest.mark.parametrize(("name", "text", "sentence"), FILES.values(), ids=FILES)
def test_files_that_are_no_graph_of_the_cameras_are_named(small, name, text, sentence):
    (small.parent / name).write_text(text)
    with pytest.raises(ScenarioError, match=sentence) as caught:
        described(small, f"{{kind: file, path: {name}}}")
    assert len(str(caught.value).splitlines()) == 1


FIVE = ", ".join(f"{name}: [0, 0, 0]" for name in "ABCDE")
MISTAKES = {
    "no such file": ("{kind: file, path: none.gml}", "there is no such graph file: check network.graph.path"),
    "a folder": ("{kind: file, path: folder.gml}", "folder.gml: cannot be read: Is a directory"),
    "no such kind": ("{kind: circle}", "network.graph.kind must be one of 'geometric', .* got \"circle\""),
    "no kind": ("{range_m: 3}", "network.graph.kind is missing: add it"),
    "no range": ("{kind: geometric}", "network.graph.range_m is missing: add it"),
    "no such shape": ("rings", "network.graph must be 'ring', .* or a group of keys"),
    "out of range": (
        "{kind: geometric, range_m: 3}",
        r"kind geometric: the graph falls into 4 parts, A \| B",
    ),
    "a position lacks": (
        "{kind: geometric, range_m: 3, positions: {A: [0, 0, 0]}}",
        "positions: B is missing: give each camera one position",
    ),
    "a position of nobody": (
        f"{{kind: geometric, range_m: 3, positions: {{{FIVE}}}}}",
        "positions: E is no camera",
    ),
    "too many neighbours": ("{kind: watts_strogatz}", "cannot have 4 nearest neighbours"),
    "never together": ("{kind: overlap, share: 1}", "kind overlap: the graph falls into"),
}


@pytest.mark.parametrize(("text", "sentence"), MISTAKES.values(), ids=MISTAKES)
def test_graphs_that_cannot_be_are_named(small, text, sentence):
    (small.parent / "folder.gml").mkdir()
    with pytest.raises(ScenarioError, match=sentence) as caught:
        described(small, text)
    assert len(str(caught.value).splitlines()) == 1


def test_epsilon_is_checked_on_described_graphs_too(small):
    paper = ("preset", "paper")
    described = ("network.graph", "{kind: geometric, range_m: 15}")
    with pytest.raises(
        ScenarioError, match=r"kind geometric: epsilon = 0\.335 .* 3 neighbours: take it below 1/3"
    ):
        load_scenario(small, [paper, described, ("network.consensus.epsilon", "0.335")])
    with pytest.raises(
        ScenarioError, match=r"iterations = 1 is too few for finite_time, which needs 2 rounds"
    ):
        load_scenario(small, [("network.consensus", "{algorithm: finite_time}"), ("network.iterations", "1")])


def test_the_weights_of_ratio_consensus_need_room(small):
    with pytest.raises(ScenarioError, match="float16, in which ratio consensus' weights vanish"):
        load_scenario(
            small, [("network.consensus", "{algorithm: ratio}"), ("network.payload.encoding", "float16")]
        )


def test_a_described_graph_is_known_by_its_edges_only_after_reading(small):
    scenario = load_scenario(small)
    network = scenario.network.model_copy(update={"graph": OverlapGraph(kind="overlap")})
    with pytest.raises(ValueError, match="the overlap graph of small is not worked out"):
        _ = scenario.model_copy(update={"network": network}).graph


def test_nodes_import_neither_networkx_nor_scipy():
    code = "import sys, sim.running.host; print({'networkx', 'scipy', 'matplotlib'} & set(sys.modules))"
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert found.stdout.strip() == "set()"
