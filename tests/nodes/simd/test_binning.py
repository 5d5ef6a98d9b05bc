"""Bins of colours against Python's own HSV and the node's own quantisation."""

import colorsys

import numpy as np
import pytest

from nodes.simd.array import ProcessorArray
from nodes.simd.memory import ExternalMemory
from nodes.simd.options import SimdOptions
from nodes.simd.programs.binning import BinningOptions, bin_picture, channel_bins
from nodes.vision.color import ColorOptions, quantize


def binned(image, options, *, batching=True):
    array = ProcessorArray(SimdOptions(processing_elements=40), batching=batching)
    memory = ExternalMemory(*image.shape[:2])
    buffers = (array.word(), array.word(), array.word())
    with array.step("binning") as cost:
        bin_picture(array, memory, image, buffers, options)
    return memory.pixels, cost


@pytest.fixture
def image():
    picture = np.random.default_rng(0).integers(0, 256, (30, 40, 3), dtype=np.uint8)
    picture[0, :10] = np.arange(10)[:, None]  # grey, and black
    picture[1, :3] = np.eye(3) * 255
    return picture


def test_hues_fall_into_the_bins_of_the_node(image):
    pixels, _ = binned(image, BinningOptions())
    color = ColorOptions(space="hue", bins_per_channel=40)
    np.testing.assert_array_equal(pixels, quantize(image, color, np.ones(3))[0])


def test_the_hue_is_that_of_the_standard_library(image):
    pixels, _ = binned(image, BinningOptions())
    for bin_, (blue, green, red) in zip(pixels.ravel(), image.reshape(-1, 3) / 255, strict=True):
        hue = colorsys.rgb_to_hsv(red, green, blue)[0] * 39
        # on the edge of a bin, floats may fall to either side; the last bin is that of grey
        assert bin_ in {int(hue), 39} or abs(hue - round(hue)) < 1e-9


def test_lines_at_once_are_as_one_by_one(image):
    pixels, cost = binned(image[:4], BinningOptions())
    expected, expected_cost = binned(image[:4], BinningOptions(), batching=False)
    np.testing.assert_array_equal(pixels, expected)
    assert cost == expected_cost
    assert cost.external_writes == 4 * 40


def test_joint_bins_are_those_of_the_node(image):
    pixels, _ = binned(image, BinningOptions(space="joint_rgb", bins=8))
    color = ColorOptions(space="joint_rgb", bins_per_channel=8)
    np.testing.assert_array_equal(pixels, quantize(image, color, np.ones(3))[0])


def test_the_worked_example_of_joint_bins():
    # Truong & Kim: (R, G, B) = (45, 172, 103) is in bin (1, 5, 3)
    image = np.full((1, 1, 3), (103, 172, 45), dtype=np.uint8)
    pixels, _ = binned(image, BinningOptions(space="joint_rgb", bins=8))
    assert pixels[0, 0] == 1 * 64 + 5 * 8 + 3


@pytest.mark.parametrize("n", [2, 6, 8, 16])
def test_channels_with_a_gain_are_those_of_the_node(n):
    array, gain = ProcessorArray(SimdOptions(processing_elements=256)), np.array([0.83, 1.0, 1.31])
    values = np.arange(256, dtype=np.uint8)
    channels = tuple(array.word() for _ in range(3))
    for word in channels:
        array.input(word, values)
    channel_bins(array, channels, n, gain)
    image = np.repeat(values[None, :, None], 3, axis=2)
    expected = quantize(image, ColorOptions(bins_per_channel=n), gain[::-1])
    # the node takes gains in the order of the picture, blue first
    for word, channel in zip(channels, expected, strict=True):
        np.testing.assert_array_equal(word.value, channel[0])


def test_more_bins_than_a_pixel_holds_are_refused():
    with pytest.raises(ValueError, match="512 bins at most"):
        BinningOptions(space="joint_rgb", bins=9)
