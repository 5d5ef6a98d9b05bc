"""One camera and pictures painted by hand: a rectangle of the target's colours on another background."""

from dataclasses import replace

import numpy as np
import pytest

from nodes.counting.histogram import SamplingOptions
from nodes.imaging.camera import look_at
from nodes.vision.appearance import ModelUpdateOptions
from nodes.vision.color import ColorOptions
from nodes.vision.likelihood import LikelihoodOptions
from nodes.vision.observation import (
    GOOD_SIGHTS,
    ObservationModel,
    ObservationOptions,
    surrounding_boxes,
)
from nodes.vision.target import TargetOptions, project_boxes

TARGET = TargetOptions(height=1.7, width=0.5)
CAMERA = look_at("C1", np.array([0.0, -6.0, 2.5]), np.array([0.0, 0.0, 1.0]), 110.0, (160, 120), np.zeros(5))
HERE, THERE, OUTSIDE = np.array([0.0, 0.0]), np.array([1.0, 1.0]), np.array([30.0, 0.0])
OPTIONS = {
    "joint": ObservationOptions(color=ColorOptions(space="joint_rgb", bins_per_channel=4)),
    "every pixel": ObservationOptions(sampling=SamplingOptions(grid=None)),
    "parts": ObservationOptions(color=ColorOptions(parts=(0.5, 0.5), part_weights=(0.5, 0.5))),
}


def paint(position, color=(30, 40, 200), seed=0):
    """A picture with the target at a position, if there is one."""
    rng = np.random.default_rng(seed)
    image = rng.integers(90, 160, (120, 160, 3), dtype=np.uint8)
    if position is not None:
        left, top, right, bottom = np.rint(project_boxes(position[None], TARGET, CAMERA)[0]).astype(int)
        image[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)] = color
    return image


def ready(options, **changes):
    model = ObservationModel(CAMERA, TARGET, options.model_copy(update=changes)).with_first(paint(HERE))
    return model, model.first_appearance(model.look(paint(HERE)), HERE)


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
def test_the_likelihood_is_highest_where_the_target_is(options):
    model, appearance = ready(options)
    places = THERE + np.array([[0.0, 0.0], [0.3, 0.0], [-0.3, 0.0], [0.6, 0.0], [-1.0, -1.0]])
    values = model.log_likelihoods(model.look(paint(THERE, seed=1)), places, appearance)
    assert values.argmax() == 0
    floor = -appearance.miss_distance / (2 * appearance.variance)
    assert values[0] > floor / 2  # not 0: some samples lie on the target's edge
    assert values[3:] == pytest.approx(floor, abs=0.1)


def test_taken_literally_it_has_no_floor_and_does_not_look_where_the_picture_ends():
    model, appearance = ready(ObservationOptions(likelihood=LikelihoodOptions(form="literal")))
    values = model.log_likelihoods(model.look(paint(HERE)), np.stack([HERE, OUTSIDE]), appearance)
    assert values == pytest.approx([0, -1 / (2 * appearance.variance)])


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
def test_many_boxes_at_once_are_each_box_alone(options):
    model, appearance = ready(options)
    picture = model.look(paint(THERE, seed=1))
    places = np.random.default_rng(0).uniform(-4, 4, (40, 2))
    together = model.log_likelihoods(picture, places, appearance)
    alone = [model.log_likelihoods(picture, place[None], appearance)[0] for place in places]
    np.testing.assert_array_equal(together, alone)


def sees(model, picture, position, appearance):
    return model.sees(model.sight(picture, position, appearance), appearance)


def updated(model, picture, position, appearance):
    return model.updated(picture, position, model.sight(picture, position, appearance), appearance)


def test_a_camera_that_cannot_see_has_nothing_to_say_to_the_last_bit():
    model, appearance = ready(OPTIONS["joint"])
    picture = model.look(paint(None))
    outside = OUTSIDE + np.random.default_rng(0).uniform(-5, 5, (20, 2))
    for values in (
        model.log_likelihoods(picture, outside, appearance),
        model.log_likelihoods(picture, np.stack([HERE, THERE]), None),
    ):
        assert np.all(values == values[0])
    assert not sees(model, picture, OUTSIDE, appearance)


def test_it_sees_the_target_where_it_is_and_nowhere_else():
    model, appearance = ready(OPTIONS["joint"])
    assert sees(model, model.look(paint(THERE)), THERE, appearance)
    assert not sees(model, model.look(paint(THERE)), HERE, appearance)
    assert not sees(model, model.look(paint(None)), THERE, appearance)


