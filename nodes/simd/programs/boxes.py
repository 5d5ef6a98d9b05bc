"""Counting on a grid of samples in boxes of any size, and the distance to a reference, part by part.

Source: Algorithm 2 of Medeiros et al. (2008) with the samples of `nodes.counting.grid`, and the distance of
`nodes.vision.pattern` computed recursively, as the paper's section 5 proposes: the coefficient grows by
one bin after the other, so that no histogram has to be kept. As many bins as there are free words are counted
in one reading of the samples.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int, Integer

from nodes.simd.array import ProcessorArray
from nodes.simd.lanes import Scalar
from nodes.simd.memory import ExternalMemory, Word
from nodes.simd.options import SimdOptions
from nodes.simd.programs.arithmetic import divide, square_root


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """What is counted in one part of the boxes.

    Attributes:
        columns: Of the grid of samples, as fractions of the box, 0 to 1.
        rows: Of the grid.
        channels: Of each colour that is told apart.
        bins: Its bin in the channel.
        weights: W, what the root of its share counts in the coefficient.
        perfect: The coefficient of a box that shows the reference.
    """

    columns: Float[np.ndarray, " C"]
    rows: Float[np.ndarray, " R"]
    channels: Int[np.ndarray, " K"]
    bins: Int[np.ndarray, " K"]
    weights: Float[np.ndarray, " K"]
    perfect: float

    @property
    def n_samples(self) -> int:
        """How many samples a box has in this part."""
        return len(self.columns) * len(self.rows)


@dataclass(frozen=True, slots=True, eq=False)
class BoxWords:
    """The words that hold the boxes of a pass: the corner and the extent along both axes."""

    left: Word
    top: Word
    width: Word
    height: Word

    @property
    def all(self) -> tuple[Word, Word, Word, Word]:
        """The four."""
        return (self.left, self.top, self.width, self.height)


@dataclass(frozen=True, slots=True)
class Scale:
    """How the coefficient is held in a number.

    Attributes:
        coefficient: What it is multiplied by.
        shifts: Of each part, the bits by which its counts are shifted.
        one: What a similarity of one is multiplied by.
    """

    coefficient: float
    shifts: tuple[int, ...]
    one: int

    def held(self, value: float) -> Scalar:
        """A coefficient as a number."""
        return value if self.one == 1 else round(value * self.coefficient)


def scale_of(parts: Sequence[Part], options: SimdOptions) -> Scale:
    """The greatest scale at which no sum and no factor leaves its number.

    By Cauchy and Schwarz, Σ W √h over the channels of a part is at most √(n_channels Σ W²).
    """
    if options.arithmetic == "float":
        return Scale(1.0, (0,) * len(parts), 1)
    full = (1 << options.number_bits) - 1
    shifts = tuple(int(math.log2(full / max(part.n_samples, 1))) for part in parts)
    greatest = sum(
        math.sqrt(len(np.unique(part.channels)) * float(np.square(part.weights).sum())) for part in parts
    )
    limits = [
        math.sqrt(full * part.n_samples * (1 << shift)) / part.weights.max()
        for part, shift in zip(parts, shifts, strict=True)
        if len(part.weights)
    ]
    coefficient = float(min([full / greatest, *limits])) if greatest > 0 else 1.0
    return Scale(coefficient, shifts, 1 << options.number_bits)


def words_for_distance(options: SimdOptions) -> int:
    """Words that counting, or adding up the coefficient, takes beside the counts."""
    return max(8, 6 * options.number_words)


@dataclass(frozen=True, slots=True, eq=False)
class StoredPicture:
    """A picture's bins in the external memory.

    Attributes:
        memories: One if the bins of all channels fit into an element, else one a channel.
        bits: Bits of a channel's bin in a shared element.
        shared: Whether an element holds several channels.
    """

    memories: tuple[ExternalMemory, ...]
    bits: int
    shared: bool


def store_picture(bins: Integer[np.ndarray, "C h w"], n_bins: int, element_bits: int) -> StoredPicture:
    """Puts the bins of all channels side by side into the elements of one memory, if they fit."""
    bits, n_channels = (n_bins - 1).bit_length(), len(bins)
    if n_channels * bits <= element_bits:
        shifts = bits * np.arange(n_channels)
        planes = [sum(channel.astype(np.int16) << shift for channel, shift in zip(bins, shifts, strict=True))]
    else:
        planes = list(bins)
    memories = tuple(ExternalMemory(*bins.shape[1:]) for _ in planes)
    for memory, plane in zip(memories, planes, strict=True):
        memory.pixels[:] = plane
    return StoredPicture(memories, bits, shared=len(memories) < n_channels)


def count_part(
    array: ProcessorArray,
    words: Sequence[Word],
    which: slice,
    part: Part,
    boxes: BoxWords,
    picture: StoredPicture,
    pixels: Word,
    active: slice,
) -> None:
    """Counts some colours of a part, and the samples inside the picture, in one reading of its samples.

    Args:
        array: The processor.
        words: A word for each colour.
        which: Of the part's colours.
        part: The part.
        boxes: One in each active element.
        picture: The bins.
        pixels: Samples inside the picture.
        active: The elements that have a box.
    """
    channels, bins = part.channels[which], part.bins[which]
    for word in (*words, pixels):
        array.copy(word, 0)
    position, column, row = (
        array.word(n_words=2, real=True),
        *(array.word(n_words=2, signed=True) for _ in "xy"),
    )
    pixel, own = array.word("Video line buffers"), array.word()
    height, width = picture.memories[0].pixels.shape
    with array.using(position, column, row, pixel, own):
        for down in array.repeat(len(part.rows)):
            _locate(array, row, part.rows[down], boxes.top, boxes.height, height, position)
            for along in array.repeat(len(part.columns)):
                _locate(array, column, part.columns[along], boxes.left, boxes.width, width, position)
                for number, memory in enumerate(picture.memories):
                    array.fetch(pixel, memory, column, row, active)
                    if number == 0:
                        inside = array.at_least(pixel, 0)
                        array.accumulate(pixels, 1, when=inside)
                    for channel in np.unique(channels) if picture.shared else [number]:
                        seen = pixel
                        if picture.shared:
                            # the channel's bits of the element, or no bin at all
                            array.shift_right(own, pixel, picture.bits * int(channel))
                            array.mask(own, own, picture.bits)
                            array.copy(own, 1 << picture.bits, when=array.neither(inside))
                            seen = own
                        for i in np.flatnonzero(channels == channel).tolist():
                            array.accumulate(words[i], 1, when=array.equal(seen, int(bins[i])))


def _locate(
    array: ProcessorArray, target: Word, fraction: Any, low: Word, extent: Word, size: int, position: Word
) -> None:
    """Column or row of a sample, ⌊low + fraction · extent⌋; the picture's border where it is outside."""
    array.multiply(position, extent, fraction)
    array.add(position, position, low)
    array.maximum(position, position, -1)
    array.minimum(position, position, size)
    array.shift_right(target, position, 0)


