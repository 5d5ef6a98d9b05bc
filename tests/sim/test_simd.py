"""`dcpf simd`: its tables, its JSON, its picture, and one sentence for each mistake."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from nodes.simd.pipeline import LINE_INTERVAL_US, Pipeline
from sim.commands.app import app
from sim.pictures.line_intervals import plot_line_intervals


def run(*arguments):
    return CliRunner().invoke(app, ["simd", *map(str, arguments)])


def test_json_has_every_row_beside_the_papers():
    document = json.loads(run("--json").stdout)
    assert document["clock_mhz"] == 80
    assert document["line_memory_words"] == 62
    assert document["holds_30_fps"] is True
    assert len(document["rows"]) == 8
    for row in document["rows"].values():
        assert row["ratio"] == pytest.approx(row["counted_us"] / row["paper_us"])
    assert document["total_us"] == pytest.approx(sum(row["counted_us"] for row in document["rows"].values()))


def test_the_tables_and_the_picture(tmp_path):
    result = run("--out", tmp_path / "lines.png", "--set", "simd.clock_mhz=40")
    assert result.exit_code == 0
    assert "Bhattacharyya distances" in result.stdout
    assert "holds 30 frames/s: yes" in result.stdout
    assert (tmp_path / "lines.png").stat().st_size > 10_000
    assert (tmp_path / "lines.svg").exists()


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        ("simd.arithmetic=fixed30", "simd.arithmetic must be"),
        ("n_particles=[400]", "400 particles are too many"),
        ("histogram_words=43", ""),
        ("sigma=0", "sigma"),
        ("n_particles=[240,1]", "n_particles[1] must be greater than or equal to 2"),
        ("n_particles=[]", "n_particles must have at least 1 item"),
        ("noise_px=1e9", "the array holds 0.25, 0.5, … to 255.75"),
        ("process=[1.3,0]", "the nearest are 1.3125 and 0"),
        ("simd.words=20", "the line memory has 20 words"),
        ("nothing", "has no ="),
    ],
)
def test_mistakes_are_one_sentence(override, sentence):
    result = run("--set", override)
    if not sentence:  # more words than bins are as many as bins
        assert result.exit_code == 0
        return
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert "Traceback" not in result.stderr


def test_a_small_line_memory_says_what_uses_it():
    result = run("--set", "simd.words=50", "--set", "histogram_words=40")
    assert result.exit_code == 2
    assert "Histograms" in result.stderr


def test_the_bars_add_up_to_the_arrays_work():
    pipeline = Pipeline(240, 13.0, 225, 2.5, 240, 6, 5.5 * LINE_INTERVAL_US)
    time, traffic = plot_line_intervals(pipeline, 256.0, 480).axes
    busy = sum(bar.get_height() for bar in time.patches)
    assert busy == pytest.approx(pipeline.busy_us)
    moved = sum(bar.get_height() for bar in traffic.patches)
    assert moved == pytest.approx(240 * 256 + 225 * 240)
    assert len(np.unique([bar.get_x() for bar in time.patches])) == pipeline.lines
