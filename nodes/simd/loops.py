"""Loops whose iterations all run at once: exactly what they would give one after the other.

Words have a leading axis, one entry an iteration. What one iteration leaves to the next is known in closed
form for three instructions: adding up, shifting along the array, and keeping the last flagged value. Any
other word that an iteration reads and the one before has written is refused.
"""

from typing import Any

import numpy as np
from jaxtyping import Bool, Num

from nodes.simd.memory import Word


class Loop:
    """One loop of n iterations."""

    def __init__(self, n: int) -> None:
        self.n = n
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

    def write(self, word: Word) -> None:
        """Notes that an iteration writes a word."""
        if id(word) in self._read or id(word) in self._carried:
            raise ValueError(
                f"a word of {word.owner} is carried from one iteration to the next:"
                " use accumulate, shift or keep"
            )
        self._written[id(word)] = word

    def carry(self, word: Word) -> Num[np.ndarray, "..."]:
        """The value before the loop of a word that the iterations hand on."""
        if id(word) in self._read or id(word) in self._written:
            raise ValueError(f"a word of {word.owner} is both carried and used otherwise in a loop")
        self._carried[id(word)] = word
        return word.value

    def total(self, value: Any, when: Bool[np.ndarray, "..."] | None) -> Any:
        """The sum over the iterations, of those whose flag is set."""
        if when is not None:
            when = np.broadcast_to(when, (self.n, when.shape[-1]))
            if np.ndim(value) == 0:
                # the same in each: count the flags, in the smallest integers that can
                smallest = np.min_scalar_type(self.n)
                return value * np.add.reduce(when.view(np.uint8), axis=0, dtype=smallest).astype(np.int32)
            value = np.where(when, value, 0)
        return value * self.n if np.ndim(value) < 2 else value.sum(axis=0)

    def shifted(self, word: Word, offset: int) -> Num[np.ndarray, "n P"]:
        """A word after one, two, … n shifts by one element."""
        if id(word) in self._read or id(word) in self._written:
            raise ValueError(f"a word of {word.owner} is shifted and used before that in a loop")
        self._written[id(word)] = word
        lanes, zeros = len(word.value), np.zeros(self.n, word.value.dtype)
        if offset > 0:
            windows = np.lib.stride_tricks.sliding_window_view(np.concatenate([word.value, zeros]), lanes)
            return windows[1:]
        windows = np.lib.stride_tricks.sliding_window_view(np.concatenate([zeros, word.value]), lanes)
        return windows[-2::-1]

    def last(
        self, before: Num[np.ndarray, "..."], value: Any, when: Bool[np.ndarray, "..."]
    ) -> Num[np.ndarray, " P"]:
        """The value of the last iteration whose flag is set, else what was there before."""
        if self._last is None or self._last[0] is not when:
            # The highest iteration with a flag: the first one from the end.
            backwards = np.broadcast_to(when, (self.n, when.shape[-1]))[::-1]
            found = np.asarray(backwards.any(axis=0))
            self._last = (when, found, self.n - 1 - backwards.argmax(axis=0))
        _, found, iteration = self._last
        values = np.broadcast_to(value, (self.n, len(before)))
        return np.where(found, values[iteration, np.arange(len(before))], before)

    def finish(self) -> None:
        """Leaves in every word what the last iteration has left."""
        for word in self._written.values():
            if word.value.ndim > 1:
                word.value = word.value[-1].copy()
