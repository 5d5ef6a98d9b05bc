"""Division, square root and exponential against exact ones."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.simd.array import ProcessorArray
from nodes.simd.options import SimdOptions
from nodes.simd.programs.arithmetic import divide, exponential, square_root

P = 64
SMALL = SimdOptions(processing_elements=P)


def loaded(array, values, n_words):
    word = array.word(n_words=n_words)
    array.input(word, np.zeros(P, int))
    word.value = np.asarray(values, word.dtype)
    return word


@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 3), st.booleans())
def test_division_is_exact(seed, dividend_words, divisor_words, batching):
    rng = np.random.default_rng(seed)
    # of all magnitudes, the highest included
    a = rng.integers(0, 1 << rng.integers(1, 10 * dividend_words + 1, P))
    b = rng.integers(1, 1 + (1 << rng.integers(1, 10 * divisor_words, P)))
    array = ProcessorArray(SMALL, batching=batching)
    quotient = loaded(array, a, dividend_words)
    divide(array, quotient, loaded(array, b, divisor_words))
    np.testing.assert_array_equal(quotient.value, a // b)


def test_steps_that_are_done_at_once_leave_the_same_words_counts_and_uses_of_memory():
    rng = np.random.default_rng(3)
    dividends, squares = rng.integers(0, 1 << 20, (2, P))
    divisors = rng.integers(0, 20, P)  # some are 0

    def program(array):
        quotient, root = loaded(array, dividends, 2), array.word()
        with array.step("program") as cost:
            divide(array, quotient, loaded(array, divisors, 1))
            for shift in array.repeat(3):
                square = loaded(array, squares, 2)
                array.add(square, square, shift)
                square_root(array, root, square)
                array.free(square)
        return [quotient.value, root.value], cost, array.line_memory.table

    words, *counts = program(ProcessorArray(SMALL))
    expected, *expected_counts = program(ProcessorArray(SMALL, batching=False))
    np.testing.assert_array_equal(words, expected)
    assert counts == expected_counts


def test_division_by_the_largest_divisor():
    array = ProcessorArray(SMALL)
    quotient = loaded(array, np.arange(P) + (1023 << 10) - 32, 2)
    divide(array, quotient, loaded(array, np.full(P, 1023), 1))
    np.testing.assert_array_equal(quotient.value, (np.arange(P) + (1023 << 10) - 32) // 1023)


@pytest.mark.parametrize("batching", [True, False])
@pytest.mark.parametrize("n_words", [1, 2])
def test_the_square_root_is_exact(n_words, batching):
    full = (1 << 20 * n_words) - 1
    squares = np.random.default_rng(0).integers(0, full, P)
    squares[:6] = [0, 1, 3, 4, full - 1, full]
    array = ProcessorArray(SMALL, batching=batching)
    root = array.word(n_words=n_words)
    square_root(array, root, loaded(array, squares, 2 * n_words))
    np.testing.assert_array_equal(root.value, [math.isqrt(square) for square in squares.tolist()])


@pytest.mark.parametrize(("n_words", "integer_bits"), [(1, 3), (2, 4)])
def test_the_exponential_is_right_to_the_last_bit_but_one(n_words, integer_bits):
    bits = 10 * n_words
    exponents = np.random.default_rng(1).integers(0, 1 << bits, P)
    exponents[:2] = [0, (1 << bits) - 1]
    array = ProcessorArray(SMALL)
    result = array.word(n_words=n_words)
    exponential(array, result, loaded(array, exponents, n_words), integer_bits)
    exact = np.exp(-exponents / 2.0 ** (bits - integer_bits)) * (1 << bits)
    # it rounds down, and the guard word keeps the product's roundings below one
    error = exact - result.value
    assert error.min() >= 0
    assert error.max() < 1.1


def test_real_numbers_are_not_rounded():
    array = ProcessorArray(SimdOptions(processing_elements=P, arithmetic="float"))
    a, b = array.number(), array.number()
    array.input(a, np.linspace(0, 4, P))
    square_root(array, b, a)
    np.testing.assert_allclose(b.value, np.sqrt(np.linspace(0, 4, P)))
    exponential(array, b, a, 3)
    np.testing.assert_allclose(b.value, np.exp(-np.linspace(0, 4, P)))
    divide(array, a, b)
    np.testing.assert_allclose(a.value, np.linspace(0, 4, P) * np.exp(np.linspace(0, 4, P)))
