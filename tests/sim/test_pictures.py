"""Pictures: the right thing, in the right colour, at the right place."""

import subprocess
import sys

import cv2
import matplotlib.colors
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from network.wire.messages import EstimateMessage, TruthMessage
from nodes.imaging.camera import look_at
from nodes.vision.target import TargetOptions
from sim.assembly import Assembly
from sim.pictures import canvas, ground
from sim.pictures.chart import Chart, Line, mean_known, round_numbers
from sim.pictures.clip import make_clip, tile
from sim.pictures.comparison import plot_comparison
from sim.pictures.ground_map import GroundMap
from sim.pictures.overlay import draw_frame
from sim.pictures.plots import plot_errors, write_figure
from sim.pictures.theme import COLORS
from sim.results.results import Results
from sim.scenario.model import Scenario
from sim.world.colors import bgr

N_FRAMES = 4
TARGET = TargetOptions(height=1.75, width=0.5)


def level_camera(name="C1", position=(0.0, -5.0, 0.875), target=(0.0, 0.0, 0.875)):
    return look_at(name, np.array(position), np.array(target), 100.0, (161, 121), np.zeros(5))


def scenario(space="plane"):
    corners = {"C1": [-4, -4, 2], "C2": [4, -4, 2], "C3": [0, 5, 2]}
    n_axes = 2 if space == "plane" else 3
    return Scenario.model_validate(
        {
            "name": "square",
            "frames": N_FRAMES,
            "rate_hz": 10,
            "world": {"people": [{"name": "anna", "path": [{"time_s": 0, "position": [0, 0]}]}]},
            "target": {"space": space, "person": "anna", "start": {"velocity": [0.0] * n_axes}},
            "cameras": [
                {
                    "name": name,
                    "size_px": [64, 48],
                    "focal_px": 60,
                    "position": position,
                    "look_at": [0, 0, 1],
                }
                for name, position in corners.items()
            ],
            "network": {"consensus": {"algorithm": "metropolis"}},
        }
    )


def told(estimator, node, frame, position, deviation=0.1):
    size = 2 * len(position)
    mean = np.r_[position, np.zeros(len(position))]
    covariance = deviation**2 * np.eye(size)
    return EstimateMessage(
        "square",
        node,
        estimator,
        frame,
        time_s=frame / 10,
        mean=mean,
        covariance=covariance,
        visible=True,
        lost=False,
        ess=1.0,
        iterations=0,
        members=(),
    )


def run(space="plane", *, truth=True, frames=N_FRAMES):
    """A run whose DCPF is 0.1 m, CPF 0.2 m and single cameras 1 m off along x."""
    results = Results(scenario(space))
    middle = np.zeros(2 if space == "plane" else 3)
    aside = np.eye(len(middle))[0]
    for frame in range(frames):
        here = middle + 0.3 * frame * np.eye(len(middle))[1]
        for node in ("C1", "C2", "C3"):
            results.add(told("dcpf", node, frame, here + 0.1 * aside))
            results.add(told("single", node, frame, here - aside))
        results.add(told("cpf", "central", frame, here + 0.2 * aside))
        if truth:
            results.add(TruthMessage("square", frame, frame / 10, np.r_[here, np.zeros(len(here))], {}))
    return results, Assembly(results.scenario)


def near(image, kind, tolerance=40):
    """Where an image has, nearly, the colour of an estimator."""
    return np.abs(image.astype(float) - bgr(COLORS[kind])).max(axis=2) < tolerance


@pytest.mark.parametrize("scale", [1, 2])
def test_boxes_are_drawn_around_the_target(scale):
    grey = np.full((121, 161, 3), 128, dtype=np.uint8)
    positions = {"dcpf": np.zeros(2), "cpf": np.zeros(2)}
    picture = draw_frame(grey, level_camera(), TARGET, positions, frame=3, width_px=161 * scale)
    assert picture.shape == (121 * scale, 161 * scale, 3)
    # 1.75 x 0.5 m at 5 m with a focal length of 100 pixels are 35 x 10 pixels around the middle
    middle = np.array([161, 121]) * scale / 2 - 0.5
    half = np.array([5.0, 17.5]) * scale
    for kind, outside in (("dcpf", 2), ("cpf", 4)):  # the middles of lines of two pixels beside each other
        y, x = np.nonzero(near(picture, kind))
        for found, centre, extent in ((x, middle[0], half[0]), (y, middle[1], half[1])):
            assert found.min() == pytest.approx(centre - extent - outside, abs=1.5)
            assert found.max() == pytest.approx(centre + extent + outside, abs=1.5)
    (x, y), (dx, dy) = middle, half - 3
    inside = picture[round(y - dy) : round(y + dy), round(x - dx) : round(x + dx)]
    assert (inside == 128).all()


