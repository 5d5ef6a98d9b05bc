"""Quantisation against one line of NumPy, OpenCV, and a worked example; gains against gains put in."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from nodes.vision.color import ColorOptions, channel_gain, gain_reference, quantize
from nodes.vision.hue import hue_bins

NO_GAIN = np.ones(3)
seeds = st.integers(0, 2**32 - 1)
bins_per_channel = st.integers(2, 16)


def random_image(seed, height=17, width=23):
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)


@given(seeds, bins_per_channel)
def test_rgb_bins_are_equal_slices_of_each_channel(seed, n):
    image = random_image(seed)
    bins = quantize(image, ColorOptions(bins_per_channel=n), NO_GAIN)
    # red, green, blue, from OpenCV's blue, green, red
    np.testing.assert_array_equal(bins, (image[..., ::-1].astype(int) * n // 256).transpose(2, 0, 1))


@given(seeds, bins_per_channel)
def test_joint_bins_put_the_three_together(seed, n):
    image = random_image(seed)
    options = ColorOptions(space="joint_rgb", bins_per_channel=n)
    blue, green, red = (image.astype(int) * n // 256).transpose(2, 0, 1)
    bins = quantize(image, options, NO_GAIN)
    np.testing.assert_array_equal(bins, [n * n * red + n * green + blue])
    assert bins.max() < options.n_bins == n**3


def test_the_worked_example_of_truong_and_kim():
    red_green_blue = (45, 172, 103)
    image = np.array(red_green_blue[::-1], dtype=np.uint8).reshape(1, 1, 3)
    assert quantize(image, ColorOptions(), NO_GAIN).ravel().tolist() == [1, 5, 3]
    joint = quantize(image, ColorOptions(space="joint_rgb"), NO_GAIN)
    assert joint.item() == 1 * 64 + 5 * 8 + 3


def hue_bin(red, green, blue, n):
    """The rule of `hue_bins`, one pixel at a time, in Python's integers."""
    largest, smallest = max(red, green, blue), min(red, green, blue)
    chroma = largest - smallest
    if chroma < 16 or 1023 * chroma < 128 * largest:
        return n - 1
    if largest == red:
        hue = green - blue
    elif largest == green:
        hue = 2 * chroma + blue - red
    else:
        hue = 4 * chroma + red - green
    return (n - 1) * (hue % (6 * chroma)) // (6 * chroma)


@given(seeds, st.sampled_from([2, 3, 19, 40, 64]))
def test_hue_bins_are_those_of_integer_arithmetic(seed, n):
    image = random_image(seed)
    image[:4] = image[:4] // 9 * 9  # with many ties
    image[4:8] = 128 + image[4:8] // 8  # and many greys
    expected = [[hue_bin(*pixel[::-1], n) for pixel in row] for row in image.tolist()]
    np.testing.assert_array_equal(
        quantize(image, ColorOptions(space="hue", bins_per_channel=n), NO_GAIN)[0], expected
    )


