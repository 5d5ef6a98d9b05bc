"""Reading recordings back: whole ones, cut-off ones, folders without pictures, and what is none at all."""

import json

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from network.wire import codec
from network.wire.messages import PreviewMessage
from sim.recording.reader import McapRecording
from sim.replay.folder import FolderRecording
from sim.replay.opening import open_recording
from sim.results.recorder import FILM, RecordingError


def all_of(recording, *, pictures=True):
    return [list(recording.at(frame, pictures=pictures)) for frame in range(recording.frames)]


def test_a_recording_gives_back_what_was_told(recorded):
    run = recorded()
    recording = open_recording(run.folder)
    assert isinstance(recording, McapRecording)
    assert recording.scenario == run.assembly.scenario
    frames = all_of(recording)
    recording.close()

    assert len(frames) == 6
    told = {data for frame in frames for _, data in frame}
    assert told >= set(run.lines("estimates")) | set(run.lines("truth"))
    previews = [each for each in run.told if isinstance(each, PreviewMessage)]
    assert {codec.encode("small", each) for each in previews} <= told
    for index, frame in enumerate(frames):
        keys = [key for key, _ in frame]
        assert sum(key.endswith("/preview") for key in keys) == 4
        assert "dcpf/small/C/estimate" in keys
        for key, data in frame:
            if key.endswith("/estimate"):
                assert json.loads(data)["frame"] == index


def test_pictures_may_be_left_out(recorded):
    recording = open_recording(recorded().folder)
    keys = {key for frame in all_of(recording, pictures=False) for key, _ in frame}
    recording.close()
    assert not any(key.endswith("/preview") for key in keys)


def test_nodes_come_and_go_as_they_did(recorded):
    run = recorded()
    for recording in (open_recording(run.folder), FolderRecording(run.folder)):
        assert recording.alive_at(4) == {"A", "B", "C", "D", "central"}
        assert recording.alive_at(5) == {"A", "C", "D", "central"}
        recording.close()


def test_a_folder_without_pictures_gives_the_same_messages(recorded):
    run = recorded(pictures=False)
    recording = open_recording(run.folder)
    assert isinstance(recording, FolderRecording)
    frames = all_of(recording)
    estimates = [data for frame in frames for key, data in frame if key.endswith("/estimate")]
    assert estimates == run.lines("estimates")
    assert [data for frame in frames for key, data in frame if key.endswith("/truth")] == run.lines("truth")
    # its pictures are taken again, backwards too
    for index in (3, 1):
        shown = dict(recording.at(index, pictures=True))["dcpf/small/B/preview"]
        picture = cv2.imdecode(np.frombuffer(codec.decode_preview(shown).jpeg, np.uint8), cv2.IMREAD_COLOR)
        expected = run.assembly.source("B").read(index)
        assert np.abs(picture.astype(int) - expected).mean() < 6
    recording.close()


def test_what_was_cut_off_stays_readable(recorded, tmp_path):
    run = recorded()
    whole = run.film.read_bytes()
    cut = tmp_path / "cut.mcap"

    @settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
    @given(st.integers(0, len(whole) - 1))
    def check(end):
        cut.write_bytes(whole[:end])
        try:
            recording = McapRecording(cut)
        except RecordingError:
            assert end < 20_000  # nothing but the scenario, or not even that
            return
        told = [data for frame in all_of(recording) for key, data in frame if key.endswith("/estimate")]
        recording.close()
        assert set(told) <= set(run.lines("estimates"))
        if end > 0.9 * len(whole):
            assert len(told) > 0.6 * len(run.lines("estimates"))

    check()


def test_damage_in_the_middle_ends_what_is_read_and_hurts_nobody(recorded):
    run = recorded()
    whole = bytearray(run.film.read_bytes())
    whole[len(whole) // 2 :] = bytes(len(whole) - len(whole) // 2)
    run.film.write_bytes(whole)
    recording = open_recording(run.folder)
    assert 0 < recording.frames <= 6
    recording.close()


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"", "is no recording of a run"), (b"nonsense" * 100, "is no recording"), (None, "cannot be read")],
)
def test_what_is_no_recording_is_said(tmp_path, content, words):
    path = tmp_path / "other.mcap"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(RecordingError, match=words):
        open_recording(path)


def test_other_places_are_named(tmp_path):
    with pytest.raises(RecordingError, match="neither the folder of a run nor a recording"):
        open_recording(tmp_path / "nothing")
    with pytest.raises(RecordingError, match="is not the folder of a run"):
        open_recording(tmp_path)


def test_recordings_of_other_programs_are_told_apart(tmp_path):
    from mcap.writer import Writer

    with (tmp_path / FILM).open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.finish()
    with pytest.raises(RecordingError, match="is no recording of a run"):
        open_recording(tmp_path)


def test_damage_inside_a_recording_with_an_index_is_said(recorded):
    run = recorded()
    whole = bytearray(run.film.read_bytes())
    middle = len(whole) // 2
    whole[middle : middle + 4000] = bytes(4000)
    run.film.write_bytes(whole)
    recording = open_recording(run.folder)
    with pytest.raises(RecordingError, match="is damaged at frame"):
        all_of(recording)
    recording.close()
