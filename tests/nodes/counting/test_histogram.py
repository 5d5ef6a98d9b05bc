"""Counts against OpenCV's histograms and against a loop over the samples; the kernel against quadrature."""

from itertools import pairwise

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from nodes.counting.codebook import codebook
from nodes.counting.grid import sample_positions
from nodes.counting.histogram import SamplingOptions, count, locate

HEIGHT, WIDTH = 30, 40
PARTS = (0.2, 0.5, 0.3)
EVERY_PIXEL = SamplingOptions(grid=None)
# inside, over each border, empty (left of the picture), one pixel, the whole picture, around it, nowhere
BOXES = np.array(
    [
        [5.2, 4.7, 20.1, 25.4],
        [-6.3, -3.9, 8.2, 12.0],
        [30.4, 20.1, 55.0, 47.3],
        [-20.0, 3.0, -5.0, 12.0],
        [7.0, 9.0, 8.0, 10.0],
        [0.0, 0.0, WIDTH, HEIGHT],
        [-100.0, -50.0, 100.0, 80.0],
        [np.nan, np.nan, np.nan, np.nan],
    ]
)


def random_bins(rng, n_channels, n_bins):
    return rng.integers(0, n_bins, (n_channels, HEIGHT, WIDTH), dtype=np.uint8)


def full_book(n_channels, n_bins, parts):
    return codebook(np.ones((len(parts), n_channels, n_bins), bool), parts)


def by_opencv(bins, box, part_top, part_bottom, n_bins):
    """The histogram of the pixels whose centres lie in a part of a box; OpenCV 5 gives it one axis."""
    left, top, right, bottom = box
    high, low = top + part_top * (bottom - top), top + part_bottom * (bottom - top)
    rows, columns = (np.arange(n) + 0.5 for n in bins.shape)
    inside = np.outer((rows > high) & (rows <= low), (columns > left) & (columns <= right))
    mask = inside.astype(np.uint8)
    return cv2.calcHist([bins], [0], mask, [n_bins], [0, n_bins]).reshape(-1), np.count_nonzero(mask)


@pytest.mark.parametrize(("n_channels", "n_bins"), [(1, 64), (3, 8), (3, 2)])
@pytest.mark.parametrize("parts", [(1.0,), PARTS])
def test_counting_every_pixel_agrees_with_opencv_count_by_count(n_channels, n_bins, parts):
    bins = random_bins(np.random.default_rng(0), n_channels, n_bins)
    counts, pixels = count(bins, BOXES, full_book(n_channels, n_bins, parts), EVERY_PIXEL)
    counts = counts.reshape(len(BOXES), len(parts), n_channels, n_bins)
    edges = [0, *np.cumsum(parts)]
    for box, of_box, in_box in zip(BOXES, counts, pixels, strict=True):
        for part, (top, bottom) in enumerate(pairwise(edges)):
            for channel in range(n_channels):
                histogram, n_pixels = by_opencv(bins[channel], box, top, bottom, n_bins)
                np.testing.assert_array_equal(of_box[part, channel], histogram)
                assert in_box[part] == n_pixels


@pytest.mark.parametrize(("n_channels", "n_bins"), [(1, 8), (1, 200), (1, 300), (3, 8)])
@pytest.mark.parametrize("parts", [(1.0,), (0.9, 0.1)])
def test_rare_colours_and_rows_that_all_boxes_hold_are_counted_like_any(n_channels, n_bins, parts):
    rng = np.random.default_rng(4)
    # a few colours have nearly all pixels, many have some, and some have none
    shares = rng.dirichlet(np.full(n_bins, 0.1))
    bins = rng.choice(n_bins, (n_channels, 300, 40), p=shares).astype(np.min_scalar_type(n_bins))
    low, high = rng.uniform([-5, -5], [20, 12], (80, 2)), rng.uniform([20, 285], [45, 305], (80, 2))
    boxes, edges = np.hstack([low, high]), [0, *np.cumsum(parts)]
    counts, pixels = count(bins, boxes, full_book(n_channels, n_bins, parts), EVERY_PIXEL)
    counts = counts.reshape(len(boxes), len(parts), n_channels, n_bins)
    for box, of_box, in_box in zip(boxes, counts, pixels, strict=True):
        for part, (top, bottom) in enumerate(pairwise(edges)):
            for channel in range(n_channels):
                histogram, n_pixels = by_opencv(bins[channel], box, top, bottom, n_bins)
                np.testing.assert_array_equal(of_box[part, channel], histogram)
                assert in_box[part] == n_pixels


@pytest.mark.parametrize("size", [(15, 17), (16, 16)])  # 255 pixels, and one more than a byte holds
@pytest.mark.parametrize("n_codes", [8, 9])
def test_the_smallest_boxes_are_counted_like_any(size, n_codes):
    rng = np.random.default_rng(5)
    # halves of one colour each, so that boxes hold nothing else, and noise between them
    bins = np.repeat([0, n_codes - 1], 100)[None, None].repeat(60, axis=1).astype(np.uint8)
    bins[:, :, 90:110] = rng.integers(0, n_codes, (60, 20))
    left_top = rng.uniform([0, 0], [200, 60] - np.array(size), (50, 2))
    boxes = np.hstack([left_top, left_top + size])
    counts, pixels = count(bins, boxes, full_book(1, n_codes, (1.0,)), EVERY_PIXEL)
    np.testing.assert_array_equal(pixels, size[0] * size[1])
    for box, of_box in zip(boxes, counts, strict=True):
        np.testing.assert_array_equal(of_box, by_opencv(bins[0], box, 0.0, 1.0, n_codes)[0])


