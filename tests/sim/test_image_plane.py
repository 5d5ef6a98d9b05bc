"""One camera that tracks in its own pixels: truth, runs, figures, pictures, footage without calibration."""

import json
import textwrap

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from network.wire.messages import EstimateMessage, TruthMessage
from sim.assembly import Assembly
from sim.commands.app import app
from sim.experiments.found.figures import compare
from sim.metrics.errors import LOST_DIAGONALS
from sim.pictures.clip import make_clip
from sim.results.recorder import Recorder, read_run
from sim.results.results import Results, length, summarize
from sim.scenario.loading import load_scenario
from sim.scenario.parsing import ScenarioError
from sim.world.figure import HEAD_MIDDLE

ONE = """
    name: one
    frames: 8
    rate_hz: 10
    target:
      space: image
      person: ann
      size_px: [9, 25]
      start: {velocity: [8.0, 0.0]}
    cameras:
      - {name: A, position: [0, -3, 1.4], look_at: [0, 3, 0.9], focal_px: 120, size_px: [160, 120]}
    filter:
      n_particles: 60
    world:
      people:
        - name: ann
          upper: "#233ca5"
          lower: "#3c3737"
          path:
            - {time_s: 0.0, position: [-0.8, 3.0]}
            - {time_s: 4.0, position: [0.8, 3.0]}
      objects:
        - {name: jar, path: [{time_s: 0, position: [1, 2, 1]}], height: 0.2, bottom_radius: 0.1,
           top_radius: 0.1, bands: ["#d0a020"]}
      room: {center: [0.0, 2.0], size: [16.0, 16.0], height: 4.0}
    """
AUTOREGRESSIVE = ("filter.dynamics.model", "autoregressive")


@pytest.fixture
def one(tmp_path):
    path = tmp_path / "one.yaml"
    path.write_text(textwrap.dedent(ONE), encoding="utf-8")
    return path


def by_opencv(points, camera):
    return cv2.projectPoints(points, cv2.Rodrigues(camera.R)[0], camera.t, camera.K, camera.distortion)[0][
        :, 0
    ]


@pytest.mark.parametrize(("part", "height"), [("body", 0.875), ("head", HEAD_MIDDLE * 1.75)])
def test_the_truth_is_the_projected_middle(one, part, height):
    assembly = Assembly(load_scenario(one, [("target.part", part)]))
    times = np.arange(8) / 10
    middles = np.array([[*assembly.world.position("ann", t), height] for t in times])

    np.testing.assert_allclose(assembly.truth[:, :2], by_opencv(middles, assembly.cameras["A"]), atol=1e-9)
    steps = np.diff(assembly.truth[:, :2], axis=0)
    between = (assembly.truth[1:, 2:] + assembly.truth[:-1, 2:]) / 2
    np.testing.assert_allclose(between[1:-1] / 10, steps[1:-1], atol=0.02)


def test_an_autoregressive_state_is_this_pixel_and_the_last(one):
    moving, remembering = (Assembly(load_scenario(one, each)) for each in ([], [AUTOREGRESSIVE]))

    np.testing.assert_array_equal(remembering.truth[:, :2], moving.truth[:, :2])
    np.testing.assert_array_equal(remembering.truth[1:, 2:], moving.truth[:-1, :2])
    # the start: where it was a frame ago by its velocity, 8 px/s at 10 Hz
    np.testing.assert_allclose(remembering.start.mean[2:], remembering.start.mean[:2] - [0.8, 0.0])
    assert len(set(remembering.start.deviation)) == 1


@pytest.mark.parametrize("preset", ["paper", "robust"])
@pytest.mark.parametrize("overrides", [[], [AUTOREGRESSIVE], [("filter.color.space", "hue")]])
def test_a_run_tells_pixels(one, told, preset, overrides):
    overrides = [*overrides, ("preset", preset)]
    results = Results(load_scenario(one, overrides))
    for message in told(one, *overrides):
        results.add(message)

    summary = summarize(results, processes=1)

    assert (summary["unit"], summary["rmse_m"], summary["disagreement_m"]) == ("px", None, None)
    assert summary["disagreement_px"] == 0.0
    rmse = length(summary, "rmse")
    truth = results.true_states()
    for kind in ("dcpf", "cpf"):
        assert rmse[kind] < 8
    errors = np.linalg.norm(results.means(("single", "A"))[1:, :2] - truth[1:, :2], axis=1)
    assert rmse["single"]["A"] == pytest.approx(np.sqrt(np.mean(errors**2)))
    assert summary["lost"] == {"dcpf": False, "cpf": False, "single": {"A": False}}
    assert summary["network"]["messages_per_frame"] == 0


