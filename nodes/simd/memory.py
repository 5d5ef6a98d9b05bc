"""The two memories: the line memory, whose words are counted as they are allocated, and the external one."""

from collections import Counter
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Integer, Num

TEMPORARY = "Temporary variables"
"""What words belong to that are not named otherwise."""

WIDE = 31
"""Bits from which on the emulation holds a value in 64 bits."""


class LineMemoryError(ValueError):
    """A program needs more words than the processing elements have; the message is the table of their use."""


class Word:
    """One or more words of line memory at the same address in all processing elements.

    Attributes:
        owner: What it is for, as the table of the line memory names it.
        n_words: Words that one value takes.
        bits: Bits of a value.
        signed: Whether its highest bit is a sign (two's complement).
        real: Whether it holds a real number, which only `arithmetic: float` has.
        value: The lanes, shape (P,), or (n, P) for n iterations of a loop at once.
    """

    __slots__ = ("bits", "n_words", "owner", "real", "signed", "value")

    def __init__(self, owner: str, n_words: int, bits: int, *, signed: bool, real: bool, lanes: int) -> None:
        self.owner = owner
        self.n_words = n_words
        self.bits = bits
        self.signed = signed
        self.real = real
        self.value: Num[np.ndarray, "*n P"] = np.zeros(lanes, self.dtype)

    @property
    def dtype(self) -> type[np.number]:
        """How the emulation holds a lane."""
        return np.float64 if self.real else np.int32 if self.bits < WIDE else np.int64

    def wrapped(self, value: Any) -> Any:
        """What is left of a value in so many bits: it wraps around."""
        if self.real:
            return np.asarray(value, np.float64)
        if self.bits >= WIDE:
            value = np.asarray(value, np.int64)
        mask = (1 << self.bits) - 1
        if self.signed:
            half = 1 << (self.bits - 1)
            return ((value + half) & mask) - half
        return value & mask


class LineMemory:
    """Counts the words of a processing element by what they are for.

    Attributes:
        size: Words that there are.
        used: Words in use now.
        high_water: The most words that were ever in use at once.
    """

    def __init__(self, size: int) -> None:
        self.size = size
        self.used = 0
        self.high_water = 0
        self._used: Counter[str] = Counter()
        self._peak: Counter[str] = Counter()

    @property
    def table(self) -> MappingProxyType[str, int]:
        """What used the words when most were in use."""
        return MappingProxyType({owner: n for owner, n in self._peak.items() if n})

    def allocate(self, owner: str, n_words: int) -> None:
        """Takes words.

        Raises:
            LineMemoryError: There are not so many left.
        """
        if self.used + n_words > self.size:
            uses = ", ".join(f"{name} {n}" for name, n in self._used.items() if n)
            raise LineMemoryError(
                f"the line memory has {self.size} words, {self.used} are in use ({uses}) and"
                f" {n_words} more are needed for {owner}: give it more (simd.words)"
            )
        self._used[owner] += n_words
        self.used += n_words
        if self.used > self.high_water:
            self.high_water, self._peak = self.used, self._used.copy()

    def free(self, owner: str, n_words: int) -> None:
        """Gives words back."""
        self._used[owner] -= n_words
        self.used -= n_words


class ExternalMemory:
    """A picture's bins outside the chip; the digital input and output processors reach any of them.

    Attributes:
        pixels: The bins; around them lies a border of -1.
    """

    def __init__(self, height: int, width: int) -> None:
        self._bordered = np.full((height + 2, width + 2), -1, np.int16)
        self.pixels: Integer[np.ndarray, "H W"] = self._bordered[1:-1, 1:-1]

    def read(
        self, columns: Integer[np.ndarray, "..."], rows: Integer[np.ndarray, "..."]
    ) -> Integer[np.ndarray, "..."]:
        """The bins at these places, -1 where they are outside."""
        height, width = self._bordered.shape
        starts = np.minimum(np.maximum(rows + 1, 0), height - 1) * width
        return self._bordered.take(starts + np.minimum(np.maximum(columns + 1, 0), width - 1))
