"""Prediction by the autoregressive process of Eq. 2, with Gaussian noise made on the array."""

from types import MappingProxyType

import numpy as np
from jaxtyping import Int

from nodes.simd.array import ProcessorArray
from nodes.simd.memory import Word

N_UNIFORMS = 12
"""Uniform words in a Gaussian number; the variance of twelve is that of one scaled to unit length."""
XORSHIFTS = MappingProxyType({8: (7, 9, 8), 9: (3, 7, 4), 10: (7, 3, 9), 11: (7, 5, 9), 12: (5, 9, 11)})
"""For words of so many bits three shifts that give a generator of two words its full period."""
FRACTION_BITS = 4
"""A and B are in sixteenths."""
ROUNDING = 0.1
"""Part of its standard deviation by which rounding may change the noise."""


def coefficients_of(process: tuple[float, float], bits: int) -> tuple[int, int]:
    """A and B as the array holds them.

    Args:
        process: A and B.
        bits: Of a word.

    Raises:
        ValueError: They are no sixteenths, or so large that A x + B x' could leave its two words.
    """
    unit = 1 << FRACTION_BITS
    most = (1 << bits - 1) - 1
    A, B = (round(weight * unit) for weight in process)
    if (A / unit, B / unit) != process or abs(A) + abs(B) > most:
        raise ValueError(
            f"A is {process[0]:g} and B is {process[1]:g}: the array holds sixteenths, which add up to"
            f" {most / unit:g} at most without their signs; the nearest are {A / unit:g} and {B / unit:g}"
        )
    return A, B


def deviation_of(noise_px: float, fraction_bits: int, bits: int) -> int:
    """The noise's standard deviation as the array holds it, to the nearest unit of the state.

    Args:
        noise_px: The standard deviation in pixels.
        fraction_bits: Bits of the state after the point.
        bits: Of a word.

    Raises:
        ValueError: It does not fit a word, or rounding would make it another.
    """
    unit, most = 1 << fraction_bits, (1 << bits) - 1
    held = min(max(round(noise_px * unit), 1), most)
    if abs(held / unit - noise_px) > ROUNDING * noise_px:
        raise ValueError(
            f"the motion's noise has a standard deviation of {noise_px:g} pixels, and the array holds"
            f" {1 / unit:g}, {2 / unit:g}, … to {most / unit:g}: the nearest is {held / unit:g} (noise_px, or"
            " the root of filter.dynamics.position_variance)"
        )
    return held


def xorshift(array: ProcessorArray, state: Word) -> None:
    """The next state of a xorshift generator (Marsaglia 2003) of two words, whose period is 2²ᵇ - 1."""
    first, second, third = XORSHIFTS[array.options.bits]
    with array.using(array.word(n_words=2)) as (moved,):
        array.shift_left(moved, state, first)
        array.xor(state, state, moved)
        array.shift_right(moved, state, second)
        array.xor(state, state, moved)
        array.shift_left(moved, state, third)
        array.xor(state, state, moved)


def seeds(array: ProcessorArray, rng: np.random.Generator) -> Int[np.ndarray, " P"]:
    """A state other than 0 for the generator of each element; the input processor loads them once."""
    return rng.integers(1, 1 << 2 * array.options.bits, array.n)


def gaussian(array: ProcessorArray, noise: Word, state: Word, standard_deviation: int) -> None:
    """Noise ~ N(0, σ²), from the sum of twelve uniform words.

    Args:
        array: The processor.
        noise: Two words with a sign, or real.
        state: Of the generator.
        standard_deviation: σ in whole units of the state.
    """
    bits = array.options.bits
    # n uniform words on 0 … 2^b - 1: mean n (2^b - 1) / 2, standard deviation 2^b √(n / 12)
    with array.using(array.word(n_words=2, signed=True)) as (total,):
        array.copy(total, -(N_UNIFORMS * ((1 << bits) - 1) // 2))
        for _ in range(N_UNIFORMS // 2):
            xorshift(array, state)
            array.add(total, total, array.part(state, 0))
            array.add(total, total, array.part(state, 1))
        array.multiply(noise, total, standard_deviation, drop=1)


def predict(
    array: ProcessorArray,
    now: Word,
    before: Word,
    generator: Word,
    coefficients: tuple[int, int],
    standard_deviation: int,
    limits: tuple[int, int],
) -> None:
    """x(t+1) = A x(t) + B x(t-1) + n of one coordinate, n ~ N(0, σ²) (Eq. 2).

    Args:
        array: The processor.
        now: x(t), which becomes x(t+1).
        before: x(t-1), which becomes x(t).
        generator: Of the elements' noise.
        coefficients: A and B in sixteenths.
        standard_deviation: σ in units of the state.
        limits: The least and greatest coordinate; beyond them it saturates.
    """
    with array.using(array.number(n_words=2, signed=True)) as (noise,):
        gaussian(array, noise, generator, standard_deviation)
        mean, term = array.number(n_words=2, signed=True), array.number(n_words=2, signed=True)
        array.multiply(mean, now, coefficients[0])
        array.multiply(term, before, coefficients[1])
        array.add(mean, mean, term)
        array.shift_right(mean, mean, FRACTION_BITS)
        array.add(mean, mean, noise)
        array.maximum(mean, mean, limits[0])
        array.minimum(mean, mean, limits[1])
        array.copy(before, now)
        array.copy(now, mean)
        array.free(mean, term)
