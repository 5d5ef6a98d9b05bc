"""The tracker whole: it follows a square, costs what the paper says, and is the same run either way."""

import numpy as np
import pytest

from nodes.simd.memory import LineMemoryError
from nodes.simd.options import SimdOptions
from nodes.simd.programs.binning import BinningOptions
from nodes.simd.report import PAPER_TOTAL_US, PAPER_US, PAPER_WORDS, Step
from nodes.simd.tracker import SimdTracker
from nodes.simd.tracker_options import TrackerOptions

HEIGHT, WIDTH = 240, 256
ARITHMETICS = pytest.mark.parametrize("arithmetic", ["float", "fixed10", "fixed20"])


def path(frame, target=0):
    return np.array([60.0 + 3 * frame, 110 + 25 * np.sin(frame / 4) + 60 * target])


def picture(frame, n_targets=1):
    """Coloured squares over grey noise with coloured specks."""
    rng = np.random.default_rng(frame)
    image = np.repeat(rng.integers(60, 190, (HEIGHT, WIDTH, 1), dtype=np.uint8), 3, axis=2)
    specks = rng.random((HEIGHT, WIDTH)) < 0.2
    image[specks] = rng.integers(0, 256, (np.count_nonzero(specks), 3))
    for target in range(n_targets):
        x, y = np.rint(path(frame, target)).astype(int)
        colour = np.array([(30, 40, 200), (190, 60, 30)][target])
        noise = rng.integers(-15, 16, (19, 19, 3))
        image[y - 9 : y + 10, x - 9 : x + 10] = colour + noise
    return image


def followed(tracker, n_frames, n_targets=1):
    """Errors in pixels, of each frame and target."""
    tracker.begin(picture(0, n_targets), *(path(0, target) for target in range(n_targets)))
    truth = [[path(frame, target) for target in range(n_targets)] for frame in range(1, n_frames)]
    means = [tracker.step(picture(frame, n_targets)) for frame in range(1, n_frames)]
    return np.linalg.norm(np.array(means) - np.array(truth), axis=-1)


def options(arithmetic="fixed10", **others):
    return TrackerOptions(simd=SimdOptions(arithmetic=arithmetic), **others)


@ARITHMETICS
def test_it_follows_a_square(arithmetic):
    tracker = SimdTracker(options(arithmetic, sigma=0.15), np.random.default_rng(1))
    errors = followed(tracker, 12)
    assert np.sqrt(np.mean(errors**2)) < 2.5
    assert tracker.weights().sum() == pytest.approx(1)
    assert tracker.particles().shape == (240, 2)
    assert 1 < tracker.ess() <= 240


@pytest.mark.parametrize("resampling", ["simplified", "residual", "systematic"])
def test_it_follows_with_every_rule_of_resampling(resampling):
    simd = SimdOptions(resampling=resampling)
    tracker = SimdTracker(TrackerOptions(simd=simd, sigma=0.15), np.random.default_rng(2))
    assert np.sqrt(np.mean(followed(tracker, 8) ** 2)) < 2.5


def test_it_follows_two_targets_at_once():
    tracker = SimdTracker(options(n_particles=(240, 80), sigma=0.15), np.random.default_rng(3))
    errors = followed(tracker, 8, n_targets=2)
    assert (np.sqrt(np.mean(errors**2, axis=0)) < 3).all()
    assert tracker.particles(1).shape == (80, 2)


@pytest.mark.parametrize(("shape", "kernel"), [("ellipse", "uniform"), ("rectangle", "epanechnikov")])
def test_it_follows_with_other_regions(shape, kernel):
    tracker = SimdTracker(options(shape=shape, kernel=kernel, sigma=0.15), np.random.default_rng(4))
    assert np.sqrt(np.mean(followed(tracker, 6) ** 2)) < 2.5


@pytest.mark.parametrize("arithmetic", ["float", "fixed10"])
def test_all_at_once_is_as_one_by_one(arithmetic):
    def run(batching):
        chosen = options(arithmetic, region_px=(5, 3), n_particles=(30, 20))
        tracker = SimdTracker(chosen, np.random.default_rng(5), batching=batching)
        tracker.begin(picture(0, 2)[95:115, 40:80], np.array([20.0, 10.0]), np.array([30.0, 5.0]))
        means = tracker.step(picture(1, 2)[95:115, 40:80])
        return means, tracker.particles(), tracker.weights(1), tracker.report().costs

    at_once, one_by_one = run(batching=True), run(batching=False)
    for result, expected in zip(at_once[:3], one_by_one[:3], strict=True):
        np.testing.assert_allclose(result, expected, rtol=1e-12)
    assert at_once[3] == one_by_one[3]


def test_the_same_stream_gives_the_same_track():
    first, again, other = (SimdTracker(options(), np.random.default_rng(seed)) for seed in (6, 6, 7))
    np.testing.assert_array_equal(followed(first, 4), followed(again, 4))
    assert (followed(other, 4) != followed(again, 4)).any()


def test_distances_without_a_whole_histogram_give_the_same_track():
    whole, parts = options(), options(histogram_words=7)
    np.testing.assert_array_equal(
        followed(SimdTracker(whole, np.random.default_rng(8)), 4),
        followed(SimdTracker(parts, np.random.default_rng(8)), 4),
    )


