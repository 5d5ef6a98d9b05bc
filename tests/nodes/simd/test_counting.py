"""Algorithms 1 and 2 against NumPy and OpenCV, count by count, and against each other."""

import cv2
import numpy as np
import pytest

from nodes.simd.array import ProcessorArray
from nodes.simd.memory import ExternalMemory
from nodes.simd.options import SimdOptions
from nodes.simd.programs.counting import count_in_columns, count_side_by_side, particles_in_columns, region

HEIGHT, WIDTH, N_BINS, N = 60, 80, 12, 30
BOTH_WAYS = pytest.mark.parametrize("batching", [True, False])


@pytest.fixture
def memory():
    stored = ExternalMemory(HEIGHT, WIDTH)
    stored.pixels[:] = np.random.default_rng(0).integers(0, N_BINS, (HEIGHT, WIDTH))
    return stored


@pytest.fixture
def corners():
    rng = np.random.default_rng(1)
    return np.stack([rng.integers(0, WIDTH - 7, N), rng.integers(0, HEIGHT - 5, N)], axis=1)


def in_columns(memory, corners, counted, *, batching=True, n_words=N_BINS, first_bin=0):
    """Algorithm 2 with the particles in the rightmost elements."""
    array = ProcessorArray(SimdOptions(processing_elements=48), batching=batching)
    active = slice(array.n - len(corners), array.n)
    center, sampling = (array.word(), array.word()), (array.word(), array.word(), array.word())
    for word, line, size in zip(center, corners.T, counted.size_px, strict=True):
        padded = np.zeros(array.n, int)
        padded[active] = 4 * (line + size // 2) + 3  # a fraction of a pixel does not matter
        array.input(word, padded)
    histogram = [array.word() for _ in range(n_words)]
    with array.step("count") as cost:
        count_in_columns(array, histogram, memory, center, 2, sampling, counted, active, first_bin=first_bin)
    return np.stack([word.value[active] for word in histogram], axis=1), cost


def side_by_side(memory, corners, size_px, *, batching=True):
    array = ProcessorArray(SimdOptions(processing_elements=48), batching=batching)
    histogram = [array.word() for _ in range(N_BINS)]
    sampling = (array.word(), array.word(), array.word())
    with array.step("count") as cost:
        return count_side_by_side(array, histogram, memory, corners, size_px, sampling), cost


def by_numpy(memory, corners, counted):
    return np.stack(
        [
            np.bincount(
                memory.pixels[y + counted.rows, x + counted.columns],
                weights=counted.weights,
                minlength=N_BINS,
            )
            for x, y in corners
        ]
    )


@BOTH_WAYS
@pytest.mark.parametrize("shape", ["rectangle", "ellipse"])
@pytest.mark.parametrize("kernel", ["uniform", "epanechnikov"])
def test_one_element_a_particle_counts_as_numpy_does(memory, corners, shape, kernel, batching):
    counted = region(7, 5, shape, kernel)
    counts, _ = in_columns(memory, corners, counted, batching=batching)
    np.testing.assert_array_equal(counts, by_numpy(memory, corners, counted))
    assert (counts.sum(axis=1) == counted.total).all()


@BOTH_WAYS
def test_regions_side_by_side_count_as_opencv_does(memory, corners, batching):
    # 30 regions of 7 columns do not fit side by side into 48 elements: five passes
    counts, _ = side_by_side(memory, corners, (7, 5), batching=batching)
    for (x, y), histogram in zip(corners, counts, strict=True):
        patch = memory.pixels[y : y + 5, x : x + 7].astype(np.uint8)
        expected = cv2.calcHist([patch], [0], None, [N_BINS], [0, N_BINS]).ravel()
        np.testing.assert_array_equal(histogram, expected)


@pytest.mark.parametrize("algorithm", ["columns", "side by side"])
def test_all_at_once_costs_what_one_by_one_costs(memory, corners, algorithm):
    def cost(batching):
        if algorithm == "columns":
            return in_columns(memory, corners, region(7, 5), batching=batching)[1]
        return side_by_side(memory, corners, (7, 5), batching=batching)[1]

    assert cost(batching=True) == cost(batching=False)


def test_both_algorithms_give_the_same_histograms(memory, corners):
    counts, _ = in_columns(memory, corners, region(7, 5))
    np.testing.assert_array_equal(counts, side_by_side(memory, corners, (7, 5))[0])


def test_a_part_of_the_histogram_is_that_part(memory, corners):
    whole, _ = in_columns(memory, corners, region(7, 5))
    part, _ = in_columns(memory, corners, region(7, 5), n_words=4, first_bin=5)
    np.testing.assert_array_equal(part, whole[:, 5:9])


def test_every_sample_is_read_once(memory, corners):
    _, cost = in_columns(memory, corners, region(7, 5))
    assert cost.external_reads == N * 7 * 5


def test_the_switch_is_where_the_paper_has_it():
    # M > n_x r_y / (r_x + r_y) = 320 · 15 / 30
    assert not particles_in_columns(160, 320, (15, 15))
    assert particles_in_columns(161, 320, (15, 15))
    assert particles_in_columns(240, 320, (15, 15))  # the paper's


def test_an_ellipse_has_the_area_of_one():
    assert region(31, 21, "ellipse").total == pytest.approx(np.pi / 4 * 31 * 21, rel=0.02)


def test_the_kernel_falls_from_the_middle_to_the_border():
    counted = region(15, 15, kernel="epanechnikov")
    weights = counted.weights.reshape(15, 15)
    assert weights[7, 7] == 4
    assert weights[0, 0] == 1
    assert (np.diff(weights[7, 7:]) <= 0).all()
    np.testing.assert_array_equal(weights, weights[::-1, ::-1])