def test_lost_is_outside_the_circle_around_the_true_box(one):
    results = Results(load_scenario(one))

    assert results.lost_error == LOST_DIAGONALS * np.hypot(9, 25)
    assert (
        Results(load_scenario(one, [("target.space", "plane"), ("target.size_px", "null")])).lost_error == 0.8
    )


def test_without_a_central_filter_there_is_no_ratio(one, summary_of):
    summary = summary_of(one, ("baselines.cpf", "false"))

    assert summary["ratio_dcpf_cpf"] is None
    assert summary["rmse_px"]["cpf"] is None
    figures = compare([summary, summary], 2)
    assert figures["rmse_m"] is None
    assert figures["rmse_px"]["dcpf"]["median"] == summary["rmse_px"]["dcpf"]
    assert figures["unit"] == "px"


def test_a_target_behind_the_camera_has_no_truth_in_that_frame(one, told):
    turned = [
        ("world.people.ann.path", "[{time_s: 0, position: [-0.2, 0]}, {time_s: 0.5, position: [0, -4]}]"),
        ("target.start.velocity", "[0, 0]"),
    ]

    frames = [message.frame for message in told(one, *turned) if isinstance(message, TruthMessage)]

    assert 0 in frames
    assert 7 not in frames
    behind = [("world.people.ann.path", "[{time_s: 0, position: [0, -5]}]")]
    with pytest.raises(ScenarioError, match="camera A has ann behind it at frame 0: turn it"):
        _ = Assembly(load_scenario(one, behind)).start


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        ([("target.size_px", "null")], "target: the image plane needs size_px"),
        ([("target.height", "1.8")], "target: height is in m"),
        ([("target.space", "plane")], "target: size_px is for the image plane"),
        ([("target.person", "null")], "target needs a person or an object .* ann, jar"),
        ([("target.object", "jar")], "the person ann and the object jar: set one to null"),
        ([("target.person", "null"), ("target.object", "jug")], "target.object is jug, .* name one of jar"),
        ([("target.person", "null"), ("target.object", "jar"), ("target.part", "head")], "has no parts"),
        ([("target.start.velocity", "[1]")], "a target in the image plane needs 2"),
        ([("filter.color.bins_per_channel", "40")], "in joint_rgb take at most 16"),
        ([("filter.dynamics.A", "fast")], "filter.dynamics.A"),
    ],
)
def test_a_mistake_is_named(one, overrides, sentence):
    with pytest.raises(ScenarioError, match=sentence) as caught:
        load_scenario(one, overrides)
    assert len(str(caught.value).splitlines()) == 1


def test_the_image_plane_is_that_of_one_camera(small):
    image = [("target.space", "image"), ("target.size_px", "[9, 25]")]

    with pytest.raises(ScenarioError, match="pixels of one camera, and there are 4 cameras: keep one"):
        load_scenario(small, image)


def test_a_matrix_has_no_place_in_a_volume(small):
    volume = [("target.space", "volume"), ("target.start.velocity", "[0, 0, 0]")]

    with pytest.raises(ScenarioError, match="2 x 2, and a volume has three axes"):
        load_scenario(small, [*volume, ("filter.dynamics.B", "[[0, 0], [0, 0]]")])


def test_an_object_is_a_target_in_every_space(one):
    jar = [("target.person", "null"), ("target.object", "jar")]
    in_metres = [*jar, ("target.size_px", "null")]
    volume = [*in_metres, ("target.space", "volume"), ("target.start.velocity", "[0, 0, 0]")]

    for overrides, middle in (
        ([*in_metres, ("target.space", "plane")], [1, 2]),
        (volume, [1, 2, 1.1]),
        (jar, by_opencv(np.array([[1, 2, 1.1]]), Assembly(load_scenario(one)).cameras["A"])[0]),
    ):
        assembly = Assembly(load_scenario(one, overrides))
        np.testing.assert_allclose(assembly.truth[3, : len(middle)], middle, atol=1e-9)
        np.testing.assert_allclose(assembly.truth[:, len(middle) :], 0, atol=1e-9)
        assert assembly.truth_message(0).visibility["A"].in_view > 0.9


