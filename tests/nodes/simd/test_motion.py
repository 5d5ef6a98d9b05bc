"""Noise and prediction: moments of the Gaussian, the generator's period, Eq. 2."""

import numpy as np
import pytest
from scipy import stats

from nodes.simd.array import ProcessorArray
from nodes.simd.options import SimdOptions
from nodes.simd.programs.motion import XORSHIFTS, gaussian, predict, seeds, xorshift

PRIME_FACTORS = {16: (3, 5, 17, 257), 18: (3, 7, 19, 73), 20: (3, 5, 11, 31, 41)}
PRIME_FACTORS |= {22: (3, 23, 89, 683), 24: (3, 5, 7, 13, 17, 241)}


@pytest.mark.parametrize("bits", list(XORSHIFTS))
def test_the_generator_goes_through_all_states(bits):
    # As a matrix over two elements: its order is 2^n - 1 if that power is 1 and none of its parts is.
    n = 2 * bits
    first, second, third = XORSHIFTS[bits]
    one = np.eye(n, dtype=np.uint8)
    step = one
    for offset in (-first, second, -third):
        step = (one ^ np.eye(n, k=offset, dtype=np.uint8)) @ step & 1

    def power(exponent):
        result, square = one, step
        while exponent:
            result = result @ square & 1 if exponent & 1 else result
            square, exponent = square @ square & 1, exponent >> 1
        return result

    period = 2**n - 1
    assert (power(period) == one).all()
    assert not any((power(period // prime) == one).all() for prime in PRIME_FACTORS[n])


def test_a_step_of_the_generator():
    array = ProcessorArray(SimdOptions(processing_elements=4))
    state = array.word(n_words=2)
    array.input(state, np.array([1, 2, 3, 1 << 19]))
    expected = [1, 2, 3, 1 << 19]
    for _ in range(5):
        xorshift(array, state)
        for i, x in enumerate(expected):
            first, second, third = XORSHIFTS[10]
            y = x ^ (x << first) & 0xFFFFF
            y ^= y >> second
            expected[i] = y ^ (y << third) & 0xFFFFF
    np.testing.assert_array_equal(state.value, expected)


def drawn(standard_deviation, n_draws=60, arithmetic="fixed10"):
    array = ProcessorArray(SimdOptions(arithmetic=arithmetic))
    state = array.word(n_words=2)
    array.input(state, seeds(array, np.random.default_rng(5)))
    noise = array.number(n_words=2, signed=True)
    draws = []
    for _ in range(n_draws):
        gaussian(array, noise, state, standard_deviation)
        draws.append(noise.value.copy())
    return np.array(draws, float)


@pytest.mark.parametrize("arithmetic", ["fixed10", "float"])
def test_noise_has_the_moments_of_a_gaussian(arithmetic):
    draws = drawn(100, arithmetic=arithmetic)
    n = draws.size
    # rounding down takes half a unit off the mean
    assert draws.mean() == pytest.approx(-0.5 if arithmetic == "fixed10" else 0, abs=4 * 100 / np.sqrt(n))
    assert draws.std() == pytest.approx(100, rel=4 / np.sqrt(2 * n))
    assert stats.skew(draws.ravel()) == pytest.approx(0, abs=4 * np.sqrt(6 / n))
    # the sum of twelve uniform numbers has an excess kurtosis of -0.1
    assert stats.kurtosis(draws.ravel()) == pytest.approx(-0.1, abs=4 * np.sqrt(24 / n))


def test_noise_does_not_depend_on_the_neighbour_or_on_the_draw_before():
    draws = drawn(100)
    for pairs in ((draws[:, 1:], draws[:, :-1]), (draws[1:], draws[:-1])):
        correlation = np.corrcoef(pairs[0].ravel(), pairs[1].ravel())[0, 1]
        assert abs(correlation) < 4 / np.sqrt(pairs[0].size)


@pytest.mark.parametrize("arithmetic", ["fixed10", "float"])
def test_prediction_is_equation_2_within_the_limits(arithmetic):
    def run(standard_deviation):
        array = ProcessorArray(SimdOptions(arithmetic=arithmetic))
        now, before = array.number(n_words=1), array.number(n_words=1)
        generator = array.word(n_words=2)
        array.input(generator, seeds(array, np.random.default_rng(0)))
        array.input(now, np.arange(320) + 300)
        array.input(before, 2 * np.arange(320) + 100)
        predict(array, now, before, generator, (24, -8), standard_deviation, (28, 900))
        return now.value, before.value

    now, before = run(0)
    x, earlier = np.arange(320) + 300, 2 * np.arange(320) + 100
    exact = np.clip(1.5 * x - 0.5 * earlier, 28, 900)
    assert np.abs(now - exact).max() <= 1  # the last bit
    np.testing.assert_array_equal(before, x)
    noisy, _ = run(20)
    assert (noisy - exact).std() == pytest.approx(20, rel=0.15)
