"""Weighted particles: normalisation in the log domain, effective sample size, systematic resampling.

Source: Arulampalam et al., "A tutorial on particle filters" (2002), Algorithms 2 and 4.
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float, Int

from nodes.threads import in_shares, n_shares

LEAST_OUTPUTS = 75_000
"""New particles that a thread draws at least; for fewer it is hardly worth its start."""


@dataclass(frozen=True, eq=False)
class Particles:
    """A weighted sample of the target's state.

    Attributes:
        states: One row a particle.
        log_weights: Normalised: their exponentials add up to one.
    """

    states: Float[np.ndarray, "N D"]
    log_weights: Float[np.ndarray, " N"]

    @property
    def positions(self) -> Float[np.ndarray, "N A"]:
        """The position part of the states."""
        return self.states[:, : self.states.shape[1] // 2]

    @cached_property
    def weights(self) -> Float[np.ndarray, " N"]:
        """The weights themselves."""
        return np.exp(self.log_weights)

    @cached_property
    def effective_sample_size(self) -> float:
        """1 / Σ ω²: how many equally weighted particles the sample is worth."""
        return float(1 / (self.weights @ self.weights))


def sample_gaussian(
    mean: Float[np.ndarray, " D"],
    standard_deviation: Float[np.ndarray, " D"],
    n_particles: int,
    rng: np.random.Generator,
) -> Particles:
    """Equally weighted particles around a start."""
    states = mean + standard_deviation * rng.standard_normal((n_particles, len(mean)))
    return Particles(states, uniform_log_weights(n_particles))


def sample_moments(
    mean: Float[np.ndarray, " D"],
    covariance: Float[np.ndarray, "D D"],
    n_particles: int,
    rng: np.random.Generator,
) -> Particles:
    """Equally weighted particles of a Gaussian, whose covariance may be singular."""
    # P = V diag(λ) Vᵀ, x = m + V diag(√λ) z
    variances, V = np.linalg.eigh(covariance)
    noise = rng.standard_normal((n_particles, len(mean))) * np.sqrt(np.maximum(variances, 0.0))
    return Particles(mean + noise @ V.T, uniform_log_weights(n_particles))


@lru_cache(maxsize=8)  # every frame's resampling asks for them
def uniform_log_weights(n_particles: int) -> Float[np.ndarray, " N"]:
    """log(1/n) for each of n particles; not to be written to."""
    log_weights = np.full(n_particles, -np.log(n_particles))
    log_weights.setflags(write=False)
    return log_weights


def normalize(log_weights: Float[np.ndarray, " N"]) -> tuple[Float[np.ndarray, " N"], float]:
    """Normalises weights in the log domain.

    Returns:
        The normalised log weights and the log of the sum that was divided out (the log evidence of a
        reweighting). Where every weight is zero, nothing was learnt: uniform weights and -inf.
    """
    peak = float(np.maximum.reduce(log_weights))
    if not math.isfinite(peak):
        return uniform_log_weights(len(log_weights)), -np.inf
    log_sum = peak + math.log(np.add.reduce(np.exp(log_weights - peak)))
    return log_weights - log_sum, log_sum


def reweight(particles: Particles, log_factors: Float[np.ndarray, " N"]) -> Particles:
    """Multiplies the weights by factors given as logarithms, and normalises (Eq. 12)."""
    # A flat likelihood says nothing, and changes nothing to the last bit.
    if _is_flat(log_factors):
        return particles
    # ω(k) ∝ ω(k-1) · factor
    log_weights, _ = normalize(particles.log_weights + log_factors)
    return Particles(particles.states, log_weights)


def _is_flat(log_factors: Float[np.ndarray, " N"]) -> bool:
    # two numbers mostly tell
    return bool(log_factors[0] == log_factors[-1] and (log_factors == log_factors[0]).all())


def systematic_indices(weights: Float[np.ndarray, " N"], offset: float) -> Int[np.ndarray, " N"]:
    """Systematic resampling: one draw in each of N equal strata, all at the same offset.

    Args:
        weights: Normalised weights.
        offset: A uniform draw from [0, 1).

    Returns:
        The ancestor of each new particle; particle i has floor or ceil of N·ωᵢ children.
    """
    n = len(weights)
    return _ancestors(_upper_edges(weights), slice(0, n), n, offset)


def _upper_edges(weights: Float[np.ndarray, " N"]) -> Float[np.ndarray, " K"]:
    """Where the interval of each particle ends on the line from 0 to 1, but for the last with any weight.

    That one takes all above, and with it the rounding error of the sum.
    """
    last = len(weights) - 1
    if weights[last] == 0:
        last -= int((weights[::-1] > 0).argmax())
    return weights[:last].cumsum()


def _ancestors(
    upper_edges: Float[np.ndarray, " K"], outputs: slice, n: int, offset: float
) -> Int[np.ndarray, " M"]:
    """Each output finds its own ancestor by itself (Truong & Kim, Algorithm 1)."""
    return upper_edges.searchsorted(_strata(n)[outputs] + offset / n, side="right")


@lru_cache(maxsize=8)
def _strata(n: int) -> Float[np.ndarray, " N"]:
    """Where each of n equal parts of the line from 0 to 1 begins; not to be written to."""
    begins = np.arange(n) / n
    begins.setflags(write=False)
    return begins


def resample_if_degenerate(
    particles: Particles, ess_threshold: float, rng: np.random.Generator, n_threads: int = 1
) -> Particles:
    """Resamples where the effective sample size is below `ess_threshold` times n (Algorithm 1, step 7)."""
    n = len(particles.log_weights)
    if particles.effective_sample_size >= ess_threshold * n:
        return particles
    return resample(particles, float(rng.random()), n_threads)


def resample(
    particles: Particles, offset: float, n_threads: int = 1, least: int = LEAST_OUTPUTS
) -> Particles:
    """Equally weighted particles by `systematic_indices`.

    Args:
        particles: Weighted ones.
        offset: A uniform draw from [0, 1).
        n_threads: Threads, if there are enough particles for them.
        least: How many new particles a thread draws at least.
    """
    n, upper_edges = len(particles.log_weights), _upper_edges(particles.weights)
    components = particles.states.T
    # the ancestors are particles: nothing is clipped, but checked in another way, with a copy
    if n_shares(n, n_threads, least) == 1:
        ancestors = _ancestors(upper_edges, slice(0, n), n, offset)
        return Particles(components.take(ancestors, axis=1, mode="clip").T, uniform_log_weights(n))
    drawn = np.empty(components.shape)

    def draw(outputs: slice) -> None:
        ancestors = _ancestors(upper_edges, outputs, n, offset)
        # component by component: its share of a row is one piece of memory, and nothing is copied again
        for component, row in zip(components, drawn, strict=True):
            component.take(ancestors, mode="clip", out=row[outputs])

    in_shares(draw, n, n_threads, least)
    return Particles(drawn.T, uniform_log_weights(n))