def test_the_folder_of_a_run_is_read_back_and_shown(one, tmp_path, told):
    scenario = load_scenario(one, [AUTOREGRESSIVE])
    folder = tmp_path / "run"
    with Recorder(folder, scenario) as recorder:
        for message in told(one, AUTOREGRESSIVE):
            recorder.add(message)

    results = read_run(folder)

    assert results.scenario == scenario
    path = tmp_path / "clip.webp"
    make_clip(results, Assembly(scenario), path, width_px=320, progress=lambda *_: None)
    read, animation = cv2.imreadanimation(str(path))
    assert read
    assert len(animation.frames) == 8
    height, width = animation.frames[0].shape[:2]
    assert width == 320
    assert height > 240  # the picture, and the error below it


def test_the_command_tells_pixels(one, tmp_path):
    common = ["run", str(one), "--in-process", "--out", str(tmp_path / "out")]
    table = CliRunner().invoke(app, common)
    assert table.exit_code == 0
    assert " px" in table.stdout
    assert " m " not in table.stdout
    assert "disagree" not in table.stdout  # one node
    summary = json.loads(CliRunner().invoke(app, [*common, "--json"]).stdout)
    assert summary == json.loads((tmp_path / "out" / "summary.json").read_text())
    checked = CliRunner().invoke(app, ["check", str(one)])
    assert "in the image plane, starts at" in checked.stdout
    compared = CliRunner().invoke(
        app, ["compare", str(one), "--runs", "1", "--out", str(tmp_path / "compared")]
    )
    assert compared.exit_code == 0
    assert " px" in compared.stdout


@pytest.fixture
def film(tmp_path):
    """A bright square that moves over grey by 2 pixels a frame, as a video without any calibration."""
    video = cv2.VideoWriter(str(tmp_path / "a.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 10, (160, 120))
    rows = ["frame,x_px,y_px"]
    for frame in range(6):
        picture = np.full((120, 160, 3), 90, np.uint8)
        picture[50:70, 40 + 2 * frame : 60 + 2 * frame] = (40, 60, 220)
        video.write(picture)
        rows.append(f"{frame},{49.5 + 2 * frame},59.5")
    video.release()
    (tmp_path / "truth.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    path = tmp_path / "film.yaml"
    path.write_text(
        "{name: film, frames: 5, rate_hz: 10, footage: {folder: ., ground_truth: truth.csv, scale: 0.5},"
        " target: {space: image, size_px: [10, 10], start: {velocity: [10, 0]}},"
        " cameras: [{name: A, video: a.avi}], filter: {n_particles: 80}}",
        encoding="utf-8",
    )
    return path


def test_footage_needs_no_calibration_in_the_image_plane(film, told):
    assembly = Assembly(load_scenario(film))

    # the square's middle in the picture of half the size, whose pixel (0, 0) is the mean of four
    np.testing.assert_allclose(assembly.truth[:, 0], (49.5 + 2 * np.arange(5) + 0.5) / 2 - 0.5)
    np.testing.assert_allclose(assembly.truth[:, 2], 10.0)
    assert (assembly.cameras["A"].width_px, assembly.cameras["A"].height_px) == (80, 60)
    for message in told(film):
        if isinstance(message, EstimateMessage):
            assert np.linalg.norm(message.mean[:2] - assembly.truth[message.frame, :2]) < 4
    with pytest.raises(ScenarioError, match="camera A is not calibrated"):
        load_scenario(film, [("target.space", "plane"), ("target.size_px", "null")])


def test_the_ground_truth_of_footage_is_in_the_spaces_unit(film):
    (film.parent / "truth.csv").write_text("frame,x_m,y_m,z_m\n0,1,2,3\n")

    with pytest.raises(Exception, match="the columns must be frame,x_px,y_px, got frame,x_m,y_m,z_m"):
        _ = Assembly(load_scenario(film)).truth
