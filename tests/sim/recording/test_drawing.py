"""Recordings in other hands: clips of them, films as MP4, and Rerun, where they are installed."""

import subprocess
import sys

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from sim.commands.app import app
from sim.recording.filmed import opened
from sim.results.recorder import read_run


def test_a_recording_draws_as_its_run_does(recorded):
    run = recorded()
    of_folder = read_run(run.folder)
    with opened(run.film) as (results, assembly):
        assert results.tracks.keys() == of_folder.tracks.keys()
        for track in results.tracks:
            np.testing.assert_array_equal(results.means(track), of_folder.means(track))
        np.testing.assert_array_equal(results.true_states(), of_folder.true_states())
        shown = assembly.source("D").read(4).astype(int)
        assert np.abs(shown - run.assembly.source("D").read(4)).mean() < 6


@pytest.mark.parametrize("place", ["folder", "film"])
def test_films_as_mp4(recorded, tmp_path, place):
    pytest.importorskip("imageio_ffmpeg", reason="the extra mp4 is not installed")
    run = recorded()
    path = tmp_path / "film.mp4"
    result = CliRunner().invoke(app, ["clip", str(getattr(run, place)), "--out", str(path), "--width", "321"])
    assert result.exit_code == 0, result.output
    film = cv2.VideoCapture(str(path))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 6
    assert film.get(cv2.CAP_PROP_FRAME_WIDTH) == 320
    assert film.get(cv2.CAP_PROP_FPS) == 10


@pytest.mark.parametrize(
    ("command", "package", "extra"),
    [(["clip", "--out", "x.mp4"], "imageio_ffmpeg", "mp4"), (["replay", "--rerun"], "rerun", "rerun")],
)
def test_an_extra_that_is_missing_is_one_sentence(recorded, monkeypatch, command, package, extra):
    run = recorded(("frames", "2"))
    monkeypatch.setattr("sim.pictures.mp4.find_spec", lambda name: None if name == package else 1)
    monkeypatch.setattr("sim.commands.replay.find_spec", lambda name: None if name == package else 1)
    result = CliRunner().invoke(app, [*command, str(run.folder)])
    assert result.exit_code == 2
    assert f"pip install 'dcpf[{extra}]'" in result.output
    assert len(result.output.split("\n")) <= 3
    assert "Traceback" not in result.output


def test_a_run_without_pictures_is_not_for_rerun(recorded):
    from sim.replay.opening import film_of
    from sim.results.recorder import RecordingError

    run = recorded(("frames", "2"), pictures=False)
    with pytest.raises(RecordingError, match="run it again with --record"):
        film_of(run.folder)


def test_rerun_reads_a_recording_and_what_we_add(recorded, tmp_path):
    rr = pytest.importorskip("rerun", reason="the extra rerun is not installed")
    from sim.recording.rerun_viewer import show

    run = recorded()
    stream = rr.RecordingStream("dcpf")
    stream.save(tmp_path / "run.rrd")
    show(run.film, stream)
    stream.disconnect()
    command = [sys.executable, "-m", "rerun", "rrd", "print", "-v", str(tmp_path / "run.rrd")]
    printed = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout
    by_rerun = ("/A/image", "/A/calibration", "/A/particles", "/tf", "/log")
    for entity in (*by_rerun, "/scene/dcpf/A/lines", "/A/image/truth"):
        assert entity in printed
