"""A network camera's boxes on the array: counts as everywhere else, distances up to the arithmetic."""

import numpy as np
import pytest

from nodes.counting.histogram import SamplingOptions, count
from nodes.simd.likelihood import SimdLikelihood
from nodes.simd.memory import LineMemoryError
from nodes.simd.options import SimdOptions
from nodes.vision.appearance import Appearance
from nodes.vision.color import ColorOptions
from nodes.vision.pattern import pattern_of, squared_distances

HEIGHT, WIDTH = 48, 64
PARTS = {"parts": (0.2, 0.45, 0.35), "part_weights": (0.2, 0.5, 0.3)}
COLOURS = {
    "channels": ColorOptions(),
    "channels, too many for one element": ColorOptions(bins_per_channel=16),
    "joint": ColorOptions(space="joint_rgb", bins_per_channel=6),
    "channels of parts": ColorOptions(bins_per_channel=4, **PARTS),
    "joint of parts": ColorOptions(space="joint_rgb", bins_per_channel=6, **PARTS),
}
EVERY_COLOUR = pytest.mark.parametrize("color", COLOURS.values(), ids=COLOURS)


def scene(color, seed, n_boxes=60):
    """Bins, a reference that holds some of them, and boxes: over each border, empty, nowhere."""
    rng = np.random.default_rng(seed)
    shape = (color.n_channels, HEIGHT, WIDTH)
    bins = np.minimum(rng.integers(0, color.n_bins, shape), rng.integers(0, color.n_bins, shape))
    q = rng.random((len(color.parts), color.n_channels, color.n_bins))
    q *= rng.random(q.shape) < min(1, 20 / color.n_bins)
    q /= np.maximum(q.sum(axis=2, keepdims=True), 1e-9)
    appearance = Appearance(q, q, rng.random(q.shape) + 0.1, 0.1, 0.01, own=True)
    corner, size = rng.uniform(-15, 60, (n_boxes, 2)), rng.uniform(0, 40, (n_boxes, 2))
    boxes = np.hstack([corner, corner + size])
    boxes[:4] = [[-90, 0, -80, 9], [3, 4, 3, 4], [0, 0, WIDTH, HEIGHT], [np.nan] * 4]
    return bins.astype(np.uint8), boxes, pattern_of(appearance, color)


def measured(color, seed, sampling=None, *, batching=True, **simd):
    bins, boxes, pattern = scene(color, seed)
    sampling = sampling or SamplingOptions(grid=(5, 8))
    options = SimdOptions(**{"processing_elements": 25, **simd})  # sixty boxes: three passes
    processor = SimdLikelihood(options, color, sampling, batching=batching)
    measurement = processor.measure(bins, boxes, pattern, (WIDTH, HEIGHT))
    report = processor.report
    counts, pixels = count(bins, boxes, pattern.book, sampling)
    distance = squared_distances(counts, pixels, pattern)
    return measurement, report, counts, pixels, distance


@EVERY_COLOUR
@pytest.mark.parametrize("kernel", ["uniform", "epanechnikov"])
@pytest.mark.parametrize("seed", [10, 11])
def test_counts_are_those_of_the_node_to_the_last_one(color, kernel, seed):
    sampling = SamplingOptions(grid=(5, 8), kernel=kernel)
    result, _, counts, pixels, distance = measured(color, seed, sampling, arithmetic="float")
    np.testing.assert_array_equal(result.counts, counts)
    np.testing.assert_array_equal(result.pixels, pixels)
    np.testing.assert_allclose(result.squared_distance, distance, atol=1e-12)


@EVERY_COLOUR
@pytest.mark.parametrize(("arithmetic", "bound"), [("fixed10", 0.08), ("fixed20", 2e-4)])
def test_fixed_point_distances_are_near(color, arithmetic, bound):
    result, _, counts, pixels, distance = measured(color, 0, arithmetic=arithmetic)
    np.testing.assert_array_equal(result.counts, counts)
    seen = pixels.sum(axis=1) >= 20  # half of the box: below, a camera has nothing to say
    assert np.abs(result.squared_distance - distance)[seen].max() < bound
    assert (result.squared_distance[pixels.sum(axis=1) == 0] == 1).all()


