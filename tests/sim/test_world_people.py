import numpy as np
import pytest
from pydantic import ValidationError

from sim.world.people import PersonOptions, build_person
from sim.world.world import WorldOptions, build_world

ANNA = {
    "name": "anna",
    "path": [
        {"time_s": 0, "position": [0, 0]},
        {"time_s": 2, "position": [3, 0]},
        {"time_s": 4, "position": [3, 0]},
        {"time_s": 6, "position": [3, 3]},
    ],
}


def anna(seed=0, **changes):
    return build_person(PersonOptions.model_validate({**ANNA, **changes}), seed)


def test_a_person_passes_the_waypoints_and_stands_still_after_the_last():
    person = anna()
    for waypoint in ANNA["path"]:
        time_s = float(waypoint["time_s"])
        np.testing.assert_allclose(person.position_at(time_s), waypoint["position"], atol=1e-12)
    np.testing.assert_allclose(person.position_at(60.0), [3, 3])
    np.testing.assert_array_equal(person.velocity_at(60.0), [0, 0])


def test_velocity_is_the_derivative_of_position_and_continuous():
    person = anna(wander=0.1)
    for time_s in np.linspace(0.1, 5.9, 30).tolist():
        numeric = (person.position_at(time_s + 1e-4) - person.position_at(time_s - 1e-4)) / 2e-4
        np.testing.assert_allclose(person.velocity_at(time_s), numeric, atol=1e-3)
    np.testing.assert_allclose(person.velocity_at(2 - 1e-9), person.velocity_at(2 + 1e-9), atol=1e-6)


def test_seeds_differ_in_the_wandering_only():
    plain, first, second = anna(), anna(0, wander=0.1), anna(1, wander=0.1)
    assert not np.allclose(first.position_at(1.0), second.position_at(1.0))
    assert np.linalg.norm(first.position_at(1.0) - plain.position_at(1.0)) < 0.6
    np.testing.assert_array_equal(first.position_at(1.0), anna(0, wander=0.1).position_at(1.0))


def test_people_face_where_they_walk_and_keep_facing_there_when_they_stop():
    person = anna()
    assert person.pose_at(1.0).heading == pytest.approx(0.0, abs=1e-6)
    assert person.pose_at(3.0).heading == pytest.approx(0.0, abs=1e-6)
    assert person.pose_at(3.0).effort == 0.0
    assert person.pose_at(5.0).heading == pytest.approx(np.pi / 2, abs=1e-6)


def test_a_stride_is_four_fifths_of_the_stature():
    person = anna(height=1.5)
    walked = (person.pose_at(2.0).phase - person.pose_at(0.0).phase) / (2 * np.pi)
    assert walked == pytest.approx(3.0 / (0.8 * 1.5), rel=1e-3)


def test_crouching_changes_the_height_and_not_the_stature():
    person = anna(height=[{"time_s": 1, "height": 1.75}, {"time_s": 1.6, "height": 1.05}])
    assert person.height_at(0.0) == 1.75
    assert 1.05 < person.height_at(1.3) < 1.75
    assert person.height_at(3.0) == pytest.approx(1.05)
    assert person.pose_at(3.0).stature == 1.75


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"path": []}, "at least 1 item"),
        ({"path": list(reversed(ANNA["path"]))}, "order of time"),
        ({"upper": "blue"}, "pattern"),
        ({"height": 17.5}, "less than 3"),
        ({"speed": 3}, "not permitted"),
    ],
)
def test_options_that_make_no_sense_are_refused(changes, message):
    with pytest.raises(ValidationError, match=message):
        PersonOptions.model_validate({**ANNA, **changes})


def test_a_world_knows_its_people_by_name():
    world = build_world(WorldOptions.model_validate({"people": [ANNA]}), 0)
    np.testing.assert_allclose(world.position("anna", 2.0), [3, 0])
    np.testing.assert_allclose(world.velocity("anna", 3.0), [0, 0], atol=1e-12)
    assert world.height("anna", 0.0) == 1.75
    with pytest.raises(ValueError, match="called bob: there is anna"):
        world.person("bob")
    with pytest.raises(ValidationError, match="2 people or objects are called anna"):
        WorldOptions.model_validate({"people": [ANNA, ANNA]})