def test_few_particles_are_counted_side_by_side_with_the_same_track():
    # 100 < 320 · 15 / 30 regions of 15 columns: five passes of 21
    def run(shape):
        tracker = SimdTracker(options(n_particles=(100,)), np.random.default_rng(9))
        tracker._side_by_side = shape == "side by side"
        return followed(tracker, 3), tracker.report()

    errors, report = run("side by side")
    expected, in_columns = run("columns")
    np.testing.assert_array_equal(errors, expected)
    assert report.costs[Step.HISTOGRAMS].external_reads == 5 * 15 * 315
    assert report.costs[Step.HISTOGRAMS].cycles < in_columns.costs[Step.HISTOGRAMS].cycles
    assert report.n_words <= 64


@pytest.fixture(scope="module")
def report():
    tracker = SimdTracker(options(), np.random.default_rng(0))
    followed(tracker, 2)
    return tracker.report()


def test_every_row_of_table_1_is_near_the_papers(report):
    for name, paper in PAPER_US.items():
        assert 1 / 1.5 <= report.microseconds[name] / paper <= 1.5, name
    assert abs(report.total_us / PAPER_TOTAL_US - 1) <= 0.15


def test_table_2_is_the_papers(report):
    assert report.n_words == 62
    assert dict(report.words) == dict(PAPER_WORDS)


def test_what_is_moved_is_what_the_paper_moves(report):
    assert report.costs[Step.BINNING].external_writes == HEIGHT * WIDTH
    assert report.costs[Step.HISTOGRAMS].external_reads == 225 * 240
    assert report.pipeline.reading_lines == 225
    assert report.pipeline.elements == 240
    assert report.pipeline.holds


@pytest.mark.parametrize("n_bins", [40, 128, 512])
def test_more_bins_need_no_more_words(n_bins):
    chosen = options(binning=BinningOptions(bins=n_bins), histogram_words=20)
    tracker = SimdTracker(chosen, np.random.default_rng(0))
    tracker.begin(picture(0), path(0))
    tracker.step(picture(1))
    assert tracker.report().n_words == 62 - 20


def test_too_small_a_line_memory_is_refused():
    small = TrackerOptions(simd=SimdOptions(words=50), histogram_words=40)
    with pytest.raises(LineMemoryError, match=r"the line memory has 50 words"):
        SimdTracker(small, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("chosen", "message"),
    [
        ({"n_particles": (300, 21)}, "321 particles are too many: the array has room for 320"),
        ({"region_px": (40, 40)}, "choose a smaller region"),
        ({"process": (1.3, 0.0)}, "the nearest are 1.3125 and 0"),
        ({"process": (30.0, -2.0)}, "add up to 31.9375 at most"),
    ],
)
def test_what_the_array_cannot_hold_is_refused(chosen, message):
    with pytest.raises(ValueError, match=message):
        SimdTracker(options(**chosen), np.random.default_rng(0))


def test_what_does_not_fit_the_picture_is_refused():
    tracker = SimdTracker(options(), np.random.default_rng(0))
    with pytest.raises(ValueError, match="2 positions for 1 targets"):
        tracker.begin(picture(0), path(0), path(0))
    with pytest.raises(ValueError, match="the picture is 400 pixels wide"):
        tracker.begin(np.zeros((10, 400, 3), np.uint8), path(0))
    with pytest.raises(ValueError, match="larger than the picture"):
        tracker.begin(np.zeros((10, 40, 3), np.uint8), path(0))
    with pytest.raises(ValueError, match="1100 pixels and a word of 10 bits tells 1024 apart"):
        tracker.begin(np.zeros((1100, 40, 3), np.uint8), path(0))
    with pytest.raises(ValueError, match="outside of the picture of 256 x 240 pixels"):
        tracker.begin(picture(0), np.array([-5.0, 100.0]))


@pytest.mark.parametrize("noise_px", [0.1, 0.3, 300.0, 1e20])
def test_noise_that_a_word_cannot_hold_is_refused(noise_px):
    tracker = SimdTracker(options(noise_px=noise_px), np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"the array holds 0\.25, 0\.5, … to 255\.75"):
        tracker.begin(picture(0), path(0))


@pytest.mark.parametrize(
    "binning", [BinningOptions(bins=44), BinningOptions(space="joint_rgb", bins=7)], ids=["hue", "joint"]
)
def test_colours_that_short_words_cannot_hold_are_refused(binning):
    chosen = TrackerOptions(simd=SimdOptions(bits=8), binning=binning, n_particles=(100,))
    with pytest.raises(ValueError, match="bins are too many for words of 8 bits"):
        SimdTracker(chosen, np.random.default_rng(0))


@pytest.mark.parametrize("arithmetic", ["fixed10", "fixed20"])
@pytest.mark.parametrize("resampling", ["simplified", "residual", "systematic"])
def test_histograms_take_the_words_that_are_left(arithmetic, resampling):
    simd = SimdOptions(arithmetic=arithmetic, resampling=resampling, words=50)
    tracker = SimdTracker(TrackerOptions(simd=simd), np.random.default_rng(0))
    followed(tracker, 2)
    assert tracker.report().n_words == 50
