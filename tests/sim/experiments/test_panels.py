"""What the panels draw, against the findings that they draw it from."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sim.experiments.found.findings import Findings, GroupFindings
from sim.experiments.options import ExperimentOptions
from sim.experiments.plan import make_plan
from sim.pictures.experiment import PANELS, plot_page, plot_study
from sim.pictures.swept import lines_of, places_of, tick_labels
from sim.pictures.theme import COLORS

N_FRAMES = 5
TRUTH = [[0.0, float(frame)] for frame in range(N_FRAMES)]


def track(error):
    """A track that is always so far from the truth, to the right."""
    return {"positions": [[x + error, y] for x, y in TRUTH], "nees": [1.0] * N_FRAMES}


@pytest.fixture
def findings(small):
    """Findings of a study for each kind of plot, with errors that follow from n, t and seed."""
    grid = {"network.iterations": ["1", "12"], "filter.n_particles": ["300", "500"]}
    studies = {
        "error": {"sweep": grid},
        "graph": {"sweep": {"network.graph": ["ring", "path"]}},
        "bytes": {"plot": "bytes", "sweep": {"network.iterations": ["1", "12"]}, "jpeg_quality": 90},
        "rules": {
            "plot": "bytes",
            "sweep": {
                "network.iterations": ["1", "12"],
                "network.consensus.algorithm": ["metropolis", "event_triggered"],
            },
        },
        "time": {"plot": "time", "sweep": {"filter.n_particles": ["300", "500"]}},
        "paths": {"plot": "paths"},
        "frames": {"plot": "frames"},
    }
    options = ExperimentOptions.model_validate(
        {"name": "e", "runs": 3, "scenarios": [str(small)], "page": ["error", "paths"], "studies": studies}
    )
    plan = make_plan(options, small.parent, [], lambda *_: "here")
    groups = tuple(GroupFindings(group, list(results(group))) for group in plan.groups)
    return Findings(options, groups, dict.fromkeys(studies, 0))


def results(group):
    settings = dict(group.settings)
    t, n = (float(settings.get(key, 10)) for key in ("network.iterations", "filter.n_particles"))
    is_other = settings.get("network.consensus.algorithm") == "event_triggered"
    network = {
        "network": {key: {"dcpf": 512 * t, "cpf": 1e6} for key in ("bytes_per_frame", "bytes_at_start")},
        "timing": {},
        "unit": "m",
    }
    for seed in group.seeds:
        error = 0.1 / t + 10 / n + 0.01 * seed + 0.02 * is_other
        cameras = {
            "tracks": {
                **{f"dcpf/{name}": track(error) for name in "ABCD"},
                **{f"single/{name}": track(5 * error) for name in "AB"},
            },
            "cpu_ms_per_frame": 4 * n,
            "summary": {
                **network,
                **{key: {"dcpf": 1, "cpf": 1} for key in ("rmse_m", "lost", "anees", "tracking")},
            },
        }
        central = {
            "tracks": {"cpf/c": track(error / 2)},
            "cpu_ms_per_frame": n,
            "summary": cameras["summary"],
        }
        coded = {**central, "bytes_per_frame": {"jpeg": 1e5, "bins": 2e5}}
        parts = {"cameras": cameras, "central": central, "coded": coded}
        yield {kind: {**part, "truth": TRUTH} for kind, part in parts.items()}


def panel(findings, name):
    axes = Figure().add_subplot()
    PANELS[findings.options.studies[name].plot](axes, findings.study(name))
    return axes


def lines(axes):
    return {line.get_label(): line for line in axes.get_lines() if not line.get_label().startswith("_")}


def points(axes):
    """Where the points with error bars stand on the axis."""
    return {each.get_label(): each.lines[0].get_xdata() for each in axes.containers}


def test_a_line_for_each_estimator_and_each_value_of_the_second_key(findings):
    drawn = lines(panel(findings, "error"))

    assert set(drawn) == {
        "each single camera",
        *(f"{name}, n = {n}" for name in ("DCPF", "CPF", "best single camera") for n in (300, 500)),
    }
    few = drawn["DCPF, n = 300"]
    np.testing.assert_allclose(few.get_xdata(), [1, 12])
    # The mean over the seeds 0, 1, 2.
    np.testing.assert_allclose(few.get_ydata(), [0.1 + 10 / 300 + 0.01, 0.1 / 12 + 10 / 300 + 0.01])
    assert few.get_color() == COLORS["dcpf"]
    assert few.get_linestyle() != drawn["DCPF, n = 500"].get_linestyle()


def test_of_an_interrupted_study_the_lines_are_as_long_as_there_are_settings(findings):
    """All but the last: t = 12 with 500 particles."""
    last = {"network.iterations": "12", "filter.n_particles": "500"}
    groups = tuple(each for each in findings.groups if each.settings != last)

    drawn = lines(panel(replace(findings, groups=groups), "error"))

    np.testing.assert_allclose(drawn["DCPF, n = 300"].get_xdata(), [1, 12])
    np.testing.assert_allclose(drawn["DCPF, n = 500"].get_xdata(), [1])


def test_what_the_other_keys_do_not_concern_is_drawn_once(findings):
    """CPF on other graphs is CPF."""
    groups = [
        replace(
            each,
            results=[
                {**run, "central": first["central"]}
                for run, first in zip(each.results, same.results, strict=True)
            ],
        )
        for each in findings.study("error")
        for same in findings.study("error")
        if same.settings == {**each.settings, "filter.n_particles": "300"}
    ]

    axes = Figure().add_subplot()
    PANELS["error"](axes, groups)

    drawn = lines(axes)
    assert {name for name in drawn if "CPF" in name} == {"CPF", "DCPF, n = 300", "DCPF, n = 500"}
    np.testing.assert_allclose(drawn["CPF"].get_xdata(), [1, 12])


def test_words_stand_at_their_place_on_the_axis(findings):
    axes = panel(findings, "graph")

    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["ring", "path"]
    assert axes.get_xlabel() == "communication graph"


def test_bytes_are_those_that_were_sent(findings):
    axes = panel(findings, "bytes")

    np.testing.assert_allclose(points(axes)["DCPF\nt = 1 to 12"], [512, 6144])
    assert {name: x.tolist() for name, x in points(axes).items() if "DCPF" not in name} == {
        "CPF, raw pictures": [1e6],
        "CPF, JPEG": [1e5],
        "CPF, bin indices as PNG": [2e5],
    }


def test_bytes_have_a_line_for_each_value_of_the_second_key(findings):
    axes = panel(findings, "rules")

    # words speak for themselves
    assert {name for name in points(axes) if "DCPF" in name} == {
        "DCPF, metropolis\nt = 1 to 12",
        "DCPF, event triggered\nt = 1 to 12",
    }


def test_ticks_that_would_run_into_each_other_have_no_label():
    places, is_number = places_of(["1", "2", "4", "20"])

    assert is_number
    assert tick_labels(places, ["1", "2", "4", "20"]) == ["1", "", "4", "20"]


def test_yes_and_no_are_named(findings):
    key = ("filter.model_update.gated", "true")
    (group, *_) = findings.study("rules")
    named = replace(group, group=replace(group.group, settings=(*group.group.settings, key)))

    assert list(lines_of([named], "dcpf")) == [", metropolis, gated = true"]


def test_time_is_a_cameras_and_the_central_nodes(findings):
    drawn = points(panel(findings, "time"))

    np.testing.assert_allclose(drawn["DCPF, each camera\nn = 300 to 500"], [300, 500])
    np.testing.assert_allclose(drawn["CPF, central node\nn = 300 to 500"], [300, 500])


def test_paths_are_truth_and_mean_deviation(findings):
    drawn = lines(panel(findings, "paths"))

    np.testing.assert_allclose(drawn["truth"].get_xydata(), TRUTH)
    error = 0.1 / 10 + 10 / 10 + 0.01
    np.testing.assert_allclose(drawn["DCPF"].get_xdata(), [error] * N_FRAMES)
    np.testing.assert_allclose(drawn["best single camera"].get_xdata(), [5 * error] * N_FRAMES)


def test_frames_show_the_median_from_frame_one_on(findings):
    line = lines(panel(findings, "frames"))["CPF"]

    np.testing.assert_allclose(line.get_xdata(), np.arange(1, N_FRAMES))
    np.testing.assert_allclose(line.get_ydata(), [(0.1 / 10 + 10 / 10 + 0.01) / 2] * (N_FRAMES - 1))


def test_a_page_has_a_row_a_study_and_its_figures_a_title(findings):
    page = plot_page(findings, "robust")

    assert [axes.get_title() for axes in page.axes] == ["small (robust)"] * 2
    assert [axes.get_xlabel() for axes in page.axes] == ["rounds of consensus t", "x / m"]
    assert len(plot_study(findings, "error").axes) == 1


@pytest.mark.parametrize("name", ["error", "graph", "bytes", "rules", "time", "frames", "paths"])
def test_no_label_is_drawn_over_another_or_cut_off(findings, name):
    figure = plot_study(findings, name)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()

    renderer, (width, height) = canvas.get_renderer(), canvas.get_width_height()
    (axes,) = figure.axes
    texts = [axes.xaxis.label, axes.yaxis.label, axes.title, *axes.get_legend().get_texts(), *axes.texts]
    boxes = [text.get_window_extent(renderer) for text in texts if text.get_text()]
    for index, box in enumerate(boxes):
        assert box.x0 >= 0
        assert box.y0 >= 0
        assert box.x1 <= width
        assert box.y1 <= height
        assert not any(box.overlaps(other) for other in boxes[:index])