@pytest.mark.parametrize("grid", [(16, 16), (20, 20), (31, 33)])
@pytest.mark.parametrize(("arithmetic", "bound"), [("float", 1e-12), ("fixed10", 0.06), ("fixed20", 1e-3)])
def test_many_samples_are_as_near_as_few(grid, arithmetic, bound):
    sampling = SamplingOptions(grid=grid)
    result, _, counts, pixels, distance = measured(ColorOptions(), 4, sampling, arithmetic=arithmetic)
    np.testing.assert_array_equal(result.counts, counts)
    seen = pixels.sum(axis=1) >= 0.5 * grid[0] * grid[1]
    assert np.abs(result.squared_distance - distance)[seen].max() < bound


@EVERY_COLOUR
def test_fewer_words_read_the_samples_more_often(color):
    many, report, *_ = measured(color, 1, words=120)
    few, small, *_ = measured(color, 1, words=30)
    np.testing.assert_array_equal(few.squared_distance, many.squared_distance)
    np.testing.assert_array_equal(few.counts, many.counts)
    assert small.n_words <= 30
    reads = [sum(cost.external_reads for cost in each.costs.values()) for each in (report, small)]
    assert reads[0] <= reads[1]


@EVERY_COLOUR
@pytest.mark.parametrize(("arithmetic", "least"), [("fixed10", 21), ("fixed20", 28)])
def test_as_many_words_as_one_colour_takes_are_enough(color, arithmetic, least):
    enough, *_ = measured(color, 1, words=least, arithmetic=arithmetic)
    many, *_ = measured(color, 1, words=120, arithmetic=arithmetic)
    np.testing.assert_array_equal(enough.squared_distance, many.squared_distance)
    with pytest.raises(LineMemoryError, match=r"give it more \(simd.words\)"):
        SimdLikelihood(SimdOptions(words=least - 1, arithmetic=arithmetic), color, SamplingOptions())


def test_all_at_once_is_as_one_by_one():
    color = COLOURS["channels of parts"]
    result, report, *_ = measured(color, 2)
    expected, expected_report, *_ = measured(color, 2, batching=False)
    np.testing.assert_array_equal(result.squared_distance, expected.squared_distance)
    assert report.costs == expected_report.costs


def test_an_element_holds_the_bins_of_all_channels_if_they_fit():
    def elements(color):
        return sum(cost.external_reads for cost in measured(color, 3)[1].costs.values())

    n_samples, n_boxes = 5 * 8, 60
    assert elements(COLOURS["channels"]) == n_samples * n_boxes
    assert elements(COLOURS["channels, too many for one element"]) == 3 * n_samples * n_boxes * 2


def test_a_box_of_any_size_needs_a_grid():
    with pytest.raises(ValueError, match="give columns and rows"):
        SimdLikelihood(SimdOptions(), ColorOptions(), SamplingOptions(grid=None))


@pytest.mark.parametrize(
    ("grid", "color", "sentence"),
    [
        ((32, 32), ColorOptions(), r"grid is \[32, 32\], which has 1,024 samples .* counts to 1,023: take"),
        ((64, 40), COLOURS["channels of parts"], "1,152 samples in one part"),
        ((5, 5), ColorOptions(space="joint_rgb", bins_per_channel=11), "is 11, which makes 1,331 bins"),
    ],
)
def test_what_would_wrap_is_refused(grid, color, sentence):
    with pytest.raises(ValueError, match=sentence):
        SimdLikelihood(SimdOptions(), color, SamplingOptions(grid=grid))


def test_a_grid_that_fills_a_word_is_taken():
    SimdLikelihood(SimdOptions(), ColorOptions(), SamplingOptions(grid=(33, 31)))
