"""Cameras by a layout: where they hang, and what is said of a wrong one."""

import numpy as np
import pytest

from sim.assembly import Assembly
from sim.scenario.cameras import CameraLayout
from sim.scenario.document import dump
from sim.scenario.loading import load_scenario
from sim.scenario.parsing import ScenarioError

LAYOUT = "{layout: grid, count: 6, spacing_m: 2.0, focal_px: 120, size_px: [160, 120]}"


def layout(**options):
    return CameraLayout(
        **{"layout": "grid", "count": 6, "spacing_m": 2.0, "focal_px": 120, "size_px": (160, 120)} | options
    )


def test_a_grid_is_regular_around_its_center():
    positions = layout(count=7, center=(1.0, 2.0)).positions(0)
    apart = np.linalg.norm(positions[:, None] - positions, axis=2)
    np.testing.assert_allclose(np.sort(apart + 9 * np.eye(7), axis=1)[:, 0], 2.0)
    np.testing.assert_allclose(positions.min(axis=0) + positions.max(axis=0), [2.0, 4.0, 2 * 2.9])


def test_at_random_one_more_moves_none_of_the_others_within_the_square():
    few, more = (layout(layout="random", count=n).positions(3) for n in (50, 60))
    np.testing.assert_allclose(few[:, :2] / np.sqrt(50), more[:50, :2] / np.sqrt(60))
    assert np.abs(more[:, :2]).max() <= np.sqrt(60)
    assert not np.array_equal(more, layout(layout="random", count=60).positions(4))


def test_cameras_look_ahead_in_all_directions():
    each = layout(count=100)
    positions = each.positions(0)
    ahead = each.aims(positions)[:, :2] - positions[:, :2]
    np.testing.assert_allclose(np.linalg.norm(ahead, axis=1), 5.0)
    headings = np.sort(np.arctan2(ahead[:, 1], ahead[:, 0]))
    assert np.diff(headings).max() < 2 * 2 * np.pi / 100


def test_a_scenario_with_a_layout_is_one_with_a_list(small, tmp_path):
    chosen = load_scenario(small, [("cameras", LAYOUT)])
    assert [camera.name for camera in chosen.cameras] == ["C1", "C2", "C3", "C4", "C5", "C6"]
    # what is recorded of it reads the same again
    dump(chosen, tmp_path / "again.yaml")
    again = load_scenario(tmp_path / "again.yaml")
    assert again == chosen
    positions = layout().positions(chosen.seed)
    for camera, position in zip(Assembly(again).cameras.values(), positions, strict=True):
        np.testing.assert_allclose(camera.center, position, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("cameras.count", "0"), "cameras.count must be greater than or equal to 1"),
        (("cameras.layout", "star"), "cameras.layout must be 'grid' or 'random'"),
        (("cameras.spacing", "1"), "cameras.spacing is not a key here: did you mean spacing_m?"),
        (("cameras.spacing_m", "20"), "is outside the room"),
    ],
)
def test_a_wrong_layout_is_one_sentence(small, change, says):
    with pytest.raises(ScenarioError) as wrong:
        load_scenario(small, [("cameras", LAYOUT), change])
    assert says in str(wrong.value)
    assert "\n" not in str(wrong.value)