def test_every_quotient_that_a_hue_can_be_has_an_exact_floor():
    # all chromas and hues there are: what pixels with these two numbers get
    chroma = np.repeat(np.arange(16, 256), 256)
    rest = np.minimum(np.tile(np.arange(256), 240), chroma)
    for largest, first in ((2, 1), (1, 0), (0, 2)):  # red to green to blue
        image = np.zeros((len(chroma), 1, 3), np.uint8)
        image[:, 0, largest], image[:, 0, first] = chroma, rest
        hue = {2: rest, 1: 2 * chroma + rest, 0: 4 * chroma + rest}[largest]
        np.testing.assert_array_equal(hue_bins(image, 40)[:, 0], 39 * hue // (6 * chroma) % 39)


@given(seeds)
def test_hue_is_opencvs_within_its_rounding(seed):
    image = random_image(seed)
    bins = quantize(image, ColorOptions(space="hue", bins_per_channel=40), NO_GAIN)[0]
    hue, saturation, value = cv2.split(cv2.cvtColor(image, cv2.COLOR_BGR2HSV).astype(float))
    colored = bins < 39
    # the middle of the bin against the angle, around the circle: half a bin and OpenCV's own degree,
    # a little more by its table of reciprocals
    apart = np.abs((bins + 0.5) * 360 / 39 - 2 * hue)
    assert np.minimum(apart, 360 - apart)[colored].max(initial=0) <= 0.5 * 360 / 39 + 1.2
    assert (saturation[~colored] / 255 * value[~colored]).max(initial=0) < max(16, 255 / 8) + 1


@pytest.mark.parametrize(
    ("red_green_blue", "expected"),
    [
        ((0, 0, 0), 39),
        ((255, 255, 255), 39),
        ((140, 126, 130), 39),  # too little colour to tell
        ((255, 235, 235), 39),  # too pale
        ((255, 0, 0), 0),
        ((0, 255, 0), 13),
        ((0, 0, 255), 26),
        ((255, 0, 1), 38),  # the last sector, next to red
        ((205, 160, 130), 2),  # a face: 24 degrees
    ],
)
def test_the_hue_of_some_colours(red_green_blue, expected):
    image = np.array(red_green_blue[::-1], dtype=np.uint8).reshape(1, 1, 3)
    assert hue_bins(image, 40).item() == expected


def test_hue_is_taken_without_the_gain():
    image = np.array([[[100, 150, 200]]], np.uint8)
    brighter = np.array([[[50, 150, 240]]], np.uint8)
    options = ColorOptions(space="hue", bins_per_channel=40)
    np.testing.assert_array_equal(
        quantize(brighter, options, np.array([0.5, 1.0, 1.2])), quantize(image, options, NO_GAIN)
    )


def test_only_hue_can_have_many_bins():
    assert ColorOptions(space="hue", bins_per_channel=40).n_bins == 40
    with pytest.raises(ValidationError, match="in rgb take at most 16"):
        ColorOptions(bins_per_channel=40)


def test_every_value_has_a_bin_and_the_gain_cannot_leave_the_last():
    image = np.arange(256, dtype=np.uint8)[None, :, None].repeat(3, axis=2)
    darkened = quantize(image, ColorOptions(), np.array([0.3, 1.0, 2.5]))
    red, green, blue = darkened[:, 0].astype(int)
    np.testing.assert_array_equal(red, np.floor(np.arange(256) / 2.5 * 8 / 256))
    np.testing.assert_array_equal(green, np.arange(256) // 32)
    np.testing.assert_array_equal(blue, np.minimum(np.floor(np.arange(256) / 0.3 * 8 / 256), 7))


def test_the_gain_put_into_a_picture_is_found_again():
    rng = np.random.default_rng(0)
    first = rng.integers(40, 120, (240, 320, 3), dtype=np.uint8)
    gain = np.array([0.7, 1.2, 1.8])
    later = np.clip(np.rint(first * gain), 0, 255).astype(np.uint8)
    later[:60] = rng.integers(0, 256, (60, 320, 3))  # somebody passes by
    found = channel_gain(later, gain_reference(first))
    np.testing.assert_allclose(found, gain, rtol=0.03)
    # what the gain did to the bins is undone, but for colours next to a border
    bins, corrected = (quantize(image, ColorOptions(), g) for image, g in ((first, NO_GAIN), (later, found)))
    assert np.mean(bins[:, 60:] == corrected[:, 60:]) > 0.9
    assert np.mean(bins[:, 60:] == quantize(later, ColorOptions(), NO_GAIN)[:, 60:]) < 0.7


@pytest.mark.parametrize("level", [0, 255])
def test_a_picture_without_well_exposed_pixels_has_no_gain(level):
    first = random_image(0, 240, 320)
    found = channel_gain(np.full_like(first, level), gain_reference(first))
    np.testing.assert_array_equal(found, NO_GAIN)


def test_a_reference_does_not_change_with_the_picture_that_it_came_from():
    first = np.full((240, 320, 3), 100, np.uint8)
    reference = gain_reference(first)
    first[:] = 50
    np.testing.assert_allclose(channel_gain(first, reference), 51 / 101)


@pytest.mark.parametrize(
    "options",
    [
        {"parts": (0.5, 0.5)},
        {"parts": (0.5, 0.4), "part_weights": (0.5, 0.5)},
        {"parts": (0.5, 0.5), "part_weights": (1.5, -0.5)},
        {"parts": (), "part_weights": ()},
    ],
)
def test_parts_and_weights_must_fit(options):
    with pytest.raises(ValidationError, match=r"part_weights|add up to 1"):
        ColorOptions(**options)
