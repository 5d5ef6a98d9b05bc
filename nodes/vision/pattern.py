"""A reference made ready for comparing: the distance of many boxes to it.

Sources: the Bhattacharyya distance d² = 1 - Σ √(h q), averaged over the channels, each normalised (Jing &
Chen, Eq. 11), and over the parts of the target by their weights; its root is Truong & Kim's Eq. 13-14.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from jaxtyping import Float, Int, Integer

from nodes.counting.codebook import SHORT, Codebook, codebook
from nodes.counting.compiled import Compiled, compile_reference
from nodes.vision.appearance import Appearance
from nodes.vision.color import ColorOptions

_ROOTS = np.sqrt(np.arange(SHORT, dtype=float))


@dataclass(frozen=True, eq=False)
class Pattern:
    """What boxes are compared with.

    Attributes:
        book: The K bins of the reference that are told apart.
        scale: w ω √q of each, w being the weight of its part and channel.
        ends: Where each part's codes begin, and where the last one's end.
        perfect: w Σ ω q of each part, the most that it can contribute.
    """

    book: Codebook
    scale: Float[np.ndarray, " K"]
    ends: tuple[int, ...]
    perfect: Float[np.ndarray, " P"]

    @cached_property
    def total(self) -> float:
        """The most that all parts together can contribute."""
        return float(self.perfect.sum())

    @cached_property
    def shares(self) -> Float[np.ndarray, "K 1"]:
        """`scale` in parts of that."""
        return self.scale[:, None] / self.total

    @cached_property
    def compiled(self) -> Compiled:
        """The same for the compiled kernel."""
        return compile_reference(self.book, self.scale, self.perfect)


@lru_cache(maxsize=64)  # of a camera's latest references; they are compared by identity
def pattern_of(appearance: Appearance, options: ColorOptions, *, all_bins: bool = False) -> Pattern:
    """Makes a reference ready.

    Args:
        appearance: The reference.
        options: Its colours.
        all_bins: Whether to tell every bin apart, not only those of the target that its surroundings lack.
    """
    q, omega = appearance.histograms, appearance.distinctness
    book = full_codebook(options) if all_bins else codebook(q * omega > 0, options.parts)
    weights = np.array(options.part_weights) / book.n_channels
    scale = (omega * np.sqrt(q))[book.codes < len(book.part)] * weights[book.part]
    ends = tuple(np.searchsorted(book.part, np.arange(len(weights) + 1)).tolist())
    return Pattern(book, scale, ends, weights * (omega * q).sum(axis=(1, 2)))


@lru_cache
def full_codebook(options: ColorOptions) -> Codebook:
    """A codebook that tells every bin apart."""
    return codebook(np.ones((len(options.parts), options.n_channels, options.n_bins), bool), options.parts)


def squared_distances(
    counts: Integer[np.ndarray, "N K"], pixels: Int[np.ndarray, "N P"], pattern: Pattern
) -> Float[np.ndarray, " N"]:
    """The weighted distance of each box to the reference, d² = 1 - Σ ω √(h q) / Σ ω q, h = counts / pixels.

    With ω = 1 it is the plain one, from 0 to 1. Otherwise a box that shows more of the target than the
    reference's box did is nearer than the reference itself, below 0. Parts of which nothing is in the
    picture, or in the reference, do not count; a box with none at all has distance 1.

    Args:
        counts: Of each code.
        pixels: Of each part that are in the picture.
        pattern: The reference.
    """
    if pattern.total == 0:
        return np.ones(len(counts))
    parts = pixels.T
    everywhere = bool(np.minimum.reduce(parts, axis=None, initial=1))
    # Σ_p w_p Σ_b ω √(h q), in parts of the most that it can be
    terms = _roots(counts.T)
    terms *= pattern.shares
    roots, ends = np.sqrt(parts if everywhere else np.maximum(parts, 1)), pattern.ends
    coefficient = _sum_in_order(terms[: ends[1]]) / roots[0]
    for part in range(1, len(roots)):
        coefficient += _sum_in_order(terms[ends[part] : ends[part + 1]]) / roots[part]
    if everywhere:
        return 1 - coefficient
    # Σ_p w_p Σ_b ω q over the parts that are in the picture
    perfect = (pattern.perfect[:, None] / pattern.total * (parts > 0)).sum(axis=0)
    known = perfect > 0
    return np.asarray(1 - np.where(known, coefficient, 0) / np.where(known, perfect, 1))


def _roots(counts: Integer[np.ndarray, "K N"]) -> Float[np.ndarray, "K N"]:
    """√ of each count; of two bytes, it is looked up, in a third of the time."""
    if counts.dtype == np.uint16 and counts.size:
        return np.asarray(cv2.LUT(counts, _ROOTS), dtype=float)
    return np.sqrt(counts, dtype=float)


def _sum_in_order(terms: Float[np.ndarray, "k N"]) -> Float[np.ndarray, " N"]:
    """Σ over the codes, one after the other: a box's distance must not depend on how many there are."""
    if terms.shape[1] == 1:  # NumPy would add a single column up in another order
        return np.array([np.add.accumulate(terms[:, 0])[-1]]) if len(terms) else np.zeros(1)
    return np.add.reduce(terms, axis=0)
