"""Quantisation against one line of NumPy, OpenCV, and a worked example; gains against gains put in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from nodes.filtering.color import ColorOptions, channel_gain, gain_reference, quantize

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
