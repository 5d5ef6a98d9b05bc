"""Payloads in fewer bits: float32, float16, rounded to the nearest or at random.

Consensus on rounded values keeps the average if both ends of a link use the rounded ones (Frasca, Carli,
Fagnani & Zampieri 2009), which the averaging algorithms do: what a node has sent stands for its own state in
its step. Rounding at random is right in the mean (Aysal, Coates & Rabbat 2008): errors do not add up in one
direction.

Half precision ends at 65504, where information begins. Its numbers are taken relative to a power of two that
the message carries, so that the largest lies between 2¹⁴ and 2¹⁵; one 2²⁹ times smaller loses digits.
"""

import math
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float
from pydantic import model_validator

from network.options import Options
from network.streams import stream

Encoding = Literal["float64", "float32", "float16"]
ENCODINGS: tuple[Encoding, ...] = get_args(Encoding)

LARGEST: dict[Encoding, float] = {"float64": 1e150, "float32": 3e38, "float16": 1e150}
"""The largest magnitudes that are sent. Sums and products of them are far from overflowing."""

_TOP_EXPONENT = 15  # the largest number of a payload lies below 2 to this power


class PayloadOptions(Options):
    """How the numbers of the consensus messages are written."""

    encoding: Encoding = "float64"
    """Eight, four or two bytes a number."""
    rounding: Literal["nearest", "stochastic"] = "nearest"
    """`nearest`: errors are the smallest; `stochastic`: up or down at random, right in the mean."""

    @model_validator(mode="after")
    def _something_to_round(self) -> "PayloadOptions":
        if self.rounding == "stochastic" and self.encoding == "float64":
            raise ValueError("rounding is stochastic, but float64 rounds nothing: take float32 or float16")
        return self

    def quantizer(self, seed: int, name: str) -> "Quantizer":
        """What rounds the payloads of a node, by its own stream where chance decides."""
        rng = stream(seed, name, "payload") if self.rounding == "stochastic" else None
        return Quantizer(self.encoding, rng)


class Quantizer:
    """Rounds what a node sends."""

    def __init__(self, encoding: Encoding = "float64", rng: np.random.Generator | None = None) -> None:
        """Rounds to the nearest number, or at random.

        Args:
            encoding: What the payload will be written in.
            rng: The node's stream for rounding at random, None for the nearest.
        """
        self.encoding = encoding
        self._rng = rng

    def __call__(self, payload: tuple[float, ...]) -> tuple[float, ...]:
        """A payload that its encoding holds exactly.

        Numbers that are too large, such as those of a node that believed nonsense, become the largest
        there are; others that are not finite remain, for whoever writes them to refuse.
        """
        largest = LARGEST[self.encoding]
        # √Σ x² is no smaller than the largest of them: one call for nearly all; it passes NaN on
        if not math.hypot(*payload) <= largest:
            payload = tuple(max(-largest, min(x, largest)) if math.isfinite(x) else x for x in payload)
        if self.encoding == "float64":
            return payload
        numbers = np.array(payload)
        if self.encoding == "float32":
            return tuple(_rounded(numbers, np.dtype(np.float32), self._rng).tolist())
        exponent = half_exponent(payload)
        scaled = _rounded(np.ldexp(numbers, -exponent), np.dtype(np.float16), self._rng)
        rounded = tuple(np.ldexp(scaled, exponent).tolist())
        if half_exponent(rounded) != exponent:
            # the largest was rounded up to the next power of two: the smallest may not fit any more
            return self(rounded)
        return rounded


def are_below(numbers: tuple[float, ...], largest: float) -> bool:
    """Whether no magnitude is above a largest one; not so where one is infinite or NaN."""
    # again one call for nearly all
    return math.hypot(*numbers) <= largest or all(-largest <= x <= largest for x in numbers)


def half_exponent(payload: tuple[float, ...]) -> int:
    """The power of two by which numbers are divided before they are written in half precision."""
    _, exponent = math.frexp(max(map(abs, payload), default=0.0))
    return exponent - _TOP_EXPONENT


def _rounded(
    values: Float[np.ndarray, " K"], dtype: np.dtype[np.floating], rng: np.random.Generator | None
) -> Float[np.ndarray, " K"]:
    """The nearest number of this type, or one of the two beside by chance, right in the mean."""
    with np.errstate(over="ignore"):  # infinity is refused when the message is written
        nearest = values.astype(dtype)
        if rng is None:
            return nearest.astype(float)
        error = values - nearest.astype(float)
        other = np.nextafter(nearest, np.where(error > 0, np.inf, -np.inf).astype(dtype)).astype(float)
    exact = nearest.astype(float)
    gap = np.abs(other - exact)
    return np.where(rng.random(values.shape) * gap < np.abs(error), other, exact)