def test_no_reference_is_taken_of_a_target_at_the_border():
    model, _ = ready(OPTIONS["joint"])
    assert model.first_appearance(model.look(paint(HERE)), OUTSIDE) is None


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
def test_a_target_that_fills_the_picture_has_a_reference_too(options):
    target = TargetOptions(space="image", size_px=(150.0, 115.0))
    model = ObservationModel(CAMERA, target, options)
    found = model.first_appearance(model.look(paint(None)), np.array([79.5, 59.5]))
    # nothing is seen of what surrounds it: the fixed constants serve
    assert found.miss_distance == options.likelihood.miss_distance
    assert found.variance == options.likelihood.sigma**2


def test_a_uniform_scene_has_a_likelihood_too():
    model, _ = ready(OPTIONS["joint"])
    picture = model.look(np.full((120, 160, 3), 77, np.uint8))
    appearance = model.first_appearance(picture, HERE)
    assert np.isfinite(model.log_likelihoods(picture, np.stack([HERE, THERE]), appearance)).all()


def test_a_camera_takes_its_own_reference_after_a_few_good_sights():
    model, appearance = ready(OPTIONS["joint"])
    told = model.first_appearance(model.look(paint(THERE)), THERE)
    told = replace(told, own=False, doubted=True)
    hidden, seen = model.look(paint(None)), model.look(paint(HERE))
    for good in range(GOOD_SIGHTS):
        assert updated(model, hidden, HERE, told) is told
        assert told.good_sights == good
        assert told.doubted
        assert not told.own
        told = updated(model, seen, HERE, told)
    assert told.own
    assert not told.doubted
    np.testing.assert_array_equal(told.histograms, appearance.histograms)


def test_the_reference_follows_slowly_changing_looks_only_if_asked_to():
    still, _ = ready(OPTIONS["joint"])
    model, appearance = ready(OPTIONS["joint"], model_update=ModelUpdateOptions(alpha=0.2, anchor=0.0))
    image = paint(HERE)
    image[70:, 80:] = (30, 200, 40)
    assert updated(still, still.look(image), HERE, appearance) is appearance
    sight = model.sight(model.look(image), HERE, appearance)
    assert 0 < sight.squared_distance < 0.7 * appearance.miss_distance
    after = updated(model, model.look(image), HERE, appearance)
    np.testing.assert_allclose(after.histograms, 0.8 * appearance.histograms + 0.2 * sight.histograms)


def test_gain_correction_brings_the_colours_back():
    color = ColorOptions(space="joint_rgb", bins_per_channel=6, gain_correction=True)
    model, appearance = ready(ObservationOptions(color=color))
    brighter = np.clip(paint(HERE) * np.array([1.2, 1.2, 1.2]), 0, 255).astype(np.uint8)
    corrected = model.sight(model.look(brighter), HERE, appearance)
    plain, as_it_was = ready(ObservationOptions(color=color.model_copy(update={"gain_correction": False})))
    uncorrected = plain.sight(plain.look(brighter), HERE, as_it_was)
    assert corrected.squared_distance < 0.05 < uncorrected.squared_distance


def test_surrounding_boxes_have_the_size_of_the_target_and_keep_off_its_middle():
    box = np.array([70.0, 40.0, 90.0, 110.0])
    around = surrounding_boxes(box)
    np.testing.assert_allclose(around[:, 2:] - around[:, :2], np.tile([20, 70], (len(around), 1)))
    off = (around[:, :2] + around[:, 2:]) / 2 - [80, 75]
    assert np.abs(off / 20 / [1, 0.5]).max(axis=1).min() > 1


def test_a_reference_taken_beside_the_target_finds_its_middle_by_its_own_colours():
    beside, shifts = HERE + np.array([0.12, 0.0]), np.linspace(-0.3, 0.3, 61)
    places = HERE + np.stack([shifts, np.zeros(61)], axis=1)
    best = {}
    for weighted in (False, True):
        color = ColorOptions(space="joint_rgb", bins_per_channel=6, background_weighting=weighted)
        model, _ = ready(ObservationOptions(color=color))
        picture = model.look(paint(HERE))
        boxes = project_boxes(places, TARGET, CAMERA)
        distance = model.box_distances(picture, boxes, model.first_appearance(picture, beside))
        best[weighted] = abs(shifts[distance <= distance.min() + 1e-3].mean())
    assert best[True] < 0.5 * best[False]
