"""The folder of a run: the same whatever the order of arrival, readable when cut off, whole or not at all."""

import json
import random
from itertools import product

import numpy as np
import pytest

from network.wire.messages import EstimateMessage, TruthMessage
from sim.results.recorder import Recorder, RecordingError, expected_tracks, read_run
from sim.results.results import Results, summarize
from sim.scenario.loading import load_scenario


@pytest.fixture
def scenario(small):
    return load_scenario(small, [("frames", "3")])


def estimate(track, frame):
    kind, node = track
    mean = np.array([0.1 * frame, 1 / 3, 0.0, 1.5])
    return EstimateMessage(
        run="small",
        node=node,
        estimator=kind,
        frame=frame,
        time_s=frame / 10,
        mean=mean,
        covariance=np.eye(4) / 7,
        visible=True,
        lost=False,
        ess=40.0,
        iterations=3,
        members=("A", "B"),
    )


def all_estimates(scenario):
    return [estimate(*each) for each in product(sorted(expected_tracks(scenario)), range(scenario.frames))]


def test_everybody_who_will_estimate_is_expected(small):
    alone = load_scenario(small, [("baselines", "{cpf: false, single: false}")])

    assert expected_tracks(alone) == {("dcpf", name) for name in "ABCD"}
    assert len(expected_tracks(load_scenario(small))) == 9


def test_a_frame_that_a_node_leaves_out_in_real_time_holds_nothing_up(small, tmp_path):
    scenario = load_scenario(small, [("frames", "4"), ("pace", "realtime")])
    written = []
    with Recorder(tmp_path / "run", scenario) as recorder:
        for frame in range(4):
            for track in sorted(expected_tracks(scenario)):
                if (frame, track) != (1, ("dcpf", "B")):
                    recorder.add(estimate(track, frame))
            written.append(len((tmp_path / "run" / "estimates.jsonl").read_bytes().splitlines()))

    assert written == [9, 9, 26, 35]


@pytest.mark.parametrize("seed", range(5))
def test_the_file_is_the_same_whatever_the_order_of_arrival(scenario, tmp_path, seed):
    messages = all_estimates(scenario)
    random.Random(seed).shuffle(messages)

    with Recorder(tmp_path / "run", scenario) as recorder:
        for message in messages:
            recorder.add(message)

    lines = (tmp_path / "run" / "estimates.jsonl").read_text(encoding="utf-8").splitlines()
    found = [(each["frame"], each["estimator"], each["node"]) for each in map(json.loads, lines)]
    cameras = ["A", "B", "C", "D"]
    of_a_frame = [("dcpf", n) for n in cameras] + [("cpf", "central")] + [("single", n) for n in cameras]
    assert found == [(frame, *track) for frame in range(3) for track in of_a_frame]


def test_a_frame_is_written_when_everything_of_it_has_come(scenario, tmp_path):
    file = tmp_path / "estimates.jsonl"
    *most, last = [message for message in all_estimates(scenario) if message.frame == 0]
    with Recorder(tmp_path, scenario) as recorder:
        for message in most:
            recorder.add(message)
        assert not file.read_text()

        recorder.add(last)

        assert len(file.read_text().splitlines()) == 9


def test_nobody_waits_for_a_node_that_is_gone(scenario, tmp_path):
    with Recorder(tmp_path, scenario) as recorder:
        for message in all_estimates(scenario):
            if message.node != "B" or message.frame == 0:
                recorder.add(message)
        recorder.forget("B")

        assert len((tmp_path / "estimates.jsonl").read_text().splitlines()) == 9 + 7 + 7


def test_a_run_that_was_cut_off_can_be_read(scenario, tmp_path):
    with Recorder(tmp_path, scenario) as recorder:
        for message in all_estimates(scenario):
            recorder.add(message)
        recorder.add(TruthMessage("small", 0, 0.0, np.zeros(4), {}))
    for name in ("estimates", "truth"):
        path = tmp_path / f"{name}.jsonl"
        path.write_bytes(path.read_bytes() + path.read_bytes().splitlines()[0][:50])

    results = read_run(tmp_path)

    assert results.scenario == scenario
    assert sum(map(len, results.tracks.values())) == 27
    assert list(results.truth) == [0]
    np.testing.assert_array_equal(results.tracks["dcpf", "B"][2].mean, estimate(("dcpf", "B"), 2).mean)


def test_a_recorded_run_has_the_figures_of_the_run_itself(small, told, tmp_path):
    results = Results(load_scenario(small))
    with Recorder(tmp_path / "run", results.scenario) as recorder:
        for message in told(small):
            results.add(message)
            recorder.add(message)
        recorder.finish(summarize(results, processes=1))

    written = json.loads((tmp_path / "run" / "summary.json").read_text())
    again = summarize(read_run(tmp_path / "run"), processes=1)

    for key in ("rmse_m", "ratio_dcpf_cpf", "lost", "disagreement_m", "anees"):
        assert again[key] == written[key]


def test_an_earlier_run_in_the_folder_is_replaced(scenario, tmp_path):
    with Recorder(tmp_path, scenario) as recorder:
        recorder.add(estimate(("dcpf", "A"), 0))
        recorder.finish({"old": True})

    with Recorder(tmp_path, scenario):
        assert not (tmp_path / "summary.json").exists()

    assert not (tmp_path / "estimates.jsonl").read_text()


def test_a_full_disk_is_told_in_a_sentence(scenario, tmp_path):
    (tmp_path / "estimates.jsonl").symlink_to("/dev/full")

    with Recorder(tmp_path, scenario) as recorder:
        recorder.add(estimate(("dcpf", "A"), 0))
        with pytest.raises(
            RecordingError, match="No space left on device: free space, or name another --out"
        ):
            recorder.finish({})

    assert not (tmp_path / "summary.json").exists()


def test_the_summary_is_whole_or_not_at_all(scenario, tmp_path):
    (tmp_path / "summary.json.part").symlink_to("/dev/full")

    with (
        Recorder(tmp_path, scenario) as recorder,
        pytest.raises(RecordingError, match=str(tmp_path)),
    ):
        recorder.finish({"frames": 3})

    assert not (tmp_path / "summary.json").exists()


def test_a_folder_that_cannot_be_made_is_named(scenario, tmp_path):
    (tmp_path / "file").touch()

    with pytest.raises(RecordingError, match="file/run: the run cannot be recorded there: Not a directory"):
        Recorder(tmp_path / "file" / "run", scenario)


@pytest.mark.parametrize("folder", ["nowhere", "."])
def test_what_is_no_run_cannot_be_read(tmp_path, folder):
    with pytest.raises(RecordingError, match="is not the folder of a run"):
        read_run(tmp_path / folder)
