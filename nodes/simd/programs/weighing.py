"""From histograms to weights and their mean: sections 3.3 and 4 of Medeiros et al. (2008).

A fraction f is held as ⌊f · 2^F⌋ in the F bits of a number; in `arithmetic: float` the same programs hold the
same quantities without rounding.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from nodes.simd.array import ProcessorArray
from nodes.simd.lanes import Scalar
from nodes.simd.memory import Word
from nodes.simd.options import SimdOptions
from nodes.simd.programs.arithmetic import exponential, square_root


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """The common reference, as the control processor broadcasts it.

    Attributes:
        scaled: q of each bin as a fraction.
        shift: Bits by which counts are shifted so that they fill a number.
        perfect: The coefficient of a region that shows exactly the reference.
    """

    scaled: Int[np.ndarray, " B"] | Float[np.ndarray, " B"]
    shift: int
    perfect: Scalar


def reference(counts: Int[np.ndarray, " B"], region_total: int, options: SimdOptions) -> Reference:
    """The reference from the counts of the target's region.

    Args:
        counts: Of each bin; pixels without a bin are in none.
        region_total: What the counts of a region add up to, with those.
        options: The processor.

    Raises:
        ValueError: The region shows no colour that is told apart.
    """
    if not counts.any():
        raise ValueError("the target's region shows no colour that is told apart: start where it does")
    if options.arithmetic == "float":
        scaled = counts / region_total
        return Reference(scaled, 0, float(np.sqrt(counts * scaled).sum()))
    full = (1 << options.number_bits) - 1
    # √(h q) summed over the bins stays within a number, since Σ h < 2^F and Σ q < 2^F.
    shift = int(math.log2(full / region_total))
    whole = counts * full // region_total
    perfect = sum(math.isqrt((int(h) << shift) * int(q)) for h, q in zip(counts, whole, strict=True))
    return Reference(whole, shift, perfect)


def add_coefficient(
    array: ProcessorArray,
    coefficient: Word,
    histogram: Sequence[Word],
    first_bin: int,
    references: Sequence[Reference],
    place: Word,
    starts: Sequence[int],
) -> None:
    """Coefficient += Σ √(h q) over the bins of a histogram, or of a part of it.

    Args:
        array: The processor.
        coefficient: The sum.
        histogram: Counts of the bins from `first_bin` on.
        first_bin: Of the histogram.
        references: The reference of each target.
        place: Of the elements.
        starts: Place of the first element of each target, in rising order.
    """
    # The root takes the place of the count from which it comes.
    root = array.number()
    product = array.number(n_words=2 * root.n_words)
    with array.using(root, product):
        for bin_ in array.repeat(len(histogram)):
            array.shift_left(root, array.indexed(histogram, bin_), references[0].shift)
            if len(references) == 1:
                array.multiply(product, root, references[0].scaled[bin_ + first_bin], b_words=root.n_words)
            else:
                _multiply_own(array, product, root, bin_ + first_bin, references, place, starts)
            square_root(array, root, product)
            array.accumulate(coefficient, root)


def _multiply_own(
    array: ProcessorArray,
    product: Word,
    count: Word,
    bin_: int | Int[np.ndarray, "n 1"],
    references: Sequence[Reference],
    place: Word,
    starts: Sequence[int],
) -> None:
    """Multiplies by q, of the reference of the element's own target."""
    with array.using(array.number()) as (own,):
        array.copy(own, references[0].scaled[bin_])
        for other, start in zip(references[1:], starts[1:], strict=True):
            array.copy(own, other.scaled[bin_], when=array.at_least(place, start))
        array.multiply(product, count, own)


def likelihood(array: ProcessorArray, weight: Word, coefficient: Word, perfect: Scalar, sigma: float) -> None:
    """Stores exp(-d² / 2σ²) with d² = 1 - coefficient / perfect, not below 0.

    The exponent saturates at 8 (one word) or 16, where the likelihood is less than its last bit.
    """
    options = array.options
    integer_bits = 3 if options.number_words == 1 else 4
    exponent, wide = array.number(), array.number(n_words=2 * options.number_words)
    with array.using(exponent, wide):
        array.minimum(coefficient, coefficient, perfect)
        array.subtract(coefficient, perfect, coefficient)
        # d² / 2σ² in F bits with `integer_bits` before the point
        steepness = 1 / (2 * sigma**2 * perfect)
        if weight.real:
            array.multiply(exponent, coefficient, steepness)
        else:
            one, full = 1 << options.number_bits, (1 << options.number_bits) - 1
            # so steep that it would not fit, a likelihood is 0 in all but the best places anyway
            factor = min(round(steepness * 2.0 ** (options.number_bits - integer_bits) * one), one * one - 1)
            array.multiply(
                wide, coefficient, factor, b_words=2 * options.number_words, drop=options.number_words
            )
            array.minimum(wide, wide, full)
            array.copy(exponent, wide)
        exponential(array, weight, exponent, integer_bits)
