"""Division, square root and exponential, in steps whose number does not depend on the data.

Where the array may run all at once, the steps of a division and of a root are run and counted a single time,
and their exact results computed from then on.
"""

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np
from jaxtyping import Float, Int

from nodes.simd.array import ProcessorArray
from nodes.simd.cost import Cost
from nodes.simd.memory import Word
from nodes.simd.options import SimdOptions


def divide(array: ProcessorArray, dividend: Word, divisor: Word) -> None:
    """Leaves ⌊dividend / divisor⌋ in the dividend, by restoring division, a step for each bit.

    The program memory is small and one routine serves the colours, the weights and the mean, so that it takes
    what all of them need: several words on both sides. What dividing by 0 gives means nothing: all ones.
    """
    if dividend.real:
        array.real(dividend, _quotient, dividend, divisor)
        return
    with array.using(array.word(n_words=divisor.n_words)) as (remainder,):
        if array.batching:
            cost = _cost(divide, array.options, dividend.n_words, divisor.n_words)
            all_ones = (1 << dividend.bits) - 1
            array.at_once(cost, dividend, partial(_whole_quotient, all_ones), dividend, divisor)
            return
        # Shifted, it may have a bit more than the divisor: the carry, which the comparison heeds.
        remainder.bits += 1
        array.copy(remainder, 0)
        for _ in range(dividend.bits):
            # The highest bit of the dividend moves to the remainder, the quotient follows from below.
            array.rotate(remainder, dividend)
            fits = array.at_least(remainder, divisor)
            array.subtract(remainder, remainder, divisor, when=fits)
            array.set_low_bit(dividend, fits)


def square_root(array: ProcessorArray, root: Word, square: Word) -> None:
    """Stores ⌊√square⌋, bit by bit from the top: a bit stays where the root's square still fits.

    Args:
        array: The processor.
        root: The result; it must have half the bits of the square.
        square: Not changed.
    """
    if root.real:
        array.real(root, np.sqrt, square)
        return
    trial, product = array.word(n_words=root.n_words), array.word(n_words=square.n_words)
    with array.using(trial, product):
        if array.batching:
            array.at_once(
                _cost(square_root, array.options, root.n_words, square.n_words), root, np.sqrt, square
            )
            return
        array.copy(root, 0)
        for bit in reversed(range(root.bits)):
            array.add(trial, root, 1 << bit)
            array.multiply(product, trial, trial)
            array.copy(root, trial, when=array.at_least(square, product))


def exponential(array: ProcessorArray, result: Word, exponent: Word, integer_bits: int) -> None:
    """Stores e^-exponent as a fraction of all ones: the product of e^-2^j over the bits of the exponent.

    The product is carried in one word more than the result, so that its roundings do not add up.

    Args:
        array: The processor.
        result: A fraction.
        exponent: At least 0, with so many bits before the point.
        integer_bits: Of the exponent.
    """
    if result.real:
        array.real(result, _decay, exponent)
        return
    n_words = result.n_words + 1
    one = 1 << n_words * array.options.bits
    with array.using(array.word(n_words=n_words)) as (product,):
        array.copy(product, one - 1)
        for bit in range(exponent.bits):
            # e^-2^j for bit j, counted from the point
            factor = int(one * np.exp(-(2.0 ** (bit + integer_bits - exponent.bits))))
            flag = array.bit(exponent, bit)
            array.multiply(product, product, factor, b_words=n_words, drop=n_words, when=flag)
        array.high_words(result, product)


@lru_cache
def _cost(routine: Callable[..., None], options: SimdOptions, *n_words: int) -> Cost:
    """What a routine costs on words of these lengths: it is run and counted."""
    array = ProcessorArray(options, batching=False)
    with array.step("") as cost:
        routine(array, *(array.word(n_words=n) for n in n_words))
    return cost


def _whole_quotient(
    by_zero: int, dividend: Int[np.ndarray, "..."], divisor: Int[np.ndarray, "..."]
) -> Int[np.ndarray, "..."]:
    everywhere = np.full(np.broadcast_shapes(dividend.shape, divisor.shape), by_zero, dividend.dtype)
    return np.floor_divide(dividend, divisor, out=everywhere, where=divisor != 0)


def _quotient(
    dividend: Float[np.ndarray, "..."], divisor: Float[np.ndarray, "..."]
) -> Float[np.ndarray, "..."]:
    return np.divide(dividend, divisor, out=np.zeros(dividend.shape), where=divisor != 0)


def _decay(exponent: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    return np.exp(-exponent)