def test_an_estimate_out_of_sight_is_noted():
    grey = np.full((121, 161, 3), 128, dtype=np.uint8)
    behind = np.array([0.0, -8.0])
    picture = draw_frame(grey, level_camera(), TARGET, {"dcpf": behind}, frame=0, width_px=161)
    assert not near(picture, "dcpf").any()
    assert (picture[-3:, :20] > 128).all()  # the note's light label
    unknown = draw_frame(grey, level_camera(), TARGET, {}, frame=0, width_px=161)
    assert (unknown[-3:] == 128).all()
    assert (grey == 128).all()  # the camera's own picture stays as it is


def test_the_truth_is_dashed_and_stands_on_its_foot():
    grey = np.full((121, 161, 3), 128, dtype=np.uint8)
    picture = draw_frame(grey, level_camera(), TARGET, {"truth": np.zeros(2)}, frame=0, width_px=161)
    foot = picture[round(60 + 17.5), 80]
    assert foot.max() < 60
    left = picture[45:75, 75].mean(axis=1)
    assert left.min() < 90
    assert left.max() > 170


def test_dashes_are_half_of_a_line():
    square = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 30.0], [0.0, 30.0]])
    cut = canvas.dashes(square, 5.0, closed=True)
    lengths = np.linalg.norm(np.diff(cut, axis=0), axis=1)
    assert np.nansum(lengths) == pytest.approx(60)
    path = canvas.dashes(square[:2], 4.0)
    np.testing.assert_allclose(path[[0, -2]], square[:2])  # a path begins and ends with a dash
    assert len(canvas.dashes(np.zeros((2, 2)), 4.0)) == 0


def test_a_line_has_a_gap_where_a_point_is_missing():
    image = canvas.blank(40, 10, "#FFFFFF")
    points = np.array([[2.0, 5.0], [12.0, 5.0], [np.nan, np.nan], [25.0, 5.0], [37.0, 5.0]])
    canvas.draw_lines(image, points, "#000000", 1)
    dark = image[5, :, 0] < 100
    assert dark[3:12].all()
    assert not dark[15:23].any()
    assert dark[26:37].all()


def test_text_is_as_wide_as_it_says():
    image = canvas.blank(200, 30, "#FFFFFF")
    canvas.draw_text(image, "frame 12", (190.0, 20.0), "#000000", 14, align="right")
    _, x = np.nonzero(image[:, :, 0] < 128)
    assert x.max() == pytest.approx(190, abs=3)
    assert x.max() - x.min() == pytest.approx(canvas.text_width("frame 12", 14), abs=3)


def test_an_ellipse_is_two_deviations_away():
    covariance = np.array([[0.5, 0.3], [0.3, 0.4]])
    off = ground.ellipse(np.array([1.0, 2.0]), covariance) - [1.0, 2.0]
    distances = np.einsum("ni,ij,nj->n", off, np.linalg.inv(covariance), off)
    np.testing.assert_allclose(distances, 4)


def test_the_ground_that_a_level_camera_sees_is_a_wedge():
    x, y = np.linspace(-4, 4, 33), np.linspace(-6, 4, 41)
    seen = ground.coverage([level_camera(), level_camera("C2")], x, y, 0.875)
    columns, rows = np.meshgrid(x, y)
    wedge = (rows > -5) & (np.abs(columns) < (rows + 5) * 80.5 / 100)
    np.testing.assert_array_equal(seen, 2 * wedge)


def test_headings_point_where_cameras_look():
    np.testing.assert_allclose(ground.heading(level_camera()), [0, 1], atol=1e-12)
    tilted = level_camera(position=(1.0, 1.0, 3.0), target=(4.0, 5.0, 0.0))
    np.testing.assert_allclose(ground.heading(tilted), [0.6, 0.8])


@pytest.mark.parametrize("truth", [True, False])
def test_the_area_holds_cameras_and_path(truth):
    results, assembly = run(truth=truth)
    area = ground.area_of(results, assembly)
    path = results.means(("cpf", "central"))[:, :2]
    points = np.concatenate([path, [camera.center[:2] for camera in assembly.cameras.values()]])
    assert (points > area.low).all()
    assert (points < area.high).all()
    wide = area.widened(3.0)
    assert wide.size[0] / wide.size[1] == pytest.approx(3.0)
    assert (wide.low <= area.low + 1e-9).all()
    assert (wide.high >= area.high - 1e-9).all()


