"""The linear processor array: what its elements can do, statement by statement.

Source: Medeiros et al. (2008), section 3.1. All elements do the same to the same address of their line
memory; an operand may be a neighbour's word or an immediate value that the global control processor
broadcasts, and a store may depend on the element's flag. A statement is load, operate, store for each word of
its values, the carry staying in the element. Values wrap around in the bits of their word.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Int, Integer, Num

from nodes.simd.lanes import Flag, LaneMachine, Lanes, Operand, Scalar
from nodes.simd.memory import ExternalMemory, Word


class ProcessorArray(LaneMachine):
    """The processing elements, the input and output processors and the global control processor."""

    # Arithmetic

    def _apply(
        self, operate: Callable[..., Lanes], target: Word, *operands: Operand, when: Flag | None = None
    ) -> None:
        n = target.n_words
        self._count(load=n, operate=n, store=n)
        self._store(target, target.wrapped(operate(*map(self._value, operands))), when)

    def copy(self, target: Word, a: Operand, when: Flag | None = None) -> None:
        """Stores a."""
        self._count(load=target.n_words, store=target.n_words)
        self._store(target, target.wrapped(self._value(a)), when)

    def add(self, target: Word, a: Operand, b: Operand, when: Flag | None = None) -> None:
        """Stores a + b."""
        self._apply(np.add, target, a, b, when=when)

    def subtract(self, target: Word, a: Operand, b: Operand, when: Flag | None = None) -> None:
        """Stores a - b."""
        if when is not None and target is a and not target.real:
            # the same as choosing afterwards, and quicker to emulate: nothing is subtracted elsewhere
            b = self._value(b) & -when.view(np.int8)
            when = None
        self._apply(np.subtract, target, a, b, when=when)

    def minimum(self, target: Word, a: Operand, b: Operand) -> None:
        """Stores min(a, b)."""
        self._apply(np.minimum, target, a, b)

    def maximum(self, target: Word, a: Operand, b: Operand) -> None:
        """Stores max(a, b)."""
        self._apply(np.maximum, target, a, b)

    def xor(self, target: Word, a: Operand, b: Operand) -> None:
        """Stores a ⊕ b."""
        self._apply(np.bitwise_xor, target, a, b)

    def mask(self, target: Word, a: Operand, bits: int) -> None:
        """Stores the lowest bits of a."""
        self._apply(np.bitwise_and, target, a, (1 << bits) - 1)

    def shift_left(self, target: Word, a: Operand, bits: int) -> None:
        """Stores a · 2^bits, wrapped; all but one of several words take what the next one shifts out."""
        self._count(load=target.n_words, operate=2 * target.n_words - 1, store=target.n_words)
        self._store(target, target.wrapped(self._value(a) * (1 << bits)), None)

    def shift_right(self, target: Word, a: Operand, bits: int) -> None:
        """Stores ⌊a / 2^bits⌋; a real number is not rounded."""
        self._count(load=target.n_words, operate=2 * target.n_words - 1, store=target.n_words)
        value = self._value(a)
        if target.real:
            value = value / (1 << bits)
        elif isinstance(a, Word) and a.real:
            value = np.floor(value / (1 << bits)).astype(np.int32)
        else:
            value = value >> bits
        self._store(target, target.wrapped(value), None)

    def rotate(self, high: Word, low: Word) -> None:
        """Shifts two values that follow each other left by a bit: the highest bit of low moves into high."""
        n = high.n_words + low.n_words
        self._count(load=n, operate=n, store=n)
        high_value, low_value = self._value(high), self._value(low)
        carry = low_value >> (low.bits - 1)
        carry |= high_value << 1
        self._store(high, high.wrapped(carry), None)
        self._store(low, low.wrapped(low_value << 1), None)

    def multiply(
        self, target: Word, a: Operand, b: Operand, b_words: int = 1, drop: int = 0, when: Flag | None = None
    ) -> None:
        """Stores ⌊a · b / 2^(drop · bits)⌋: the words of the product from `drop` on.

        Each pair of words is one multiplication into an accumulator of two words; the words that are dropped
        are computed but not stored.

        Args:
            target: Where the product goes.
            a: A word.
            b: A word or an immediate value.
            b_words: Words of b, if it is immediate.
            drop: Low words of the product that are not kept.
            when: Flag under which it is stored.
        """
        a_words = a.n_words if isinstance(a, Word) else 1
        b_words = b.n_words if isinstance(b, Word) else b_words
        pairs = a_words * b_words
        self._count(load=pairs, multiply=pairs, operate=2 * (pairs - 1), store=target.n_words)
        first, second = self._value(a), self._value(b)
        if target.real:
            self._store(target, first * second / (1 << drop * self.options.bits), when)
            return
        wide = np.int64 if pairs > 2 else np.int32
        product = np.asarray(first, wide) * np.asarray(second, wide)
        value = target.wrapped(product >> drop * self.options.bits)
        self._store(target, value.astype(target.dtype, copy=False), when)

    def high_words(self, target: Word, a: Word) -> None:
        """Stores the highest words of a."""
        self._count(load=target.n_words, store=target.n_words)
        self._store(target, target.wrapped(self._value(a) >> (a.bits - target.bits)), None)

    def set_low_bit(self, target: Word, flag: Flag) -> None:
        """Sets the lowest bit of an even number where the flag is set."""
        self._count(load=1, operate=1, store=1)
        self._store(target, self._value(target) | flag, None)

    def real(self, target: Word, function: Callable[..., Lanes], *operands: Operand) -> None:
        """A function of real numbers, one instruction of a unit that the chip does not have.

        Raises:
            ValueError: The numbers are not real.
        """
        if not target.real:
            raise ValueError(f"the array has no {function.__name__}: only arithmetic float takes one")
        self._apply(function, target, *operands)

    # Flags

    def _compare(self, a: Operand, b: Operand) -> tuple[Any, Any]:
        n = max(x.n_words if isinstance(x, Word) else 1 for x in (a, b))
        self._count(load=n, operate=n)
        return self._value(a), self._value(b)

    def equal(self, a: Operand, b: Operand) -> Flag:
        """Where a = b."""
        first, second = self._compare(a, b)
        return np.asarray(first == second)

    def less(self, a: Operand, b: Operand) -> Flag:
        """Where a < b."""
        first, second = self._compare(a, b)
        return np.asarray(first < second)

    def at_least(self, a: Operand, b: Operand) -> Flag:
        """Where a ≥ b."""
        first, second = self._compare(a, b)
        return np.asarray(first >= second)

    def bit(self, a: Word, index: int) -> Flag:
        """Where a bit of a is set."""
        self._count(load=1, operate=1)
        return np.asarray((self._value(a) >> index) & 1, bool)

    def both(self, first: Flag, second: Flag) -> Flag:
        """Where both flags are set."""
        self._count(operate=1)
        return first & second

    def either(self, first: Flag, second: Flag) -> Flag:
        """Where one of two flags is set."""
        self._count(operate=1)
        return first | second

    def neither(self, flag: Flag) -> Flag:
        """Where a flag is not set."""
        self._count(operate=1)
        return ~flag

    # Addresses

    def part(self, word: Word, index: int) -> Lanes:
        """One word of several as an operand, 0 being the lowest."""
        return (self._value(word) >> index * self.options.bits) & ((1 << self.options.bits) - 1)

    def indexed(self, words: Sequence[Word], index: int | Int[np.ndarray, "..."]) -> Operand:
        """The word whose address the control processor counts up in a loop, as an operand."""
        if isinstance(index, int):
            return words[index]
        return np.stack([self._value(words[i]) for i in index.ravel()]).reshape(*index.shape[:-1], self.n)

    # From one element to the next, and from one iteration to the next

    def neighbour(self, word: Word, offset: int) -> Lanes:
        """The word of the neighbour at +1 (right) or -1 (left), as an operand; 0 beyond the last element.

        Raises:
            ValueError: The lanes are those of several passes.
        """
        self._require_neighbours()
        value = self._value(word)
        moved = np.zeros_like(value)
        here, there = (slice(None, -1), slice(1, None))[:: 1 if offset > 0 else -1]
        moved[..., here] = value[..., there]
        return moved

    def shift(self, word: Word, offset: int) -> None:
        """Each element takes the word of its neighbour at `offset`, in a loop once in every iteration.

        Raises:
            ValueError: The lanes are those of several passes.
        """
        self._require_neighbours()
        if self._loop is None:
            self.copy(word, self.neighbour(word, offset))
            return
        self._count(load=word.n_words, store=word.n_words)
        word.value = self._loop.shifted(word, offset)

    def _require_neighbours(self) -> None:
        if not self.has_neighbours:
            raise ValueError("the lanes are pieces of work, of which none has a neighbour: leave out lanes")

    def accumulate(self, total: Word, a: Operand, when: Flag | None = None) -> None:
        """Adds a to total, also over the iterations of a loop."""
        if self._loop is None:
            self.add(total, total, a, when)
            return
        self._count(load=total.n_words, operate=total.n_words, store=total.n_words)
        added = self._loop.total(self._value(a), when)
        total.value = total.wrapped(self._loop.carry(total) + added).astype(total.dtype, copy=False)

    def keep(self, target: Word, a: Operand, when: Flag) -> None:
        """Stores a where the flag is set, also over the iterations of a loop."""
        if self._loop is None:
            self.copy(target, a, when)
            return
        self._count(load=target.n_words, store=target.n_words)
        target.value = self._loop.last(self._loop.carry(target), self._value(a), when)

    # Input, output and control

    def input(self, target: Word, line: Num[np.ndarray, "..."]) -> None:
        """The digital input processor stores a line, beside the array's work."""
        value = np.asarray(line)
        padded = np.zeros((*value.shape[:-1], self.n), np.float64 if target.real else np.int32)
        padded[..., : value.shape[-1]] = value
        self._store(target, padded, None)

    def fetch(self, target: Word, memory: ExternalMemory, column: Word, row: Word, active: slice) -> None:
        """The input processor reads the pixel that each active element asks for; -1 outside the picture."""
        columns, rows = self._value(column)[..., active], self._value(row)[..., active]
        self._cost.external_reads += columns.shape[-1] * self._iterations
        pixels = memory.read(columns, rows)
        value = pixels
        if pixels.shape[-1] < self.n:
            value = np.full((*pixels.shape[:-1], self.n), -1, pixels.dtype)
            value[..., active] = pixels
        self._store(target, value, None)

    def output(
        self, word: Word, memory: ExternalMemory, rows: Integer[np.ndarray, "..."] | np.integer
    ) -> None:
        """The digital output processor stores the first elements of a line in the external memory."""
        width = memory.pixels.shape[1]
        self._cost.external_writes += width * self._iterations
        memory.pixels[rows] = self._value(word)[..., :width]

    def collect(self, word: Word, elements: slice) -> Num[np.ndarray, "..."]:
        """The digital output processor takes the words of some elements to the external memory."""
        values = self._value(word)[..., elements]
        self._cost.external_writes += values.shape[-1] * self._iterations
        return values

    def peek(self, word: Word, element: int) -> Scalar:
        """The control processor reads the word of one element."""
        self._count(readout=word.n_words)
        return self._value(word)[element].item()

    def scan(self, word: Word, active: slice) -> Sequence[Scalar]:
        """A line passes by the control processor, one element after the other."""
        values = self._value(word)[active].tolist()
        self._count(readout=len(values) * word.n_words)
        return values
