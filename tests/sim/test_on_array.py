"""The emulated array in scenarios: what it cannot do is one sentence before anything runs."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from sim.commands.app import app
from sim.commands.run import _timing_lines

WICA = Path(__file__).parents[2] / "scenarios" / "wica.yaml"


def dcpf(command, path, *overrides, options=()):
    changes = [each for override in overrides for each in ("--set", override)]
    return CliRunner().invoke(app, [command, str(path), *options, *changes])


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        (["filter.simd.words=20"], "the line memory has 20 words"),
        (["filter.simd.words=40", "filter.simd.resampling=residual", "filter.simd.arithmetic=fixed20"], "40"),
        (["filter.simd.processing_elements=250"], "256 pixels wide and the array has 250 elements: take"),
        (["filter.simd.processing_elements=200"], "240 particles are too many: the array has room for 200"),
        (
            ["filter.simd.bits=8", "filter.n_particles=200", "filter.dynamics.position_variance=0.1"],
            "1, 2, … to 255",
        ),
        (["target.start.position=[500,500]"], "outside of the picture of 256 x 240 pixels: start inside"),
        (
            ["filter.dynamics.position_variance=1e20"],
            "deviation of 1e+10 pixels, and the array holds 0.25, 0.5, … to",
        ),
        (
            ["filter.dynamics.position_variance=0.01"],
            "deviation of 0.1 pixels, and the array holds 0.25, 0.5, … to",
        ),
        (["filter.dynamics.A=1.3"], "A is 1.3 and B is -0.5: the array holds sixteenths"),
        (["filter.dynamics.A=30", "filter.dynamics.B=-29"], "add up to 31.9375 at most"),
        (["filter.dynamics.position_variance=0.09"], "the nearest is 0.25 (noise_px"),
        (["filter.sampling.grid=[5,5]"], "filter.sampling.grid is not [15, 15], which target.size_px is"),
        (["filter.color.space=joint_rgb", "filter.color.bins_per_channel=9"], "729 bins, and the array's"),
        (["filter.sampling.grid=[300,300]"], "90,000 samples in one part"),
    ],
)
def test_what_the_array_cannot_do_is_said_by_check(overrides, sentence):
    result = dcpf("check", WICA, *overrides)
    assert result.exit_code == 2, result.output
    assert sentence in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_what_a_networks_array_cannot_do_is_said_by_check(small):
    result = dcpf("check", small, "filter.backend=simd", "filter.simd.words=20")
    assert result.exit_code == 2
    assert "give it more (simd.words)" in result.stderr


@pytest.mark.parametrize("words", [30, 35, 64])
def test_what_check_accepts_runs(words, tmp_path):
    overrides = f"filter.simd.words={words}", "frames=3"
    assert dcpf("check", WICA, *overrides).exit_code == 0
    result = dcpf("run", WICA, *overrides, options=["--in-process", "--out", str(tmp_path / "run")])
    assert result.exit_code == 0, result.output
    assert f"of {words} words" in result.stdout


@pytest.mark.parametrize("timing", [{}, {"frames_per_s": 30.0}, {"first_estimate_s": 1.0}])
def test_a_run_without_an_estimate_has_no_times_to_tell(timing):
    assert not list(_timing_lines(timing))


@pytest.mark.parametrize(
    ("override", "advice"),
    [
        ("seed=0", ""),
        ("baselines.single=false", ""),
        ("filter.resampling.threshold=0.3", "with filter.resampling.threshold: 1.0, whatever"),
        ("filter.color.gain_correction=true", "with filter.color.gain_correction: false, whatever"),
        ("preset=robust", "filter.model_update.alpha: 0.0"),
    ],
)
def test_what_the_tracker_does_not_have_is_said(override, advice):
    result = dcpf("check", WICA, override)
    assert result.exit_code == 0
    assert advice in result.stderr
    assert bool(advice) == bool(result.stderr)


@pytest.mark.parametrize("override", ["filter.sampling.kernel=epanechnikov", "target.start.velocity=[60,0]"])
def test_what_the_tracker_has_is_handed_on(override, summary_of):
    plain = summary_of(WICA, ("frames", "4"))["rmse_px"]["single"]["C1"]
    assert summary_of(WICA, ("frames", "4"), tuple(override.split("=")))["rmse_px"]["single"]["C1"] != plain
