"""The colours that are told apart: those of the reference; the Bhattacharyya coefficient needs no others."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, Integer, UInt8

MAX_BLOCK = 252
"""Codes in a block, so that they and a mark for all others fit a byte, in whole words of four."""
KINDS = 256
"""Numbers that a byte can be."""
OTHER = KINDS - 1
"""The number of all other colours in a block."""
SHORT = 1 << 16
"""Numbers that two bytes can be."""
PLACES = 4
"""Codes in an integral image: OpenCV has a fast path for four channels, and one look-up serves them all."""


@dataclass(frozen=True, eq=False)
class Block:
    """Codes of one part and channel that are counted together.

    Attributes:
        part: The part of the target.
        channel: The channel of the histogram.
        codes: Which of the K codes these are, in order.
        bins: Their bins.
        table: For each bin its number within the block, or `OTHER`.
    """

    part: int
    channel: int
    codes: slice
    bins: Int[np.ndarray, " k"]
    table: UInt8[np.ndarray, " B"]

    @cached_property
    def size(self) -> int:
        """How many codes it has."""
        return self.codes.stop - self.codes.start

    @cached_property
    def keys(self) -> Int[np.ndarray, " k"]:
        """What `numbers` calls its codes."""
        return self.bins if len(self.table) < KINDS else np.arange(self.size)

    def numbers(self, bins: Integer[np.ndarray, "h w"]) -> UInt8[np.ndarray, "h w"]:
        """A byte for each pixel: its bin or, where bins do not fit, its code's number within the block."""
        if len(self.table) < KINDS:
            return bins.astype(np.uint8, copy=False)
        return np.asarray(cv2.LUT(bins.astype(np.uint16, copy=False), self._long_table), dtype=np.uint8)

    @cached_property
    def _long_table(self) -> UInt8[np.ndarray, " L"]:
        """The table as `cv2.LUT` wants it, for anything that two bytes can be."""
        return np.pad(self.table, (0, (1 << 16) - len(self.table)), constant_values=OTHER)


@dataclass(frozen=True, slots=True, eq=False)
class Images:
    """What integral images of four codes each count, a code of each channel and a place to spare.

    Attributes:
        numbers: Of each image, the bins that are counted; `OTHER` where a place has no code.
        codes: Of each image; K where a place has none.
    """

    numbers: UInt8[np.ndarray, "n 4"]
    codes: Int[np.ndarray, "n 4"]


@dataclass(frozen=True, eq=False)
class Codebook:
    """The colours that are told apart.

    Attributes:
        codes: For each part, channel and bin its code: 0 to K - 1, or K for every other colour.
        part: The part that each of the K codes belongs to; codes are numbered part by part.
        n_channels: Histograms of a part.
        part_heights: Heights of the parts as fractions of the box, from the top.
    """

    codes: Integer[np.ndarray, "P C B"]
    part: Int[np.ndarray, " K"]
    n_channels: int
    part_heights: tuple[float, ...]

    @property
    def part_edges(self) -> Float[np.ndarray, " P1"]:
        """Where the parts begin and end, 0 at the top of the box and 1 at its bottom."""
        return part_edges(self.part_heights)

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """All codes, in blocks of one part and channel each."""
        return tuple(
            _block(part, channel, codes, len(self.part), first)
            for part, channels in enumerate(self.codes)
            for channel, codes in enumerate(channels)
            for first in range(0, int(np.count_nonzero(codes < len(self.part))), MAX_BLOCK)
        )

    @cached_property
    def blocks_of(self) -> tuple[tuple[Block, ...], ...]:
        """The blocks of each part."""
        parts = range(len(self.part_heights))
        return tuple(tuple(block for block in self.blocks if block.part == part) for part in parts)

    @cached_property
    def images(self) -> tuple[Images, ...]:
        """The codes of each part's three channels."""
        return tuple(_images_of_channels(blocks, len(self.part)) for blocks in self.blocks_of)


def _images_of_channels(blocks: tuple[Block, ...], n_codes: int) -> Images:
    """An image has a code of each channel."""
    size = max((block.size for block in blocks), default=0)
    numbers, codes = np.full((size, PLACES), OTHER, np.uint8), np.full((size, PLACES), n_codes)
    for block in blocks:
        numbers[: block.size, block.channel] = block.bins
        codes[: block.size, block.channel] = np.arange(block.codes.start, block.codes.stop)
    return Images(numbers, codes)


def _block(part: int, channel: int, codes: Integer[np.ndarray, " B"], n_codes: int, first: int) -> Block:
    bins = np.flatnonzero(codes < n_codes)[first : first + MAX_BLOCK]
    table = np.full(len(codes), OTHER, np.uint8)
    table[bins] = np.arange(len(bins))
    start = int(codes[bins[0]])
    return Block(part, channel, slice(start, start + len(bins)), bins, table)


def counting_type(most: int) -> type[np.uint16 | np.int32]:
    """What holds counts up to `most`: two bytes if they can, whose roots need not be worked out."""
    return np.uint16 if most < SHORT else np.int32


@lru_cache
def part_edges(part_heights: tuple[float, ...]) -> Float[np.ndarray, " P1"]:
    """Where parts of these heights begin and end."""
    return np.concatenate([[0.0], np.cumsum(part_heights)])


def codebook(used: Bool[np.ndarray, "P C B"], part_heights: tuple[float, ...]) -> Codebook:
    """Gives a code to each bin that is used.

    Args:
        used: Whether a bin is told apart from the rest.
        part_heights: Heights of the P parts.
    """
    return _codebook(np.ascontiguousarray(used).tobytes(), used.shape, part_heights)


@lru_cache(maxsize=64)  # a reference is updated every frame, the bins that it holds rarely change
def _codebook(used_bytes: bytes, shape: tuple[int, ...], part_heights: tuple[float, ...]) -> Codebook:
    used = np.frombuffer(used_bytes, bool).reshape(shape)
    part = np.nonzero(used)[0]
    n_codes, n_channels = len(part), shape[1]
    codes = np.full(shape, n_codes, dtype=np.min_scalar_type(n_codes))
    codes[used] = np.arange(n_codes)
    return Codebook(codes, part, n_channels, part_heights)
