"""The fusion filter: what a camera sends, and how the network's average updates its particles.

Sources: Jing & Chen, section 3.2, Eq. 15-17, and the rules in `nodes.filtering.rules`. The average times the
number of cameras is the sum: information adds up. Where a rule's average is a whole posterior, the particles
are drawn from it, as in the Gaussian particle filter (Kotecha & Djuric 2003).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from network.options import Options
from nodes.filtering.gaussian import Information, Moments, log_factor, regularized
from nodes.filtering.local import LocalGaussians, LocalResult
from nodes.filtering.motion import MotionModel, predict, transition
from nodes.filtering.particles import Particles, reweight, uniform_log_weights
from nodes.filtering.rules.covariance_intersection import CovarianceIntersection
from nodes.filtering.rules.factors import Eq17, MeasuredSum
from nodes.filtering.rules.hybrid import Hybrid
from nodes.filtering.rules.icf import InformationWeighted
from nodes.filtering.rules.naive import NaiveAverage
from nodes.filtering.rules.rule import Rule
from nodes.filtering.sighting import shrinkage, shrinkage_by

RuleName = Literal[
    "eq17", "net_information", "quadratic_fit", "naive", "covariance_intersection", "hybrid", "icf"
]


class FusionOptions(Options):
    """How the cameras' results become one."""

    rule: RuleName = "quadratic_fit"
    """`eq17`: the ratio N(u, p)/N(v, r) as printed; `net_information`: its part that is a density, on the
    position; `quadratic_fit`: the same, read off the log-likelihood by a concave quadratic that is fitted to
    it over the particles. To compare with: `naive`, the mean of the estimates; `covariance_intersection`;
    `hybrid` consensus on measurements and information; `icf`, the information-weighted consensus filter."""
    local_particles: Literal["own", "shared"] = "shared"
    """`own`: the local filter keeps particles of its own, as the text has it; `shared`: it weights the fusion
    filter's, as Algorithm 1 has it, so that a blind camera contributes exactly nothing."""
    proposal: Literal["prior", "optimal"] = "optimal"
    """`prior`: P(x(k) | x(k-1)), as in the paper; `optimal`: given the fused Gaussian as
    well, in closed form. The rules to compare with have no proposal: their Gaussian is drawn from."""
    ridge: float = Field(default=1e-10, gt=0)
    """Added to the diagonals of covariances before they are inverted, in squared units of the state."""

    @model_validator(mode="after")
    def _prediction_is_the_networks(self) -> "FusionOptions":
        if self.rule in ("hybrid", "icf") and self.local_particles == "own":
            raise ValueError(
                f"rule {self.rule} averages the fusion filter's predictions, and local_particles is own: set"
                " local_particles to shared"
            )
        return self


RULES: Mapping[RuleName, Rule] = {
    "eq17": Eq17(),
    "net_information": MeasuredSum("moments"),
    "quadratic_fit": MeasuredSum("log_likelihood"),
    "naive": NaiveAverage(),
    "covariance_intersection": CovarianceIntersection(),
    "hybrid": Hybrid(),
    "icf": InformationWeighted(),
}
"""All rules by their names in a scenario."""


@dataclass(frozen=True, slots=True, eq=False)
class Factor:
    """The network's sum, as a factor on the fusion filter's weights.

    Attributes:
        gain: Information after minus information before (Eq. 17), over the state or its position.
        is_density: Whether the factor's information matrix is positive semidefinite.
    """

    gain: Information
    is_density: bool


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """The network's answer as a whole: what a camera knew before is in it.

    Attributes:
        moments: Of the state.
        is_density: Whether its covariance is positive definite.
    """

    moments: Moments
    is_density: bool


Fused = Factor | Posterior
"""The network's average as the fusion filter uses it."""


def pack(result: LocalResult, n_cameras: int, options: FusionOptions) -> Float[np.ndarray, " K"]:
    """The vector that consensus averages: five numbers on a plane, 28 for Eq. 17 as printed.

    Args:
        result: Of the local filter.
        n_cameras: How many cameras take part.
        options: The rule.

    Returns:
        Symmetric matrices as upper triangles, each followed by its vector.
    """
    return RULES[options.rule].pack(LocalGaussians(result, options.ridge), n_cameras)


def packed_size(n_states: int, options: FusionOptions) -> int:
    """How many numbers `pack` gives, for D states."""
    return RULES[options.rule].size(n_states)


def is_density(result: LocalResult, options: FusionOptions) -> bool:
    """Whether p⁻¹ - r⁻¹ of a camera is positive semidefinite, as Eq. 17 takes for granted."""
    if options.rule != "eq17":
        return True
    local = LocalGaussians(result, options.ridge)
    return _is_semidefinite(local.after.matrix - local.before.matrix)


def _is_semidefinite(matrix: Float[np.ndarray, "D D"]) -> bool:
    return bool(np.linalg.eigvalsh(matrix)[0] >= -1e-9 * np.abs(matrix).max())


