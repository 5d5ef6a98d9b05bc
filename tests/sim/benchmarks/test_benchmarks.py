"""The benchmarks measure what they say: the loop finds the filter's distances, threads find one thread's."""

import numpy as np
import pytest

from nodes import threads
from sim.benchmarks import parallel
from sim.benchmarks.filtering import bench_filter, n_rounds
from sim.benchmarks.settings import LOOP, SCENARIOS, SETTINGS, setting
from sim.benchmarks.timing import times_in_turn
from sim.pictures.parallel import plot_parallel


@pytest.fixture(scope="module", params=SETTINGS)
def chosen(request):
    return setting(request.param, SCENARIOS)


def test_the_loop_finds_the_distances_of_every_backend(chosen):
    found = {name: chosen.likelihood(name)() for name in chosen.models}
    assert {"fast", LOOP} <= set(found)
    space = chosen.models[LOOP].options.color.space
    for name, distances in found.items():
        # OpenCV's hues are rounded and know no grey: there, only the order of the boxes is alike
        if name in {"fast", "compiled"} and space != "hue":
            np.testing.assert_allclose(distances, found[LOOP], atol=1e-5)
        assert np.corrcoef(distances, found[LOOP])[0, 1] > 0.9


def test_every_backend_and_the_loop_step(chosen):
    for name in chosen.models:
        particles, info = chosen.step(name)()
        assert particles.states.shape == chosen.particles.states.shape
        assert np.isfinite(info.estimate.mean).all()


def test_the_boxes_are_where_the_settings_say(chosen):
    n, size = len(chosen.boxes), chosen.boxes[:, 2:] - chosen.boxes[:, :2]
    expected = {40: (240, (15, 15)), 512: (300, (40, 60))}.get(chosen.models[LOOP].options.color.n_bins)
    if expected is None:
        assert n == 500
        assert size.std() > 0
    else:
        assert n == expected[0]
        np.testing.assert_allclose(size, np.broadcast_to(expected[1], size.shape))


def test_the_report_has_a_ratio_for_each_backend():
    rounds = []
    report = bench_filter(SCENARIOS, lambda: rounds.append(1), rounds=1)
    assert len(rounds) == n_rounds(1)
    assert report.keys() == {"likelihood", "step"}
    for settings in report.values():
        assert list(settings) == ["A", "B", "C"]
        for figures in settings.values():
            assert {"fast", "loop_ms"} <= set(figures)
            assert min(figures.values()) > 0


def test_threads_and_one_thread_agree_in_the_clip(monkeypatch):
    monkeypatch.setattr(parallel, "PARTICLES", (300, 17_000))
    monkeypatch.setattr(parallel, "CLIP_PARTICLES", (300, 17_000))
    monkeypatch.setattr(parallel, "ROUNDS", 1)
    monkeypatch.setattr(threads, "n_cores", lambda: 2)
    report = parallel.bench_parallel(SCENARIOS, 2, n_frames=4)
    assert report["threads"] == 2
    assert report["particles"] == 17_000
    assert [row["threads_used"]["likelihood"] for row in report["steps"]] == [1, 2]
    assert report["clip"] == report["frames_per_s"]["parallel"] / report["frames_per_s"]["sequential"]
    assert min(report["likelihood"], report["resampling"], report["clip"]) > 0


def test_times_are_medians_of_equal_turns():
    calls = []
    ticks = iter(range(1000))
    took = times_in_turn(
        {"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, lambda: float(next(ticks)), 3, 1e-9
    )
    assert took == {"a": 1.0, "b": 1.0}  # one tick between two looks at the clock
    assert calls[4:] == ["a", "a", "b", "b"] * 3  # after two calls of each to see how long they take


def test_the_plot_has_a_panel_for_each_step_and_one_for_the_clip():
    times = {"sequential": 2.0, "parallel": 1.0}
    rows = [
        {
            "particles": n,
            "threads_used": {"likelihood": used, "resampling": used},
            "ms": {"likelihood": times, "resampling": times, "shuffle": times},
        }
        for n, used in ((300, 1), (100_000, 2))
    ]
    rates = {300: {"sequential": 900.0, "parallel": 900.0}, 100_000: {"sequential": 9.0, "parallel": 15.0}}
    figure = plot_parallel({"threads": 2, "steps": rows, "frames_per_s_by_particles": rates})
    titles = [axes.get_title() for axes in figure.axes]
    assert titles == ["shuffling: one thread", "resampling", "likelihood", "whole clip"]
    heights = [bar.get_height() for bar in figure.axes[3].patches]
    assert heights == [900.0, 900.0, 9.0, 15.0]
