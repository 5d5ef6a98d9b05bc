"""Cameras whose pictures are wrong, and what the network makes of them."""

import json

import numpy as np
import pytest

from network.wire.codec import encode_public
from network.wire.messages import EstimateMessage
from sim.assembly import Assembly
from sim.faults.options import MiscalibrateOptions
from sim.faults.pictures import moved
from sim.results.results import Results, summarize
from sim.running.in_process import InProcess
from sim.scenario.loading import load_scenario


def faulty(small, *faults):
    return load_scenario(small, [("frames", "12"), ("faults", json.dumps(faults))])


def pictures(scenario, name="B"):
    source = Assembly(scenario).source(name)
    return [source.read(frame) for frame in range(8)]


def test_pictures_are_black_or_frozen_for_their_time_only(small):
    plain = pictures(faulty(small))
    black = pictures(faulty(small, {"kind": "black", "node": "B", "frame": 3, "frames": 2}))
    frozen = pictures(faulty(small, {"kind": "freeze", "node": "B", "frame": 3, "frames": 2}))
    others = pictures(faulty(small, {"kind": "black", "node": "B", "frame": 3}), "A")
    assert np.array_equal(others[5], pictures(faulty(small), "A")[5])
    for frame in (0, 1, 2, 5, 6, 7):
        assert np.array_equal(black[frame], plain[frame])
        assert np.array_equal(frozen[frame], plain[frame])
    for frame in (3, 4):
        assert not black[frame].any()
        assert np.array_equal(frozen[frame], plain[2])


def test_a_camera_that_was_knocked_sees_points_elsewhere_as_far_as_geometry_says(small):
    camera = Assembly(faulty(small)).cameras["B"]
    fault = MiscalibrateOptions(kind="miscalibrate", node="B", frame=0, yaw_deg=3.0)
    turned = moved(camera, fault)
    np.testing.assert_allclose(turned.center, camera.center, atol=1e-12)
    angle = np.arccos((np.trace(turned.R @ camera.R.T) - 1) / 2)
    assert np.rad2deg(angle) == pytest.approx(3.0)
    # turned to the left, what was in the middle is now on the right
    ahead = camera.center + 5 * camera.R[2]
    (x, _), (x_turned, _) = (each.project(ahead[None])[0][0] for each in (camera, turned))
    assert x_turned > x + 1
    shifted = moved(camera, MiscalibrateOptions(kind="miscalibrate", node="B", frame=0, offset=(0.5, 0, 0)))
    np.testing.assert_allclose(shifted.center - camera.center, [0.5, 0, 0], atol=1e-12)


def test_a_knocked_camera_gives_other_pictures_from_then_on(small):
    plain = pictures(faulty(small))
    knocked = pictures(faulty(small, {"kind": "miscalibrate", "node": "B", "frame": 4, "yaw_deg": 5}))
    assert np.array_equal(plain[3], knocked[3])
    assert not np.array_equal(plain[4], knocked[4])


@pytest.mark.parametrize("kind", ["black", "freeze"])
def test_a_camera_without_news_adds_nothing_to_what_the_others_know(small, told, kind):
    """A frozen camera is as good as a black one, whose every box is far from the reference."""
    overrides = [
        ("frames", "12"),
        ("baselines.single", "false"),
        ("faults", json.dumps([{"kind": kind, "node": "B", "frame": 4}])),
    ]
    results = Results(load_scenario(small, overrides))
    for message in told(small, *overrides):
        results.add(message)
    errors = results.errors(("dcpf", "A"))
    assert errors[4:].max() < 0.3
    assert not any(results.tracks["dcpf", "B"][frame].visible for frame in range(5, 12))


def test_a_camera_that_was_knocked_is_found_told_and_left_out(small, told):
    knock = {"kind": "miscalibrate", "node": "B", "frame": 4, "frames": 6, "yaw_deg": 3}
    overrides = [("frames", "12"), ("baselines.single", "false"), ("faults", json.dumps([knock]))]
    results = Results(load_scenario(small, overrides))
    for message in told(small, *overrides):
        results.add(message)
    (event,) = summarize(results, processes=1)["members"]["events"]
    assert event == {"frame": 4, "event": "knocked", "node": "B", "frames": 6}
    seen = [results.tracks["dcpf", "B"][frame].visible for frame in range(12)]
    assert seen == [True] * 4 + [False] * 6 + [True] * 2
    assert results.errors(("dcpf", "B")).max() < 0.3


def test_asking_whether_cameras_stand_still_changes_no_run_in_which_they_do(small, told):
    asked, not_asked = (
        [encode_public(m) for m in told(small, *extra) if isinstance(m, EstimateMessage)]
        for extra in ([], [("filter.min_likeness", "null")])
    )
    assert load_scenario(small, []).filter.min_likeness == 0.5
    assert asked == not_asked


def test_a_camera_that_is_blind_at_the_start_joins_in_when_it_has_seen_the_target_well(small):
    black = {"kind": "black", "node": "B", "frame": 0, "frames": 2}
    overrides = [("frames", "12"), ("baselines.single", "false"), ("faults", json.dumps([black]))]
    run = InProcess(Assembly(load_scenario(small, overrides)), None, with_cameras=True)
    doubted = [
        run._cameras["B"]._appearance.doubted
        for message in run.run(with_visibility=False, watched=False)
        if isinstance(message, EstimateMessage) and (message.node, message.estimator) == ("B", "dcpf")
    ]
    # black in frames 0 and 1, then five good sights
    assert doubted == [True] * 6 + [False] * 6