def unpack(average: Float[np.ndarray, " K"], n_cameras: int, n_states: int, options: FusionOptions) -> Fused:
    """What the network's average means (Eq. 15-16).

    Args:
        average: Of the cameras' packed vectors.
        n_cameras: How many cameras it is the average of.
        n_states: D.
        options: The rule that packed it.
    """
    answer = RULES[options.rule].unpack(average, n_cameras, n_states)
    if isinstance(answer, Information):
        return Factor(answer, _is_semidefinite(answer.matrix))
    p = answer.covariance
    return Posterior(answer, bool(np.isfinite(p).all() and np.linalg.eigvalsh(p)[0] > 0))


def left_of(prior: Moments, fused: Fused) -> float:
    """The part of the position's covariance that the network's answer leaves, 1 where it tells nothing."""
    if isinstance(fused, Factor):
        return shrinkage_by(fused.gain, prior)
    return shrinkage(prior.position(), fused.moments.position()) if fused.is_density else 1.0


def reweight_by_ratio(predicted: Particles, fused: Factor) -> Particles:
    """ω(k) = ω(k-1) N(χ; u, p) / N(χ; v, r), with the prior as proposal (Eq. 17)."""
    points = predicted.states[:, : len(fused.gain.vector)]
    center = predicted.weights @ points
    return reweight(predicted, log_factor(points, fused.gain, center))


def draw_optimal(
    previous: Particles, fused: Factor, motion: MotionModel, rng: np.random.Generator
) -> Particles:
    """Draws from P(x(k) | x(k-1), fused factor), and weights by its normaliser.

    With a Gaussian factor exp(-½ xᵀΛx + xᵀη) on the state or its position, the optimal proposal is closed
    (Doucet et al. 2000): covariance Σ = (Q⁻¹ + Λ)⁻¹, mean Σ(Q⁻¹Fx + η). It is taken in axes in which Q is the
    identity and Λ diagonal, so that nothing is inverted and no large numbers cancel.
    """
    moved = transition(previous.states, motion)
    noise = rng.standard_normal(moved.shape)
    # Q = S², S Λ S = V diag(λ) Vᵀ
    n = len(fused.gain.vector)
    S = np.sqrt(motion.variances)
    curvature, V = np.linalg.eigh(S[:n, None] * fused.gain.matrix * S[:n])
    curvature = np.maximum(curvature, 0.0)  # below zero by rounding only: the factor is a density
    # y = Vᵀ S⁻¹ Fx and e = Vᵀ S η, around the cloud's middle
    center = previous.weights @ moved[:, :n]
    y = (moved[:, :n] - center) / S[:n] @ V
    e = (fused.gain.vector - fused.gain.matrix @ center) * S[:n] @ V
    # ω(k) = ω(k-1) Π exp((e y - ½ λ y²) / (1 + λ))
    normalizer = ((e - 0.5 * curvature * y) * y / (1 + curvature)).sum(axis=1)
    # x(k) ~ N((y + e) / (1 + λ), 1 / (1 + λ)); what the factor says nothing about follows the prior
    drawn = (y + e) / (1 + curvature) + noise[:, :n] / np.sqrt(1 + curvature)
    states = np.hstack([center + drawn @ V.T * S[:n], moved[:, n:] + S[n:] * noise[:, n:]])
    return reweight(Particles(states, previous.log_weights), normalizer)


def draw_posterior(fused: Posterior, n_particles: int, ridge: float, rng: np.random.Generator) -> Particles:
    """Equally weighted draws from the network's posterior."""
    # x = u + L z, p = L Lᵀ
    L = np.linalg.cholesky(regularized(fused.moments.covariance, ridge))
    z = rng.standard_normal((n_particles, len(L)))
    return Particles(fused.moments.mean + z @ L.T, uniform_log_weights(n_particles))


def fuse(
    previous: Particles,
    predicted: Particles,
    fused: Fused,
    motion: MotionModel,
    options: FusionOptions,
    rng: np.random.Generator,
) -> Particles:
    """The fusion filter's posterior from its particles of the frame before and the network's answer.

    Args:
        previous: The particles of the frame before.
        predicted: The same, propagated: drawn from the prior.
        fused: From `unpack`.
        motion: The state model.
        options: The proposal.
        rng: The fusion filter's stream.
    """
    if isinstance(fused, Posterior):
        n = len(predicted.log_weights)
        return draw_posterior(fused, n, options.ridge, rng) if fused.is_density else predicted
    # Where nobody saw anything, the prediction stands.
    if not (fused.gain.matrix.any() or fused.gain.vector.any()):
        return predicted
    # What moves without noise cannot be drawn otherwise than it was: a factor on it can only weight.
    is_noisy = motion.variances[: len(fused.gain.vector)].all()
    if options.proposal == "optimal" and fused.is_density and is_noisy:
        return draw_optimal(previous, fused, motion, rng)
    return reweight_by_ratio(predicted, fused)


def propagate(particles: Particles, motion: MotionModel, rng: np.random.Generator) -> Particles:
    """Propagated particles with their old weights."""
    return Particles(predict(particles.states, motion, rng), particles.log_weights)
