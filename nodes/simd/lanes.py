"""The lanes of the array: words, loops and counts, under the instructions."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from jaxtyping import Bool, Int, Num

from nodes.simd.cost import Cost
from nodes.simd.loops import Loop
from nodes.simd.memory import TEMPORARY, LineMemory, Word
from nodes.simd.options import SimdOptions

Lanes = Num[np.ndarray, "..."]
Flag = Bool[np.ndarray, "..."]
Scalar = int | float
"""A number that the control processor knows: whole in fixed point."""
Operand = Word | int | float | np.number | Lanes
"""A word, or an immediate value (one for each iteration of a loop that runs all at once)."""


class LaneMachine:
    """P lanes with their line memory, the control processor's loops, and counts by step.

    Args:
        options: The processor.
        batching: Whether loops run all iterations, and routines all steps, at once; the words and the counts
            are the same either way.
        lanes: How many pieces of work there are for one element each, if not one for every element. As many
            passes of the whole program as they take run side by side, and no lane has a neighbour.

    Attributes:
        n: The lanes.
    """

    def __init__(self, options: SimdOptions, *, batching: bool = True, lanes: int | None = None) -> None:
        self.options = options
        self.n = options.processing_elements if lanes is None else lanes
        self.has_neighbours = lanes is None
        self._passes = max(1, -(-self.n // options.processing_elements))
        self.line_memory = LineMemory(options.words)
        self.costs: dict[str, Cost] = {}
        self.batching = batching
        self._loop: Loop | None = None
        self._cost = Cost()

    # Counts

    @contextmanager
    def step(self, name: str) -> Iterator[Cost]:
        """Counts what is done inside under a name."""
        before, self._cost = self._cost, self.costs.setdefault(name, Cost())
        try:
            yield self._cost
        finally:
            self._cost = before

    def at_once(self, cost: Cost, target: Word, result: Callable[..., Lanes], *operands: Word) -> None:
        """Stores what the steps of a routine would leave in a word.

        Args:
            cost: What the steps cost, which does not depend on the data.
            target: The word.
            result: What they leave there, in closed form.
            operands: What it is made from.
        """
        self._cost.add(cost, times=self._times)
        self._store(target, result(*map(self._value, operands)).astype(target.dtype, copy=False), None)

    @property
    def _times(self) -> int:
        """How often an instruction is done: in each pass, and in each iteration."""
        return self._passes * self._iterations

    @property
    def _iterations(self) -> int:
        return self._loop.iterations if self._loop else 1

    def _count(self, **instructions: int) -> None:
        times, counted = self._times, self._cost.instructions
        for kind, n in instructions.items():
            counted[kind] += n * times

    # Line memory

    def word(
        self, owner: str = TEMPORARY, n_words: int = 1, *, signed: bool = False, real: bool = False
    ) -> Word:
        """Allocates an integer, or a real number that the chip would hold in so many words."""
        return self._allocate(owner, n_words, signed=signed, real=real)

    def number(self, owner: str = TEMPORARY, n_words: int | None = None, *, signed: bool = False) -> Word:
        """Allocates a number of the chosen arithmetic: fixed point, or real."""
        real = self.options.arithmetic == "float"
        return self._allocate(owner, n_words or self.options.number_words, signed=signed, real=real)

    def like(self, word: Word) -> Word:
        """Allocates a temporary variable of the same kind as another word."""
        return self._allocate(TEMPORARY, word.n_words, signed=word.signed, real=word.real)

    def _allocate(self, owner: str, n_words: int, *, signed: bool, real: bool) -> Word:
        self.line_memory.allocate(owner, n_words)
        return Word(owner, n_words, n_words * self.options.bits, signed=signed, real=real, lanes=self.n)

    def free(self, *words: Word) -> None:
        """Gives words back."""
        for word in words:
            self.line_memory.free(word.owner, word.n_words)

    @contextmanager
    def using(self, *words: Word) -> Iterator[tuple[Word, ...]]:
        """Frees words at the end of a block."""
        try:
            yield words
        finally:
            self.free(*words)

    def _value(self, operand: Operand) -> Any:
        if not isinstance(operand, Word):
            # as a Python number, a scalar leaves the lanes as narrow as they are
            return operand.item() if isinstance(operand, np.generic) else operand
        if self._loop:
            self._loop.read(operand)
        return operand.value

    def _store(self, target: Word, value: Any, when: Flag | None) -> None:
        if when is not None:
            old = self._value(target)
            value = _chosen(when, value, old)
        if self._loop:
            self._loop.write(target)
        if not isinstance(value, np.ndarray) or not value.ndim:
            value = np.full(self.n, value, target.dtype)
        elif value.shape[-1] != self.n:
            value = np.broadcast_to(value, (*value.shape[:-1], self.n))
        target.value = value

    # Loops

    def repeat(self, n: int) -> Iterator[int | Int[np.ndarray, "..."]]:
        """A loop of the control processor; yields its counter.

        With batching, all iterations run at once on a leading axis. What one leaves to the next must go
        through `accumulate`, `shift` or `keep`; in a loop inside of another, through `accumulate`.

        Raises:
            ValueError: An iteration reads what the one before has written.
        """
        if not self.batching:
            yield from range(n)
            return
        around, self._loop = self._loop, Loop(n, self._loop)
        try:
            yield self._loop.counter
            self._loop.finish()
        finally:
            self._loop = around


def _chosen(when: Flag, value: Any, old: Lanes) -> Lanes:
    """The value where the flag is set, else the old one; np.where is slow on long arrays of integers."""
    if old.dtype.kind == "f":
        return np.where(when, value, old)
    # old ⊕ ((old ⊕ value) ∧ mask)
    changed = (old ^ value) & np.negative(when.view(np.int8), dtype=old.dtype)
    changed ^= old
    return changed
