"""The SIR particle filter on raw measurements: the centralised filter (CPF) and each camera's baseline.

Source: Jing & Chen, section 2.1, with the prior as proposal, so that Eq. 12 multiplies the weights by the
likelihoods of all cameras; for one camera it is their single-camera filter.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np
from jaxtyping import Float

from nodes.filtering.gaussian import Moments, moments
from nodes.filtering.motion import MotionModel, predict
from nodes.filtering.particles import (
    Particles,
    resample_if_degenerate,
    reweight,
)
from nodes.vision.appearance import Appearance
from nodes.vision.observation import ObservationModel, Picture


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A camera with its picture of this frame and its reference of the target."""

    model: ObservationModel
    picture: Picture
    appearance: Appearance | None


@dataclass(frozen=True, slots=True, eq=False)
class SirInfo:
    """What a step did: the moments before and after the measurements, and the effective sample size."""

    predicted: Moments
    estimate: Moments
    ess: float


def sir_step(
    particles: Particles,
    views: Sequence[View],
    motion: MotionModel,
    ess_threshold: float,
    rng: np.random.Generator,
    n_threads: int = 1,
) -> tuple[Particles, SirInfo]:
    """One frame of the filter.

    Args:
        particles: The posterior of the frame before.
        views: The cameras, in name order.
        motion: The state model.
        ess_threshold: Fraction of n below which the particles are resampled.
        rng: The filter's own stream.
        n_threads: Threads that resample.

    Returns:
        The posterior, and its moments before the resampling.
    """
    # predict: χ(k) ~ P(χ(k) | χ(k-1))
    predicted = Particles(predict(particles.states, motion, rng), particles.log_weights)
    # reweight: ω(k) ∝ ω(k-1) Π P(z | χ(k)) (Eq. 12)
    posterior = reweight(predicted, sum_log_likelihoods(views, predicted.positions))
    info = SirInfo(
        moments(predicted.states, predicted.weights),
        moments(posterior.states, posterior.weights),
        posterior.effective_sample_size,
    )
    # resample
    return resample_if_degenerate(posterior, ess_threshold, rng, n_threads), info


def sum_log_likelihoods(
    views: Sequence[View], positions: Float[np.ndarray, "N A"]
) -> Float[np.ndarray, " N"]:
    """Adds up log Π P(z | χ) over the cameras, which see independently of each other."""
    if not views:
        return np.zeros(len(positions))
    each = [view.model.log_likelihoods(view.picture, positions, view.appearance) for view in views]
    return reduce(add, each)
