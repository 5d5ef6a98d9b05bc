"""Confidence intervals over runs, by the bootstrap: runs are few, skewed and sometimes lost.

Source: Efron & Tibshirani (1993), chapter 13, the percentile interval.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from network.streams import stream

RESAMPLES = 4000
"""Bootstrap samples: the interval's ends move by about a hundredth of its width between two seeds."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A figure with its confidence interval.

    Attributes:
        value: The figure.
        low: Lower end.
        high: Upper end.
    """

    value: float
    low: float
    high: float


def bootstrap(
    samples: Float[np.ndarray, "R K"],
    statistic: Callable[[Float[np.ndarray, "S R K"]], Float[np.ndarray, " S"]],
    confidence: float = 0.95,
) -> Interval:
    """A statistic of runs with its percentile interval; the same runs give the same interval.

    Args:
        samples: A row a run, of what was measured in it; rows are drawn whole, so what is paired stays so.
        statistic: From sets of R runs to their figures, one each.
        confidence: Of the interval, two-sided.
    """
    rng = stream(0, "bootstrap")
    drawn = rng.integers(len(samples), size=(RESAMPLES, len(samples)))
    low, high = np.quantile(statistic(samples[drawn]), [(1 - confidence) / 2, (1 + confidence) / 2])
    return Interval(float(statistic(samples[None])[0]), float(low), float(high))


def mean_interval(values: Float[np.ndarray, " R"]) -> Interval:
    """The mean over runs."""
    return bootstrap(values[:, None], lambda drawn: drawn[:, :, 0].mean(axis=1))


def ratio_interval(numerators: Float[np.ndarray, " R"], denominators: Float[np.ndarray, " R"]) -> Interval:
    """The ratio of two means over the same runs."""
    pairs = np.stack([numerators, denominators], axis=1)
    return bootstrap(pairs, lambda drawn: drawn[:, :, 0].mean(axis=1) / drawn[:, :, 1].mean(axis=1))
