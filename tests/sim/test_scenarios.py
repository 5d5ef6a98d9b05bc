"""Every scenario that comes with dcpf: it loads, runs, repeats from its seed, and shows what it claims."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from network.wire.codec import encode_public
from network.wire.messages import EstimateMessage
from sim.assembly import Assembly
from sim.commands.inspect import scenario_schema
from sim.footage import FootageError, locate
from sim.running.in_process import run_in_process
from sim.scenario.document import read_document
from sim.scenario.loading import load_scenario
from sim.world.visibility import visibility

FOLDER = Path(__file__).parents[2] / "scenarios"
SCENARIOS = sorted(FOLDER.glob("*.yaml"))
BRIEF = [("frames", "2"), ("filter.n_particles", "20")]


@pytest.fixture(params=SCENARIOS, ids=lambda path: path.stem)
def scenario(request):
    """A scenario file whose pictures can be had."""
    footage = read_document(request.param).data.get("footage")
    if footage is not None and "name" in footage:
        try:
            locate(footage["name"])
        except FootageError as missing:
            pytest.skip(str(missing))
    return request.param


def test_there_are_scenarios():
    assert {path.stem for path in SCENARIOS} >= {"scene1", "scene2", "swimcap", "wica", "embedded"}


def test_it_loads_under_its_files_name(scenario):
    assert load_scenario(scenario).name == scenario.stem


def test_several_cameras_run_on_their_arrays(scenario, summary_of):
    shipped = load_scenario(scenario)
    if len(shipped.cameras) > 1:
        assert shipped.filter.backend == "simd"
        assert "simd" in summary_of(scenario, *BRIEF)


def test_it_repeats_from_its_seed_and_not_from_another(scenario):
    first = _estimates(scenario)

    assert _estimates(scenario) == first
    assert _estimates(scenario, ("seed", "1")) != first


@pytest.mark.parametrize("preset", ["paper", "robust"])
def test_it_tracks_from_the_start_with_both_presets(scenario, preset):
    chosen = load_scenario(scenario, [*BRIEF, ("preset", preset)])
    assembly = Assembly(chosen)

    estimates = [message for message in run_in_process(assembly) if isinstance(message, EstimateMessage)]

    n_axes = chosen.target.n_axes
    assert len(estimates) == chosen.frames * (2 * len(chosen.cameras) + chosen.baselines.cpf)
    for message in estimates:
        error = np.linalg.norm(message.mean[:n_axes] - assembly.truth[message.frame, :n_axes])
        assert error < {"m": 0.5, "px": 10.0}[chosen.target.unit]
        assert np.linalg.eigvalsh(message.covariance).min() >= 0


def test_the_committed_schema_is_the_models():
    committed = FOLDER / "scenario.schema.json"

    assert json.loads(committed.read_text(encoding="utf-8")) == scenario_schema()


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_the_schema_requires_only_what_every_file_says(path):
    assert scenario_schema()["required"]
    assert set(scenario_schema()["required"]) <= read_document(path).data.keys()


@cache
def _sights(name):
    """Part of the target's outline in each camera's picture, and the part of it that is hidden, by frame."""
    assembly = Assembly(load_scenario(FOLDER / f"{name}.yaml"))
    told = [assembly.truth_message(frame).visibility for frame in range(assembly.scenario.frames)]
    return {
        camera: np.array([[seen[camera].in_view, seen[camera].occluded] for seen in told])
        for camera in assembly.cameras
    }


def test_scene_1_leaves_c3s_view_after_frame_5_and_goes_behind_the_partition_of_c4():
    sights = _sights("scene1")
    seen = {camera: in_view * (1 - occluded) for camera, (in_view, occluded) in _columns(sights)}

    assert seen["C3"][:6].min() > 0.7
    assert seen["C3"][6:].max() < 0.35
    assert seen["C3"][9:].max() == 0
    assert seen["C4"][:20].min() > 0.7
    assert seen["C4"][31:].max() < 0.05
    assert sights["C4"][31:, 0].min() > 0.9  # within the picture, but hidden
    for camera in ("C1", "C2"):
        assert sights[camera][:, 0].min() == 1


def test_scene_2_is_in_view_of_all_four_throughout():
    sights = _sights("scene2")
    seen = [in_view * (1 - occluded) for _, (in_view, occluded) in _columns(sights)]

    assert min(sight[:, 0].min() for sight in sights.values()) > 0.7
    # Somebody or something crosses each view for a moment, never that of three at a time.
    assert all(np.median(each) > 0.9 for each in seen)
    assert (np.array(seen) > 0.5).sum(axis=0).min() >= 2


OFF_ARRAY = ("filter.backend", "fast")
WALKER = [("target.object", "null"), ("target.person", "walker"), ("target.size_px", "[24, 60]")]


@pytest.mark.parametrize(
    ("name", "overrides", "limit"),
    [
        ("wica", [("frames", "60")], 6),
        ("wica", [OFF_ARRAY], 6),
        ("wica", [OFF_ARRAY, ("preset", "robust")], 3),
        ("embedded", [], 10),
        ("embedded", WALKER, 15),
    ],
    ids=["face-on-the-array", "face", "face-robust", "cup", "walker"],
)
def test_the_papers_trackers_follow_their_targets(summary_of, name, overrides, limit):
    summary = summary_of(FOLDER / f"{name}.yaml", *overrides, ("seed", "3"))

    for rmse in (summary["rmse_px"]["dcpf"], summary["rmse_px"]["single"]["C1"]):
        assert rmse < limit
    assert not summary["lost"]["dcpf"]
    assert not summary["lost"]["single"]["C1"]


def test_the_face_is_in_view_among_look_alikes_and_the_walker_goes_behind_the_pillar():
    seen = {camera: in_view * (1 - hidden) for camera, (in_view, hidden) in _columns(_sights("wica"))}
    assert seen["C1"].min() > 0.95
    cup = {camera: in_view * (1 - hidden) for camera, (in_view, hidden) in _columns(_sights("embedded"))}
    assert 0.5 < cup["C1"].min() < 0.95  # the hand
    assembly = Assembly(load_scenario(FOLDER / "embedded.yaml"))
    hidden = [
        visibility(assembly.world, assembly.cameras["C1"], "walker", frame / 30).occluded
        for frame in range(0, 180, 3)
    ]
    assert max(hidden) > 0.7
    assert np.median(hidden) < 0.1


def _columns(sights):
    return [(camera, sight.T) for camera, sight in sights.items()]


def _estimates(path, *overrides):
    told = run_in_process(Assembly(load_scenario(path, [*BRIEF, *overrides])))
    return [encode_public(message) for message in told if isinstance(message, EstimateMessage)]
