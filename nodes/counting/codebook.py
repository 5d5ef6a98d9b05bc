"""The colours that are told apart: those of the reference; the Bhattacharyya coefficient needs no others."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int, Integer, UInt8

MAX_BLOCK = 252
"""Codes in a block, so that they and a mark for all others fit a byte, in whole words of four."""
OTHER = 255
"""The mark of all other colours in a block."""
PLACES = 4
"""Codes in an integral image: OpenCV has a fast path for four channels, and one look-up serves them all."""


@dataclass(frozen=True, slots=True, eq=False)
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

    @property
    def size(self) -> int:
        """How many codes it has."""
        return self.codes.stop - self.codes.start


@dataclass(frozen=True, slots=True, eq=False)
class Images:
    """What integral images of four codes each count: a code where a pixel's number is equal to the image's.

    Attributes:
        numbers: Of each image; `OTHER` where a place has no code.
        codes: Of each image; K where a place has none.
        block: The codes' block if all are of one channel, None if each place is another channel's.
    """

    numbers: UInt8[np.ndarray, "n 4"]
    codes: Int[np.ndarray, "n 4"]
    block: Block | None


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
    def images(self) -> tuple[tuple[Images, ...], ...]:
        """The same for counting from integral images, for each part."""
        n_parts, _, n_bins = self.codes.shape
        of_parts = [[block for block in self.blocks if block.part == part] for part in range(n_parts)]
        n_codes, by_bin = len(self.part), n_bins <= OTHER
        if self.n_channels > 1:
            return tuple((_images_of_channels(blocks, n_codes),) if blocks else () for blocks in of_parts)
        return tuple(
            tuple(_images_of_block(block, n_codes, by_bin=by_bin) for block in blocks) for blocks in of_parts
        )


def _images_of_channels(blocks: list[Block], n_codes: int) -> Images:
    """Of three channels: a pixel's numbers are its bins, and an image has a code of each channel."""
    size = max(block.size for block in blocks)
    numbers, codes = np.full((size, PLACES), OTHER, np.uint8), np.full((size, PLACES), n_codes)
    for block in blocks:
        numbers[: block.size, block.channel] = block.bins
        codes[: block.size, block.channel] = np.arange(block.codes.start, block.codes.stop)
    return Images(numbers, codes, None)


def _images_of_block(block: Block, n_codes: int, *, by_bin: bool) -> Images:
    """Of one channel: a pixel's number is its bin or, where those do not fit a byte, its code's place."""
    n_places = -(-block.size // PLACES) * PLACES
    numbers, codes = np.full(n_places, OTHER, np.uint8), np.full(n_places, n_codes)
    numbers[: block.size] = block.bins if by_bin else np.arange(block.size)
    codes[: block.size] = np.arange(block.codes.start, block.codes.stop)
    return Images(numbers.reshape(-1, PLACES), codes.reshape(-1, PLACES), block)


def _block(part: int, channel: int, codes: Integer[np.ndarray, " B"], n_codes: int, first: int) -> Block:
    bins = np.flatnonzero(codes < n_codes)[first : first + MAX_BLOCK]
    table = np.full(len(codes), OTHER, np.uint8)
    table[bins] = np.arange(len(bins))
    start = int(codes[bins[0]])
    return Block(part, channel, slice(start, start + len(bins)), bins, table)


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
