import numpy as np
import pytest
from pydantic import ValidationError

from nodes.imaging.camera import look_at
from sim.world.background import lines_of_sight
from sim.world.occluders import OccluderOptions, build_occluder
from sim.world.room import RoomOptions, along_wall, distance_to_wall, inside

BARREL = np.array([-0.25, 0.06, 0.001, -0.002, 0.0])


@pytest.mark.parametrize("distortion", [np.zeros(5), BARREL])
def test_lines_of_sight_lead_back_to_their_pixels(distortion):
    camera = look_at(
        "C1", np.array([-5.0, 1.0, 2.8]), np.array([0.0, 4.0, 0.5]), 200.0, (160, 120), distortion
    )
    rays = lines_of_sight(camera)
    pixels, _ = camera.project(camera.center + 3.0 * rays.reshape(-1, 3).astype(float))
    # two lines of sight for every pixel: their pixels are at -1/4, 1/4, 3/4 ...
    u, v = np.meshgrid((np.arange(320) - 0.5) / 2, (np.arange(240) - 0.5) / 2)
    apart = np.abs(pixels - np.stack([u.ravel(), v.ravel()], axis=1)).reshape(240, 320, 2)
    assert apart[1:-1, 1:-1].max() < 0.01
    # some rows by themselves are the same
    for rows in (range(7), range(50, 51), range(113, 120)):
        assert (lines_of_sight(camera, rows) == rays[2 * rows.start : 2 * rows.stop]).all()


@pytest.mark.parametrize("shape", ["rectangle", "ellipse"])
def test_lines_of_sight_end_on_the_walls(shape):
    room = RoomOptions(shape=shape, center=(1.0, 2.0), size=(12.0, 8.0))
    angles = np.linspace(-np.pi, np.pi, 60)[None]
    start = np.array([3.0, 3.0])
    reach = distance_to_wall(room, start, np.cos(angles), np.sin(angles))
    ends = start + reach[..., None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    center = np.array(room.center)
    assert inside(room, center + 0.999 * (ends - center)).all()
    assert not inside(room, center + 1.001 * (ends - center)).any()


@pytest.mark.parametrize("shape", ["rectangle", "ellipse"])
def test_the_way_along_the_walls_grows_steadily_and_ends_at_the_perimeter(shape):
    room = RoomOptions(shape=shape, size=(12.0, 8.0))
    angles = np.linspace(-np.pi, np.pi, 4001)[None]
    x, y = np.cos(angles), np.sin(angles)
    reach = distance_to_wall(room, np.zeros(2), x, y)
    along = np.sort(along_wall(room, reach * x, reach * y).ravel())
    assert along[0] == pytest.approx(0, abs=0.05)
    assert along[-1] == pytest.approx(room.perimeter, abs=0.05)
    assert np.diff(along).max() < 0.05


def test_an_occluder_hides_what_is_behind_it_and_nothing_before_it():
    panel = build_occluder(OccluderOptions(start=(0, 2), end=(4, 2)))
    viewer = np.array([2.0, -5.0])
    assert panel.may_hide(np.array([2.0, 3.0]), viewer)
    assert panel.may_hide(np.array([3.9, 2.1]), viewer)
    assert not panel.may_hide(np.array([2.0, 1.0]), viewer)
    # nearer than the middle of the panel, and behind it none the less
    assert panel.may_hide(np.array([0.2, 2.2]), np.array([-1.0, -2.0]))


def test_an_occluder_is_a_closed_box_of_its_size():
    box = build_occluder(OccluderOptions(start=(0, 0), end=(2, 0), thickness=0.5, bottom=0.3, top=1.3))
    corners = box.solid.vertices[0, box.solid.faces]
    # the corners run clockwise from outside, so the volume by the divergence theorem is negative
    fan = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    fan += np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 0])
    volume = (corners[:, 0] * fan).sum() / 6
    assert volume == pytest.approx(-2.0 * 0.5 * 1.0)
    assert ((fan / -np.linalg.norm(fan, axis=1, keepdims=True)) - box.solid.normals[0]).max() < 1e-9


def test_occluders_without_a_volume_are_refused():
    with pytest.raises(ValidationError, match="needs some length"):
        OccluderOptions(start=(1, 2), end=(1, 2))
    with pytest.raises(ValidationError, match="not above bottom"):
        OccluderOptions(start=(0, 0), end=(1, 0), bottom=2.0, top=1.0)
