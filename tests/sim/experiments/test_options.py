"""Sweeps and experiment files: what they mean, and what is said where they are wrong."""

import json
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.commands.inspect import experiment_schema
from sim.experiments.options import is_experiment, read_experiment
from sim.experiments.plan import plan_experiment
from sim.experiments.sweeps import parse_sweep, parse_values
from sim.scenario.document import read_document
from sim.scenario.parsing import ScenarioError

FOLDER = Path(__file__).parents[3] / "scenarios/experiments"
SHIPPED = [path for path in sorted(FOLDER.glob("*.yaml")) if is_experiment(read_document(path))]


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("1:4", ("1", "2", "3", "4")),
        ("0:0.5:0.1", ("0", "0.1", "0.2", "0.3", "0.4", "0.5")),
        ("0:1:0.4", ("0", "0.4", "0.8")),
        ("100:300:100", ("100", "200", "300")),
        ("-1:1", ("-1", "0", "1")),
        ("ring", ("ring",)),
        ("ring, star", ("ring", "star")),
        ("[[A, B], [B, C]],path", ("[[A, B], [B, C]]", "path")),
        ("{algorithm: metropolis},{algorithm: constant, epsilon: 0.2}",
         ("{algorithm: metropolis}", "{algorithm: constant, epsilon: 0.2}")),
        ('"a,b",c', ('"a,b"', "c")),
    ],
)  # fmt: skip
def test_values_are_ranges_or_lists(text, values):
    assert parse_values(text, "here") == values
    assert parse_sweep(f"a.b={text}").values == values


@given(st.integers(-50, 50), st.integers(0, 40), st.integers(1, 9))
def test_ranges_are_pythons_with_the_last_included(first, length, step):
    last = first + length

    found = parse_values(f"{first}:{last}:{step}", "here")

    assert [int(value) for value in found] == list(range(first, last + 1, step))


@pytest.mark.parametrize(
    "text", ["", "1,,2", "1:x", "1:2:3:4", "2:1", "1:2:0", "1:2:-1", "0:1:1e-9", "1:nan", "1:inf"]
)
def test_what_is_neither_is_refused(text):
    with pytest.raises(ScenarioError, match=r"^here: "):
        parse_values(text, "here")


def read(tmp_path, text):
    path = tmp_path / "e.yaml"
    path.write_text(text, encoding="utf-8")
    return read_experiment(read_document(path))


HEAD = "name: e\nscenarios: [small.yaml]\nstudies:\n  a: "


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (HEAD + "{swep: {frames: '3'}, plot: strips}",
         r"e\.yaml:4:7: studies\.a\.swep is not a key here: did you mean sweep"),
        (HEAD + "{plot: pie}", r"e\.yaml:4:7: studies\.a\.plot must be 'error', 'paths'"),
        (HEAD + "{}", "the plot error is over a swept key"),
        (HEAD + "{plot: paths, sweep: {frames: '3:4'}}", "the plot paths shows one setting"),
        (HEAD + "{plot: strips, claims: [{kind: flat}]}",
         "the claim flat needs 1 swept keys and the estimators"),
        (HEAD + "{sweep: {frames: '3'}, claims: [{kind: flt}]}", r"claims\[0\]\.kind must be one of"),
        (HEAD + "{plot: strips}\npage: [b]", "page names b, which is no study: take some of a"),
        ("name: e\nscenarios: []\nstudies: {a: {plot: strips}}", "scenarios"),
    ],
)  # fmt: skip
def test_a_wrong_experiment_is_told_with_its_place(tmp_path, text, sentence):
    with pytest.raises(ScenarioError, match=sentence):
        read(tmp_path, text)


@pytest.mark.usefixtures("small")
def test_a_wrong_key_of_a_sweep_is_told_with_its_place(tmp_path):
    text = HEAD + "{sweep: {filter.alpha: '0:1'}}"
    document = read_document_of(tmp_path, text)

    with pytest.raises(
        ScenarioError, match=r"e\.yaml:4:15: filter\.alpha is not a key of the scenario: did you"
    ):
        plan_experiment(document)


def read_document_of(tmp_path, text):
    path = tmp_path / "e.yaml"
    path.write_text(text, encoding="utf-8")
    return read_document(path)


@pytest.mark.usefixtures("small")
def test_a_plan_has_every_combination_once(tmp_path):
    text = (
        HEAD + "{sweep: {network.iterations: '1:3', cameras: [2, 4]}}\nruns: 2\nset: {filter.n_particles: 10}"
    )

    plan = plan_experiment(read_document_of(tmp_path, text), [("frames", "3")])

    assert len(plan.groups) == 6
    assert all(group.seeds == (0, 1) for group in plan.groups)
    scenarios = [group.scenario_run for group in plan.groups]
    assert [(s.network.iterations, len(s.cameras)) for s in scenarios] == [
        (t, n) for t in (1, 2, 3) for n in (2, 4)
    ]
    assert {(s.frames, s.filter.n_particles) for s in scenarios} == {(3, 10)}
    # The cameras' part of every run; the central one's for two numbers of cameras and two seeds.
    assert len(plan.parts()) == 12 + 4
    pictures = [part.pictures for part in plan.parts()]
    assert len(set(pictures)) == 4
    # Each is met once, so that a worker that keeps one set of pictures makes none twice.
    assert sum(a != b for a, b in pairwise(pictures)) == 3


@pytest.mark.usefixtures("small")
def test_a_random_graph_is_drawn_anew_for_every_seed(tmp_path):
    swept = "{sweep: {network.graph.rewiring: [0.0, 1.0]}, plot: error}"
    text = (
        HEAD + swept + "\nruns: 6\nset: {network.graph: {kind: watts_strogatz, neighbors: 2, rewiring: 0.5}}"
    )

    regular, random = plan_experiment(read_document_of(tmp_path, text)).groups

    def graphs(group):
        return {json.dumps(json.loads(run["cameras"].scenario)["network"]["graph"]) for run in group.parts}

    assert len(graphs(regular)) == 1
    assert len(graphs(random)) > 1


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_experiments_are_planned(path):
    plan = plan_experiment(read_document(path))

    assert plan.options.name == path.stem
    assert {group.study for group in plan.groups} == set(plan.options.studies)
    assert {group.scenario_run.filter.backend for group in plan.groups} == {"fast"}
    assert json.dumps(plan.options.model_dump(mode="json"))


def test_the_committed_schema_is_the_models():
    committed = FOLDER / "experiment.schema.json"

    assert json.loads(committed.read_text(encoding="utf-8")) == experiment_schema()
