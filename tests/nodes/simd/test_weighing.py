"""Weights against exact ones: distance, likelihood, normalisation and mean, in three arithmetics."""

import numpy as np
import pytest

from nodes.simd.array import ProcessorArray
from nodes.simd.options import SimdOptions
from nodes.simd.programs.normalizing import Group, add_up, normalized, scale_factor, weighted_mean
from nodes.simd.programs.weighing import add_coefficient, likelihood, reference

N_BINS, N_SAMPLES, SIGMA = 40, 225, 0.2
ARITHMETICS = pytest.mark.parametrize("arithmetic", ["float", "fixed10", "fixed20"])
BOTH_WAYS = pytest.mark.parametrize("batching", [True, False])
GROUP = Group(80, 240)


def processor(arithmetic, *, batching=True):
    # with words enough for forty bins and numbers of two words
    return ProcessorArray(SimdOptions(arithmetic=arithmetic, words=100), batching=batching)


@pytest.fixture
def counts():
    """Histograms of 320 regions, from alike to quite other than the first one."""
    rng = np.random.default_rng(0)
    q = rng.dirichlet(np.full(N_BINS, 0.2))
    other = rng.dirichlet(np.full(N_BINS, 0.2))
    return np.stack([rng.multinomial(N_SAMPLES, (1 - a) * q + a * other) for a in np.linspace(0, 1, 320)])


def exact_distance(counts):
    return 1 - np.sqrt(counts * counts[0]).sum(axis=1) / N_SAMPLES


def weighed(array, counts, *, n_words=N_BINS):
    """Coefficients and likelihoods, the histogram counted in parts of `n_words` bins."""
    seen = reference(counts[0], N_SAMPLES, array.options)
    coefficient, weight, place = array.number(), array.number(), array.word()
    with array.step("distances") as cost:
        for first in range(0, N_BINS, n_words):
            histogram = [array.word("Histograms") for _ in range(n_words)]
            for bin_, word in enumerate(histogram, start=first):
                array.input(word, counts[:, bin_])
            add_coefficient(array, coefficient, histogram, first, [seen], place, [0])
            array.free(*histogram)
    distance = 1 - coefficient.value / seen.perfect
    likelihood(array, weight, coefficient, seen.perfect, SIGMA)
    return distance, weight.value, cost


@ARITHMETICS
def test_distances_and_likelihoods_are_exact_up_to_the_arithmetic(arithmetic, counts):
    array = processor(arithmetic)
    distance, weight, _ = weighed(array, counts)
    exact = exact_distance(counts)
    # each root rounds down by at most a unit in the last place of the coefficient
    bound = {"float": 1e-12, "fixed10": N_BINS / 2**9, "fixed20": N_BINS / 2**18}[arithmetic]
    assert np.abs(distance - exact).max() < bound
    likelihoods = weight / (1 if arithmetic == "float" else 1 << array.options.number_bits)
    expected = np.exp(-np.maximum(distance, 0) / (2 * SIGMA**2))
    # the exponent has seven or sixteen bits after the point
    bound = {"float": 1e-12, "fixed10": 2**-7, "fixed20": 2**-15}[arithmetic]
    assert np.abs(likelihoods - expected).max() < 1.5 * bound


@ARITHMETICS
@pytest.mark.parametrize("n_words", [1, 8])
def test_the_distance_adds_up_without_a_whole_histogram(arithmetic, n_words, counts):
    whole, _, _ = weighed(processor(arithmetic), counts)
    parts, _, _ = weighed(processor(arithmetic), counts, n_words=n_words)
    np.testing.assert_allclose(parts, whole, atol=1e-12)


@pytest.mark.parametrize("arithmetic", ["fixed10", "fixed20"])
def test_all_bins_at_once_are_as_one_by_one(arithmetic, counts):
    distance, weight, cost = weighed(processor(arithmetic), counts)
    expected = weighed(processor(arithmetic, batching=False), counts)
    np.testing.assert_array_equal(distance, expected[0])
    np.testing.assert_array_equal(weight, expected[1])
    assert cost == expected[2]


def test_several_targets_have_references_of_their_own(counts):
    array, place = processor("fixed20"), np.arange(320)
    histogram, where = [array.word() for _ in range(N_BINS)], array.word()
    array.input(where, place)
    for bin_, word in enumerate(histogram):
        array.input(word, counts[:, bin_])
    references = [reference(counts[i], N_SAMPLES, array.options) for i in (0, 319)]
    both, first, second = array.number(), array.number(), array.number()
    add_coefficient(array, both, histogram, 0, references, where, [0, 240])
    for single, seen in zip((first, second), references, strict=True):
        add_coefficient(array, single, histogram, 0, [seen], where, [0])
    np.testing.assert_array_equal(both.value, np.where(place < 240, first.value, second.value))


def test_a_region_without_a_colour_is_no_reference():
    with pytest.raises(ValueError, match="no colour that is told apart"):
        reference(np.zeros(N_BINS, int), N_SAMPLES, SimdOptions())


@ARITHMETICS
@BOTH_WAYS
def test_weights_add_up_to_one_and_the_mean_is_theirs(arithmetic, batching):
    array = processor(arithmetic, batching=batching)
    rng = np.random.default_rng(3)
    bits = array.options.number_bits
    values, places = rng.random(320) ** 4, rng.integers(0, 1024, 320)
    weight, coordinate, result = array.number(), array.number(n_words=1), array.number()
    array.input(weight, values if weight.real else np.floor(values * (1 << bits)))
    array.input(coordinate, places)
    total = array.number(n_words=array.options.number_words + 1)
    add_up(array, total, weight, GROUP)
    held = weight.value[GROUP.elements]
    assert array.peek(total, GROUP.first) == pytest.approx(held.sum())
    mean = weighted_mean(array, weight, coordinate, total, GROUP)
    exact = np.average(places[GROUP.elements], weights=held)
    assert mean == (pytest.approx(exact) if weight.real else int(exact))
    normalized(array, result, weight, scale_factor(array, total, GROUP), extra_words=0)
    shares = result.value[GROUP.elements] / (1 if weight.real else 1 << bits)
    # rounded down, so that their sum never wraps
    error = held / held.sum() - shares
    assert error.max() < (1e-12 if weight.real else 2 / (1 << bits))
    assert shares.sum() <= 1 + 1e-12
