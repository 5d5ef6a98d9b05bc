"""Normalisation of the weights and the weighted mean, by shifting and accumulating (section 3.3)."""

from dataclasses import dataclass

from nodes.simd.array import ProcessorArray
from nodes.simd.lanes import Scalar
from nodes.simd.memory import Word
from nodes.simd.programs.arithmetic import divide


@dataclass(frozen=True, slots=True)
class Group:
    """The elements of one target's particles, one after the other.

    Attributes:
        first: The leftmost element.
        n: How many.
    """

    first: int
    n: int

    @property
    def last(self) -> int:
        """The rightmost element."""
        return self.first + self.n - 1

    @property
    def elements(self) -> slice:
        """All of them."""
        return slice(self.first, self.first + self.n)


def add_up(array: ProcessorArray, total: Word, value: Word, group: Group) -> None:
    """Total of the group's first element = the sum over the group: shift left and accumulate, n - 1 times.

    What stands right of the group does not reach its first element in so many steps.
    """
    with array.using(array.like(value)) as (moving,):
        array.copy(moving, value)
        array.copy(total, value)
        for _ in array.repeat(group.n - 1):
            array.shift(moving, +1)
            array.accumulate(total, moving)


def scale_factor(array: ProcessorArray, total: Word, group: Group) -> Scalar:
    """The factor that makes the weights add up to one.

    The control processor lets the array divide, reads the quotient of the group's first element and
    broadcasts it: w / Σw = ⌊w · factor / 2^((2 n + 1) b)⌋ for weights of n words of b bits.
    """
    n_words = 2 * array.options.number_words + 1
    with array.using(array.number(n_words=n_words)) as (quotient,):
        array.copy(quotient, 1 if quotient.real else (1 << n_words * array.options.bits) - 1)
        divide(array, quotient, total)
        return array.peek(quotient, group.first)


def normalized(array: ProcessorArray, result: Word, weight: Word, factor: Scalar, extra_words: int) -> None:
    """Stores weight / Σ weights, as a fraction of the weights' words and `extra_words` more."""
    n_words = array.options.number_words
    array.multiply(
        result, weight, factor, b_words=2 * n_words + 1, drop=0 if result.real else n_words + 1 - extra_words
    )


def weighted_mean(array: ProcessorArray, weight: Word, coordinate: Word, total: Word, group: Group) -> Scalar:
    """Σ w x / Σ w, by one more shift and accumulate and a division."""
    n_words = array.options.number_words
    product, moment = array.number(n_words=n_words + 1), array.number(n_words=n_words + 2)
    with array.using(product, moment):
        array.multiply(product, weight, coordinate)
        add_up(array, moment, product, group)
        divide(array, moment, total)
        return array.peek(moment, group.first)