def by_loop(bins, box, book, sampling):
    """One sample after the other."""
    counts, pixels = np.zeros(len(book.part), int), np.zeros(len(book.part_heights), int)
    if np.isnan(box).any():
        return counts, pixels
    left, top, right, bottom = box
    for v in sample_positions(sampling.grid[1], sampling.kernel, 0.5):
        part = max(p for p in range(len(book.part_heights)) if book.part_edges[p] <= v)
        for u in sample_positions(sampling.grid[0], sampling.kernel, 1.0):
            x, y = int(np.floor(left + u * (right - left))), int(np.floor(top + v * (bottom - top)))
            if 0 <= x < WIDTH and 0 <= y < HEIGHT:
                pixels[part] += 1
                for channel in range(len(bins)):
                    code = book.codes[part, channel, bins[channel, y, x]]
                    if code < len(book.part):
                        counts[code] += 1
    return counts, pixels


@pytest.mark.parametrize("kernel", ["uniform", "epanechnikov"])
# the first tells apart too many colours for comparing the samples with each, the others few enough
@pytest.mark.parametrize(("n_channels", "n_bins", "parts"), [(1, 64, PARTS), (3, 8, (1.0,)), (3, 4, PARTS)])
def test_a_grid_of_samples_agrees_with_a_loop(kernel, n_channels, n_bins, parts):
    rng = np.random.default_rng(1)
    bins = random_bins(rng, n_channels, n_bins)
    sampling = SamplingOptions(grid=(7, 11), kernel=kernel)
    # some colours are told apart, the others are not
    book = codebook(rng.random((len(parts), n_channels, n_bins)) < 0.6, parts)
    counts, pixels = count(bins, BOXES, book, sampling)
    for box, of_box, in_box in zip(BOXES, counts, pixels, strict=True):
        expected_counts, expected_pixels = by_loop(bins, box, book, sampling)
        np.testing.assert_array_equal(of_box, expected_counts)
        np.testing.assert_array_equal(in_box, expected_pixels)


@given(st.integers(0, 2**32 - 1), st.integers(0, 10), st.integers(0, 10), st.booleans())
def test_counts_do_not_depend_on_the_region_that_was_cut_out(seed, left, top, every_pixel):
    rng = np.random.default_rng(seed)
    bins, book = random_bins(rng, 3, 8), full_book(3, 8, (0.5, 0.5))
    low = rng.integers(2 * 10, 2 * 15, (5, 2)) / 2  # halves: where rounding has a choice
    boxes = np.hstack([low, low + rng.integers(1, 20, (5, 2)) / 2])
    sampling = EVERY_PIXEL if every_pixel else SamplingOptions(grid=(5, 5))
    whole = count(bins, boxes, book, sampling)
    region = count(bins[:, top:, left:], boxes - [left, top, left, top], book, sampling)
    np.testing.assert_array_equal(whole[0], region[0])
    np.testing.assert_array_equal(whole[1], region[1])


@pytest.mark.parametrize("every_pixel", [False, True])
@pytest.mark.parametrize("n_bins", [0, 8])
def test_no_boxes_and_no_colours_are_counted_like_any(n_bins, every_pixel):
    used = np.zeros((1, 3, 8), bool)
    used[..., :n_bins] = True
    bins = random_bins(np.random.default_rng(0), 3, 8)
    sampling = EVERY_PIXEL if every_pixel else SamplingOptions(grid=(3, 3))
    counts, pixels = count(bins, BOXES[:0], codebook(used, (1.0,)), sampling)
    assert (counts.shape, pixels.shape) == ((0, 3 * n_bins), (0, 1))


def test_a_codebook_numbers_the_used_bins_in_order():
    used = np.array([[[True, False, True]], [[False, False, True]]])
    book = codebook(used, (0.4, 0.6))
    assert book.codes.tolist() == [[[0, 3, 1]], [[3, 3, 2]]]
    assert book.part.tolist() == [0, 0, 1]
    np.testing.assert_allclose(book.part_edges, [0, 0.4, 1])


@pytest.mark.parametrize("n", [1, 2, 15, 40])
@pytest.mark.parametrize("curvature", [0.5, 1.0])
def test_samples_are_the_quantiles_of_the_kernel(n, curvature):
    def below(u):
        return quad(lambda t: 1 - curvature * t * t, -1, u)[0]

    positions = sample_positions(n, "epanechnikov", curvature)
    quantiles = [below(2 * position - 1) / below(1) for position in positions]
    np.testing.assert_allclose(quantiles, (np.arange(n) + 0.5) / n, atol=1e-6)
    np.testing.assert_allclose(positions, 1 - positions[::-1], atol=1e-9)


def test_the_uniform_kernel_takes_the_middles_of_equal_cells():
    np.testing.assert_allclose(sample_positions(4, "uniform", 1.0), [1 / 8, 3 / 8, 5 / 8, 7 / 8])


def test_the_region_covers_the_pixels_that_count_and_no_more():
    boxes, book = np.array([[10.2, 20.7, 30.1, 40.0], [25.0, 5.5, 50.5, 30.2]]), full_book(1, 2, (1.0,))
    assert locate(boxes, (160, 120), book, EVERY_PIXEL).region == (10, 6, 51, 40)
    assert locate(boxes - 22.0, (160, 120), book, EVERY_PIXEL).region == (0, 0, 29, 18)
    assert locate(boxes[:0], (160, 120), book, EVERY_PIXEL).region == (159, 119, 160, 120)
    corners = SamplingOptions(grid=(2, 2))  # at a quarter and three quarters of a box
    assert locate(boxes, (160, 120), book, corners).region == (15, 11, 45, 36)
    assert locate(boxes - 22.0, (160, 120), book, corners).region == (0, 0, 23, 14)