def add_part(
    array: ProcessorArray,
    coefficient: Word,
    words: Sequence[Word],
    which: slice,
    part: Part,
    scale: Scale,
    shift: int,
) -> None:
    """Coefficient += Σ W √n of some colours of a part."""
    # W √(n / S) = √(n 2^s · W² / (S 2^s)), scaled
    squares = (scale.coefficient * part.weights[which]) ** 2 / (part.n_samples * (1 << shift))
    root = array.number()
    if not root.real:
        squares = np.rint(squares).astype(np.int64)
    product = array.number(n_words=2 * root.n_words)
    with array.using(root, product):
        for code in array.repeat(len(words)):
            array.shift_left(root, array.indexed(words, code), shift)
            array.multiply(product, root, squares[code], b_words=root.n_words)
            square_root(array, root, product)
            array.accumulate(coefficient, root)


def normalize_part(array: ProcessorArray, coefficient: Word, pixels: Word, n_samples: int) -> None:
    """Multiplies the coefficient by √(samples / samples seen): from shares of the grid to shares of the seen.

    The root has four bits before the point, or as many as that of all samples needs.
    """
    before_point = max(4, -(-n_samples.bit_length() // 2))
    n_words, point = array.options.number_words, array.options.number_bits - before_point
    ratio, root, divisor = array.number(n_words=2 * n_words), array.number(), array.number(n_words=1)
    with array.using(ratio, root, divisor):
        array.maximum(divisor, pixels, 1)
        array.copy(ratio, n_samples if ratio.real else n_samples << 2 * point)
        divide(array, ratio, divisor)
        square_root(array, root, ratio)
        array.multiply(ratio, coefficient, root)
        if not ratio.real:
            array.shift_right(ratio, ratio, point)
        array.copy(coefficient, ratio)


def similarity(array: ProcessorArray, coefficient: Word, perfect: Word) -> Word:
    """A new word with coefficient / perfect, F bits of it after the point.

    It is 0, the distance 1, where nothing of a box is in the picture, or in the reference.
    """
    ratio = array.number(n_words=2 * array.options.number_words)
    if ratio.real:
        array.copy(ratio, coefficient)
    else:
        one = 1 << array.options.number_bits
        array.multiply(ratio, coefficient, one, b_words=array.options.number_words + 1)
    divide(array, ratio, perfect)
    array.copy(ratio, 0, when=array.equal(perfect, 0))
    return ratio
