"""Loops whose iterations all run at once: exactly what they would give one after the other.

Words have a leading axis, one entry an iteration. What one iteration leaves to the next is known in closed
form for three instructions: adding up, shifting along the array, and keeping the last flagged value. Any
other word that an iteration reads and the one before has written is refused.
"""

import math
from typing import Any

import numpy as np
from jaxtyping import Bool, Num

from nodes.simd.memory import Word


class Loop:
    """One loop of n iterations, inside of another or not; each loop has an axis before those around it.

    Args:
        n: Iterations.
        around: The loop that it is inside of.

    Attributes:
        shape: Iterations of this loop, of the one around it, and so on.
        iterations: How often its inside is done in all.
        counter: The number of each iteration, to be broadcast with words.
    """

    def __init__(self, n: int, around: "Loop | None" = None) -> None:
        self.around = around
        self.shape: tuple[int, ...] = (n, *(around.shape if around else ()))
        self.iterations = math.prod(self.shape)
        self.counter = np.arange(n, dtype=np.int32).reshape(-1, *[1] * len(self.shape))
        # by identity; the words are held so that none takes the identity of one that is gone
        self._read: dict[int, Word] = {}
        self._written: dict[int, Word] = {}
        self._carried: dict[int, Word] = {}
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    def read(self, word: Word) -> None:
        """Notes that an iteration reads a word."""
        if id(word) in self._carried:
            raise ValueError(
                f"a word of {word.owner} is read in the loop that adds it up: read it afterwards"
            )
        if id(word) not in self._written:
            self._read[id(word)] = word
            if self.around:
                self.around.read(word)

    def write(self, word: Word) -> None:
        """Notes that an iteration writes a word."""
        if id(word) in self._read or id(word) in self._carried:
            raise ValueError(
                f"a word of {word.owner} is carried from one iteration to the next:"
                " use accumulate, shift or keep"
            )
        self._written[id(word)] = word
        if self.around:
            self.around.write(word)

    def carry(self, word: Word) -> Num[np.ndarray, "..."]:
        """The value before the loop of a word that the iterations hand on, also to those around."""
        if id(word) in self._read or id(word) in self._written:
            raise ValueError(f"a word of {word.owner} is both carried and used otherwise in a loop")
        self._carried[id(word)] = word
        return self.around.carry(word) if self.around else word.value

    def total(self, value: Any, when: Bool[np.ndarray, "..."] | None) -> Any:
        """The sum over all iterations, of those whose flag is set."""
        if when is not None:
            when = self._each(when)
            if np.ndim(value) == 0:
                # the same in each: count the flags, in the smallest integers that can
                smallest = np.min_scalar_type(self.iterations)
                return value * np.add.reduce(when.view(np.uint8), axis=0, dtype=smallest).astype(np.int32)
            value = np.where(when, self._each(value), 0)
        return value * self.iterations if np.ndim(value) < 2 else self._each(value).sum(axis=0)

    def shifted(self, word: Word, offset: int) -> Num[np.ndarray, "n P"]:
        """A word after one, two, … n shifts by one element."""
        self._require_outermost()
        if id(word) in self._read or id(word) in self._written:
            raise ValueError(f"a word of {word.owner} is shifted and used before that in a loop")
        self._written[id(word)] = word
        lanes, zeros = len(word.value), np.zeros(self.iterations, word.value.dtype)
        if offset > 0:
            windows = np.lib.stride_tricks.sliding_window_view(np.concatenate([word.value, zeros]), lanes)
            return windows[1:]
        windows = np.lib.stride_tricks.sliding_window_view(np.concatenate([zeros, word.value]), lanes)
        return windows[-2::-1]

    def last(
        self, before: Num[np.ndarray, "..."], value: Any, when: Bool[np.ndarray, "..."]
    ) -> Num[np.ndarray, " P"]:
        """The value of the last iteration whose flag is set, else what was there before."""
        self._require_outermost()
        if self._last is None or self._last[0] is not when:
            # The highest iteration with a flag: the first one from the end.
            backwards = self._each(when)[::-1]
            found = np.asarray(backwards.any(axis=0))
            self._last = (when, found, self.iterations - 1 - backwards.argmax(axis=0))
        _, found, iteration = self._last
        values = np.broadcast_to(value, (self.iterations, len(before)))
        return np.where(found, values[iteration, np.arange(len(before))], before)

    def finish(self) -> None:
        """Leaves in every word what the last iteration has left."""
        for word in self._written.values():
            if word.value.ndim > len(self.shape):
                word.value = word.value[-1].copy()

    def _each(self, lanes: Num[np.ndarray, "..."] | Bool[np.ndarray, "..."]) -> Any:
        """Lanes of all iterations, one below the other."""
        if lanes.shape[:-1] != self.shape:
            lanes = np.broadcast_to(lanes, (*self.shape, lanes.shape[-1]))
        return lanes.reshape(self.iterations, -1)

    def _require_outermost(self) -> None:
        if self.around:
            raise ValueError("in a loop inside of another only sums go on: shift and keep outside of it")
