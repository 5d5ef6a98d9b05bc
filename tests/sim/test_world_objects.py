"""Objects against projected outlines, the places that were asked for, and pictures without them."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from nodes.imaging.camera import look_at
from sim.assembly import Assembly
from sim.scenario.loading import load_scenario
from sim.world.figure import HEAD_MIDDLE
from sim.world.renderer import Renderer
from sim.world.visibility import visibility
from sim.world.world import WorldOptions, build_world

SCENARIOS = Path(__file__).parents[2] / "scenarios"
PLAIN = {
    "noise": 0,
    "lighting": {"camera_spread": 0},
    "room": {"size": [16, 16]},
    "walls": {"posters": 0, "doors": 0, "windows": 0},
    "floor": {"blotches": 0},
}
CUP = {"height": 0.3, "bottom_radius": 0.1, "top_radius": 0.15, "bands": ["#ff00ff"], "inside": "#ff00ff"}
ANNA = {
    "name": "anna",
    "path": [{"time_s": 0, "position": [0, 1]}, {"time_s": 2, "position": [2, 1]}],
    "wander": 0.1,
}


def camera():
    return look_at("C1", np.array([0, -3, 1.6]), np.array([0, 0, 1.0]), 300.0, (320, 240), np.zeros(5))


def cup(name="cup", at=(0.0, 0.0, 1.0), **others):
    return {"name": name, "path": [{"time_s": 0, "position": list(at)}], **CUP, **others}


def world(seed=0, **contents):
    return build_world(WorldOptions.model_validate({**PLAIN, **contents}), seed)


def is_magenta(frame):
    blue, green, red = frame.astype(int).transpose(2, 0, 1)
    return (np.minimum(blue, red) - green) > 40


def outline(at, of):
    """The hull of its two rims, as OpenCV projects and fills it: 1 inside."""
    angles = np.linspace(0, 2 * np.pi, 200)
    rims = [
        np.array(at) + np.stack([radius * np.cos(angles), radius * np.sin(angles), up + 0 * angles], axis=1)
        for radius, up in ((0.1, 0.0), (0.15, 0.3))
    ]
    points = cv2.projectPoints(np.concatenate(rims), cv2.Rodrigues(of.R)[0], of.t, of.K, of.distortion)[0]
    hull = cv2.convexHull(np.rint(16 * points).astype(np.int32))
    return cv2.fillConvexPoly(np.zeros((240, 320), np.uint8), hull, 1, cv2.LINE_8, 4)


@pytest.mark.parametrize("at", [(0.0, 0.0, 1.0), (0.5, -1.0, 1.4), (-0.6, 0.5, 0.0)])
def test_a_cup_covers_the_hull_of_its_rims(at):
    seen = is_magenta(Renderer(world(objects=[cup(at=at)]), camera()).frame(0, 0.0))
    expected = outline(at, camera()) > 0
    assert (seen & expected).sum() / (seen | expected).sum() > 0.95
    sight = visibility(world(objects=[cup(at=at)]), camera(), "cup", 0.0)
    assert sight.in_view == pytest.approx(1.0)
    assert sight.occluded == 0.0


def test_its_bands_are_in_order_from_the_bottom_up():
    picture = Renderer(world(objects=[cup(bands=["#ff0000", "#00ff00"])]), camera()).frame(0, 0.0)
    (low, high), _ = camera().project(np.array([[0, -0.12, 1.05], [0, -0.12, 1.22]]))
    for (x, y), channel in ((low, 2), (high, 1)):
        assert picture[round(y), round(x)].argmax() == channel


def test_what_is_nearer_hides_and_is_counted_so():
    behind, before = [{**ANNA, "path": [{"time_s": 0, "position": p}]} for p in ([0, 1], [0, -1])]
    for person, hidden in ((behind, False), (before, True)):
        scene = world(people=[{**person, "wander": 0.0}], objects=[cup()])
        drawn = is_magenta(Renderer(scene, camera()).frame(0, 0.0)).sum()
        alone = is_magenta(Renderer(world(objects=[cup()]), camera()).frame(0, 0.0)).sum()
        occluded = visibility(scene, camera(), "cup", 0.0).occluded
        assert drawn / alone == pytest.approx(1 - occluded, abs=0.05)
        assert (occluded > 0.3) == hidden
        # and the other way round
        assert (visibility(scene, camera(), "anna", 0.0).occluded > 0.005) == (not hidden)


def test_an_occluder_before_it_hides_it():
    panel = {"start": [-1, -1], "end": [1, -1], "top": 2.0}
    scene = world(objects=[cup()], occluders=[panel])
    assert not is_magenta(Renderer(scene, camera()).frame(0, 0.0)).any()
    assert visibility(scene, camera(), "cup", 0.0).occluded == 1.0


def test_only_what_stands_on_the_floor_has_a_shadow_there():
    empty = Renderer(world(), camera()).frame(0, 0.0).astype(int)
    standing = Renderer(world(objects=[cup(at=(0, 0, 0.0))]), camera()).frame(0, 0.0)
    (beside,), _ = camera().project(np.array([[0.0, -0.12, 0.0]]))
    x, y = np.rint(beside).astype(int)
    assert (standing[y, x] < empty[y, x] - 8).all()
    held = Renderer(world(objects=[cup(at=(0, 0, 0.8))]), camera()).frame(0, 0.0)
    changed = np.abs(held.astype(int) - empty).max(axis=2) > 0
    assert not (changed & (cv2.dilate(outline((0, 0, 0.8), camera()), np.ones((7, 7))) == 0)).any()


def test_it_moves_with_whom_it_is_attached_to():
    contents = {
        "people": [ANNA],
        "objects": [
            cup("tray", at=(0.1, 0, 1), attached_to="anna", wander=0.02),
            cup("cup", at=(0, 0, 0.2), attached_to="tray"),
        ],
    }
    scene = world(**contents)
    for time_s in (0.0, 0.7, 1.9):
        position, velocity = scene.underside("cup", time_s)
        tray, _ = scene.underside("tray", time_s)
        np.testing.assert_allclose(position, tray + np.array([0, 0, 0.2]))
        np.testing.assert_allclose(tray - [*scene.position("anna", time_s), 1], [0.1, 0, 0], atol=0.12)
        np.testing.assert_allclose(scene.middle("cup", "body", time_s)[0], position + np.array([0, 0, 0.15]))
        later, before = (scene.underside("cup", time_s + h)[0] for h in (1e-5, -1e-5))
        if 0 < time_s < 2:
            np.testing.assert_allclose(velocity, (later - before) / 2e-5, atol=1e-4)
    assert not np.allclose(scene.underside("tray", 1.0), world(1, **contents).underside("tray", 1.0))


def test_the_middle_of_a_person_and_of_their_head():
    scene = world(people=[{**ANNA, "height": [{"time_s": 0, "height": 1.8}, {"time_s": 2, "height": 1.0}]}])
    for part, share in (("body", 0.5), ("head", HEAD_MIDDLE)):
        position, velocity = scene.middle("anna", part, 1.0)
        assert position[2] == pytest.approx(share * scene.height("anna", 1.0))
        np.testing.assert_array_equal(position[:2], scene.position("anna", 1.0))
        assert velocity[2] < -0.1
    head = visibility(scene, camera(), "anna", 0.0, "head")
    assert (head.in_view, head.occluded) == (1.0, 0.0)


def test_who_faces_a_point_does_so_while_walking():
    facing = world(people=[{**ANNA, "facing": [1, -3], "wander": 0}]).person("anna")
    for time_s in (0.0, 1.0, 1.7):
        x, y = np.array([1.0, -3.0]) - facing.position_at(time_s)
        assert facing.pose_at(time_s).heading == pytest.approx(np.arctan2(y, x), abs=0.03)


@pytest.mark.parametrize("name", ["scene1", "scene2"])
def test_an_object_that_nobody_sees_changes_no_picture(name):
    """So objects leave people's random numbers, their order and every pixel as they were."""
    scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    options = scenario.world.model_dump(mode="json", exclude_none=True)
    unseen = cup(at=(0.0, 4.0, 400.0), wander=0.1)  # far above the ceiling
    with_object = WorldOptions.model_validate({**options, "objects": [unseen]})
    of = Assembly(scenario).cameras["C1"]
    one = Renderer(build_world(scenario.world, 0), of)
    other = Renderer(build_world(with_object, 0), of)
    for frame in (0, 25, 57):
        np.testing.assert_array_equal(one.frame(frame, frame / 10), other.frame(frame, frame / 10))


@pytest.mark.parametrize(
    ("contents", "message"),
    [
        ({"people": [ANNA], "objects": [cup("anna")]}, "2 people or objects are called anna"),
        ({"objects": [cup(attached_to="bob")]}, "cup is attached_to bob, who is neither"),
        ({"objects": [cup(attached_to="cup")]}, "name one of these, once there are any"),
        ({"objects": [cup(bands=[])]}, "at least 1 item"),
        ({"objects": [cup(top_radius=0)]}, "greater than 0"),
        ({"objects": [cup(path=2 * cup()["path"])]}, "order of time"),
    ],
)
def test_objects_that_make_no_sense_are_refused(contents, message):
    with pytest.raises(ValidationError, match=message):
        WorldOptions.model_validate(contents)
