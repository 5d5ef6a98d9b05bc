"""Smooth curves through keyframes, and smooth random deviations from them.

A curve is a monotone piecewise cubic (Fritsch and Butland, "A method for constructing local monotone
piecewise cubic interpolants", 1984): it never overshoots a keyframe and stays still between two equal ones,
so that a person told to wait waits. Before its first and after its last keyframe a curve holds their values.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float


def require_increasing(times: Sequence[float]) -> None:
    """Checks that every keyframe comes after the one before it.

    Args:
        times: Their times, seconds.

    Raises:
        ValueError: One does not.
    """
    for before, after in pairwise(times):
        if after <= before:
            raise ValueError(f"time_s {after} follows {before}: put the keyframes in order of time")


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A once continuously differentiable curve in D dimensions.

    Attributes:
        times: When it passes through its keyframes, seconds, increasing; at least two.
        cubics: Coefficients of every interval's powers 0 to 3 of the seconds since its start.
    """

    times: tuple[float, ...]
    cubics: Float[np.ndarray, "K 4 D"]

    def at(self, time_s: float) -> Float[np.ndarray, " D"]:
        """Value of the curve."""
        i, s = self._locate(time_s)
        return np.array([1.0, s, s**2, s**3]) @ self.cubics[i]

    def derivative_at(self, time_s: float) -> Float[np.ndarray, " D"]:
        """Derivative of the curve, per second; zero before its start and after its end."""
        if not self.times[0] <= time_s <= self.times[-1]:
            return np.zeros(self.cubics.shape[2])
        i, s = self._locate(time_s)
        return np.array([0.0, 1.0, 2 * s, 3 * s**2]) @ self.cubics[i]

    def _locate(self, time_s: float) -> tuple[int, float]:
        """The interval of a time, and the seconds since its start."""
        inside = min(max(time_s, self.times[0]), self.times[-1])
        i = min(bisect_right(self.times, inside), len(self.times) - 1) - 1
        return i, inside - self.times[i]


def curve(times: Sequence[float], values: Sequence[Sequence[float]]) -> Curve:
    """The monotone curve through keyframes.

    Args:
        times: Seconds, increasing, at least one.
        values: One row of D numbers for each time.
    """
    t, y = np.array(times, dtype=np.float64), np.array(values, dtype=np.float64)
    if len(t) == 1:  # constant
        t, y = np.array([t[0], t[0] + 1.0]), np.repeat(y, 2, axis=0)
    h = np.diff(t)[:, None]
    chords = np.diff(y, axis=0) / h
    slopes = np.empty_like(y)
    slopes[1:-1] = _inner_slopes(h, chords)
    slopes[0] = _end_slope(h[0], h[:2][-1], chords[0], chords[:2][-1])
    slopes[-1] = _end_slope(h[-1], h[-2:][0], chords[-1], chords[-2:][0])
    # cubic Hermite: y₀ + m₀ s + (3Δ - 2m₀ - m₁)/h s² + (m₀ + m₁ - 2Δ)/h² s³
    m0, m1 = slopes[:-1], slopes[1:]
    cubics = np.stack([y[:-1], m0, (3 * chords - 2 * m0 - m1) / h, (m0 + m1 - 2 * chords) / h**2], axis=1)
    return Curve(tuple(t.tolist()), cubics)


def _inner_slopes(h: Float[np.ndarray, "K 1"], chords: Float[np.ndarray, "K D"]) -> Float[np.ndarray, "L D"]:
    """Weighted harmonic means of the chords on both sides; zero at a turning point."""
    before, after = chords[:-1], chords[1:]
    weight_before, weight_after = h[:-1] + 2 * h[1:], 2 * h[:-1] + h[1:]
    same_direction = before * after > 0
    safe_before, safe_after = np.where(same_direction, before, 1.0), np.where(same_direction, after, 1.0)
    # 3(h₀ + h₁) / m = (h₀ + 2h₁) / Δ₀ + (2h₀ + h₁) / Δ₁
    mean = 3 * (h[:-1] + h[1:]) / (weight_before / safe_before + weight_after / safe_after)
    return np.where(same_direction, mean, 0.0)


def _end_slope(
    h: Float[np.ndarray, " 1"],
    h_next: Float[np.ndarray, " 1"],
    chord: Float[np.ndarray, " D"],
    chord_next: Float[np.ndarray, " D"],
) -> Float[np.ndarray, " D"]:
    """Slope of the parabola through the three outermost keyframes, cut so that the curve stays monotone."""
    slope = ((2 * h + h_next) * chord - h * chord_next) / (h + h_next)
    slope = np.where(slope * chord <= 0, 0.0, slope)
    steep = (chord * chord_next <= 0) & (np.abs(slope) > 3 * np.abs(chord))
    return np.where(steep, 3 * chord, slope)


@dataclass(frozen=True, slots=True, eq=False)
class Wander:
    """A smooth random deviation: a sum of slow sinusoids on each axis.

    Attributes:
        amplitude_m: Of every sinusoid.
        frequencies: In radians a second.
        phases: In radians.
    """

    amplitude_m: float
    frequencies: Float[np.ndarray, "M A"]
    phases: Float[np.ndarray, "M A"]

    def at(self, time_s: float) -> Float[np.ndarray, " A"]:
        """The deviation, metres."""
        return self.amplitude_m * np.sin(self.frequencies * time_s + self.phases).sum(axis=0)

    def derivative_at(self, time_s: float) -> Float[np.ndarray, " A"]:
        """Its velocity, metres a second."""
        angles = self.frequencies * time_s + self.phases
        return self.amplitude_m * (self.frequencies * np.cos(angles)).sum(axis=0)


def wander(deviation_m: float, rng: np.random.Generator, n_axes: int = 2) -> Wander:
    """A deviation of a given standard deviation along each axis, with periods of 3 to 10 seconds."""
    n_sinusoids = 4
    frequencies = 2 * np.pi * rng.uniform(0.1, 0.33, (n_sinusoids, n_axes))
    phases = rng.uniform(0.0, 2 * np.pi, (n_sinusoids, n_axes))
    # n sinusoids of amplitude a and random phase have the variance n a²/2
    return Wander(deviation_m * np.sqrt(2 / n_sinusoids), frequencies, phases)