@pytest.mark.parametrize("space", ["plane", "volume"])
def test_the_map_shows_the_estimates_where_they_are(space):
    results, assembly = run(space)
    ground_map = GroundMap(results, assembly, 300, 400)
    image = ground_map.draw(2)
    assert image.shape == (400, 300, 3)
    for kind, x in (("single", -1.0), ("dcpf", 0.1)):
        (place,) = ground_map.to_pixels(np.array([[x, 0.6]]))
        column, row = np.rint(place).astype(int)
        # DCPF's dot holds the truth's, whose colour is black
        around = near(image[row - 4 : row + 5, column - 4 : column + 5], kind)
        assert around.sum() > 12
    one_metre = np.diff(ground_map.to_pixels(np.array([[0.0, 0.0], [0.0, 1.0]])), axis=0)
    assert one_metre[0, 0] == 0
    assert one_metre[0, 1] < 0  # north is up


def test_a_map_without_estimates_of_a_frame_still_has_its_ground():
    results, assembly = run(frames=2, truth=False)
    image = GroundMap(results, assembly, 200, 200).draw(3)
    assert not near(image[:160], "dcpf", 10).any()


@given(st.floats(-1e3, 1e3), st.floats(1e-3, 1e3))
def test_round_numbers_are_few_and_within(low, extent):
    numbers = round_numbers(low, low + extent)
    assert 1 <= len(numbers) <= 4
    assert numbers[0] >= low - 1e-6 * extent
    assert numbers[-1] <= low + extent * (1 + 1e-6)


def test_round_numbers_are_round():
    np.testing.assert_allclose(round_numbers(0.0, 0.07), [0, 0.02, 0.04, 0.06])
    np.testing.assert_allclose(round_numbers(1.43, 1.78), [1.5, 1.6, 1.7])


def test_a_chart_grows_to_the_frame():
    line = Line("DCPF", np.array([np.nan, 0.0, 1.0, 1.0, 0.0]), COLORS["dcpf"])
    chart = Chart("error / m", [line], 0.0, 1.0, 200, 80, 10)
    image = chart.draw(2)
    assert image.shape == (80, 200, 3)
    places = chart.to_pixels(np.arange(5.0), line.values)
    x, y = np.rint(places[2]).astype(int)
    assert near(image, "dcpf")[y, x]
    assert not near(image, "dcpf")[20:, x + 8 :].any()  # below the values in words
    assert places[2, 1] < places[1, 1]


def test_the_mean_of_what_is_known():
    values = np.array([[1.0, np.nan, np.nan], [3.0, 5.0, np.nan]])
    np.testing.assert_array_equal(mean_known(values), [2.0, 5.0, np.nan])


@given(st.integers(1, 40), st.floats(0.3, 3), st.integers(100, 1000), st.integers(100, 1000))
def test_tiles_fit(n_pictures, aspect, width_px, height_px):
    tiling = tile(n_pictures, aspect, width_px, height_px)
    assert tiling.columns * tiling.rows >= n_pictures
    assert tiling.columns * tiling.width_px <= width_px
    assert tiling.rows * tiling.height_px <= height_px + tiling.rows  # rounded heights


def test_four_pictures_make_a_square():
    tiling = tile(4, 4 / 3, 640, 720)
    assert (tiling.columns, tiling.rows, tiling.width_px, tiling.height_px) == (2, 2, 320, 240)


@pytest.mark.parametrize("suffix", [".webp", ".gif"])
def test_a_clip_decodes_to_its_frames(tmp_path, suffix):
    results, assembly = run()
    path, done = tmp_path / "new" / f"clip{suffix}", []
    make_clip(
        results, assembly, path, width_px=240, fps=5.0, every=2, progress=lambda *each: done.append(each)
    )
    found, animation = cv2.imreadanimation(str(path))
    assert found
    assert done == [(1, 2), (2, 2)]
    assert len(animation.frames) == 2
    assert animation.frames[0].shape[1] == 240
    assert list(animation.durations) == [200, 200]
    assert animation.loop_count == 0  # for ever


def test_a_clip_of_a_run_that_was_cut_off_without_truth_ends_there(tmp_path):
    results, assembly = run(frames=1, truth=False)
    make_clip(results, assembly, tmp_path / "clip.webp", width_px=240, progress=lambda *_: None)
    _, animation = cv2.imreadanimation(str(tmp_path / "clip.webp"))
    assert len(animation.frames) == 1


def test_a_clip_that_cannot_be_is_refused(tmp_path):
    results, assembly = run()
    with pytest.raises(ValueError, match=r"clip\.avi: a clip ends in \.webp or \.gif or \.mp4: name it so"):
        make_clip(results, assembly, tmp_path / "clip.avi", progress=lambda *_: None)
    with pytest.raises(ValueError, match="has no estimates"):
        make_clip(Results(results.scenario), assembly, tmp_path / "clip.webp", progress=lambda *_: None)
    (tmp_path / "taken.webp").mkdir()
    with pytest.raises(OSError, match="taken"):
        make_clip(results, assembly, tmp_path / "taken.webp", width_px=240, progress=lambda *_: None)


def test_the_figure_of_errors_has_each_estimator():
    results, _ = run()
    axes = plot_errors(results).axes[0]
    assert axes.get_ylabel() == "position error / m"
    assert axes.get_yscale() == "log"
    by_color = {}
    for line in axes.lines:
        by_color.setdefault(line.get_color(), []).append(line)
    assert {kind: len(by_color[COLORS[kind]]) for kind in ("dcpf", "cpf", "single")} == {
        "dcpf": 1,
        "cpf": 1,
        "single": 3,
    }
    np.testing.assert_allclose(by_color[COLORS["dcpf"]][0].get_ydata(), 0.1)
    np.testing.assert_allclose(by_color[COLORS["cpf"]][0].get_ydata(), 0.2)
    plot_errors(run(frames=2)[0])  # a run that was cut off


def test_errors_without_a_truth_cannot_be_plotted():
    with pytest.raises(ValueError, match="square has no truth"):
        plot_errors(run(truth=False)[0])


def summary(name, seed, dcpf, *, lost=False):
    return {
        "scenario": name,
        "seed": seed,
        "rmse_m": {"dcpf": dcpf, "cpf": 0.1, "single": {"C1": 0.9, "C2": 0.4, "C3": None}},
        "lost": {"dcpf": lost, "cpf": False, "single": {"C1": True, "C2": False, "C3": True}},
    }


def test_the_figure_of_many_runs_has_points_and_medians():
    rows = [summary("a", 0, 0.1), summary("a", 1, 0.2), summary("a", 2, 3.0, lost=True)]
    axes = plot_comparison([*rows, summary("b", 0, 0.3)]).axes[0]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["a", "b"]
    assert axes.get_ylabel() == "RMSE of the position / m"
    points = {
        (line.get_marker(), line.get_color()): np.sort(line.get_ydata())
        for line in reversed(axes.lines)
        if line.get_marker() in ("o", "x") and len(line.get_ydata()) > 0 and line.get_xdata().max() < 0.5
    }
    np.testing.assert_allclose(points["o", COLORS["dcpf"]], [0.1, 0.2])
    np.testing.assert_allclose(points["x", COLORS["dcpf"]], [3.0])
    np.testing.assert_allclose(points["o", COLORS["single"]], [0.4] * 3)  # the best camera
    assert [text.get_text() for text in axes.texts] == ["0.2", "0.1", "0.4", "0.3", "0.1", "0.4"]


def test_runs_without_a_baseline_are_compared_as_far_as_they_go():
    row = summary("a", 0, 0.1)
    row = {
        **row,
        "rmse_m": {"dcpf": 0.1, "cpf": None, "single": {}},
        "lost": {"dcpf": False, "cpf": None, "single": {}},
    }
    assert [text.get_text() for text in plot_comparison([row]).axes[0].texts] == ["0.1"]
    with pytest.raises(ValueError, match="no runs to compare"):
        plot_comparison([])


def test_figures_are_written_twice_and_always_alike(tmp_path):
    rows = [summary("a", 0, 0.1), summary("b", 0, 0.2)]
    for name in ("one", "two"):
        write_figure(plot_comparison(rows), tmp_path / name / "comparison")
    for suffix in (".svg", ".png"):
        first, second = ((tmp_path / name / f"comparison{suffix}").read_bytes() for name in ("one", "two"))
        assert first == second
    assert cv2.imread(str(tmp_path / "one" / "comparison.png")).shape[1] >= 1000


def test_colours_are_the_same_on_screen_and_paper():
    for color in COLORS.values():
        np.testing.assert_allclose(bgr(color)[::-1] / 255, matplotlib.colors.to_rgb(color))


def test_clips_need_no_matplotlib():
    code = "import sys, sim.pictures.clip; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
