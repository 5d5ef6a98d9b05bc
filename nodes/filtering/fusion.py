"""The fusion filter: what a camera sends, and how the network's average updates its particles.

Source: Jing & Chen, section 3.2, Eq. 15-17. The average times the number of cameras is the sum: information
adds up. Eq. 17 as printed divides two Gaussians whose ratio need not be a density; the other rules send the
net information about the position, which always is one.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from network.codec import pack_symmetric, unpack_symmetric
from network.options import Options
from nodes.filtering.gaussian import (
    Information,
    fit_log_quadratic,
    log_factor,
    net_information,
    to_information,
)
from nodes.filtering.local import LocalResult
from nodes.filtering.motion import MotionModel, predict, transition
from nodes.filtering.particles import Particles, reweight


class FusionOptions(Options):
    """How the cameras' results become one."""

    rule: Literal["eq17", "net_information", "quadratic_fit"] = "net_information"
    """`eq17`: the ratio N(u, p)/N(v, r) as printed; `net_information`: its part that is a density, on the
    position; `quadratic_fit`: a concave quadratic fitted to the log-likelihood over the particles."""
    local_particles: Literal["own", "shared"] = "shared"
    """`own`: the local filter keeps particles of its own, as the text has it; `shared`: it weights the fusion
    filter's, as Algorithm 1 has it, so that a blind camera contributes exactly nothing."""
    proposal: Literal["prior", "optimal"] = "optimal"
    """`prior`: P(x(k) | x(k-1)), as in the paper; `optimal`: given the fused Gaussian as
    well, in closed form."""
    ridge: float = Field(default=1e-10, gt=0)
    """Added to the diagonals of covariances before they are inverted, in squared units of the state."""


@dataclass(frozen=True, slots=True, eq=False)
class Fused:
    """The network's sum as the fusion filter uses it.

    Attributes:
        gain: Factor on the weights: information after minus information before (Eq. 17), over the state or
            its position.
        is_density: Whether the factor's information matrix is positive semidefinite.
    """

    gain: Information
    is_density: bool


def pack(result: LocalResult, options: FusionOptions) -> Float[np.ndarray, " K"]:
    """The vector that consensus averages: five numbers on a plane, 28 for Eq. 17 as printed.

    Args:
        result: Of the local filter.
        options: The rule.

    Returns:
        Information matrices as upper triangles, each followed by its vector.
    """
    if options.rule == "eq17":
        after = to_information(result.posterior, options.ridge)
        before = to_information(result.predicted, options.ridge)
        return np.concatenate(
            [pack_symmetric(after.matrix), after.vector, pack_symmetric(before.matrix), before.vector]
        )
    information = _position_information(result, options)
    return np.concatenate([pack_symmetric(information.matrix), information.vector])


def packed_size(n_states: int, options: FusionOptions) -> int:
    """How many numbers `pack` gives, for D states."""
    size = n_states if options.rule == "eq17" else n_states // 2
    return (size * (size + 1) // 2 + size) * (2 if options.rule == "eq17" else 1)


def _position_information(result: LocalResult, options: FusionOptions) -> Information:
    if options.rule == "net_information":
        return net_information(result.posterior.position(), result.predicted.position(), options.ridge)
    # halfway between prior and posterior, where the fused result will be
    halfway = reweight(result.prior, 0.5 * result.log_likelihoods)
    return fit_log_quadratic(halfway.positions, result.log_likelihoods, halfway.weights)


def is_density(result: LocalResult, options: FusionOptions) -> bool:
    """Whether p⁻¹ - r⁻¹ of a camera is positive semidefinite, as Eq. 17 takes for granted."""
    if options.rule != "eq17":
        return True
    after = to_information(result.posterior, options.ridge).matrix
    return _is_semidefinite(after - to_information(result.predicted, options.ridge).matrix)


def _is_semidefinite(matrix: Float[np.ndarray, "D D"]) -> bool:
    return bool(np.linalg.eigvalsh(matrix)[0] >= -1e-9 * np.abs(matrix).max())


def unpack(average: Float[np.ndarray, " K"], n_cameras: int, n_states: int, options: FusionOptions) -> Fused:
    """The network's sum from its average (Eq. 15-16).

    Args:
        average: Of the cameras' packed vectors.
        n_cameras: How many cameras it is the average of.
        n_states: D.
        options: The rule that packed it.
    """
    gain, size = n_cameras * average, n_states // 2
    if options.rule == "eq17":
        # N(χ; u, p) / N(χ; v, r), with p⁻¹ = N X_c1, p⁻¹u = N x_c2, r⁻¹ = N X_c3, r⁻¹v = N x_c4
        after, before = np.split(gain, 2)
        gain, size = after - before, n_states
    split = size * (size + 1) // 2
    matrix = unpack_symmetric(gain[:split], size)
    return Fused(Information(matrix, gain[split:]), _is_semidefinite(matrix))


def reweight_by_ratio(predicted: Particles, fused: Fused) -> Particles:
    """ω(k) = ω(k-1) N(χ; u, p) / N(χ; v, r), with the prior as proposal (Eq. 17)."""
    points = predicted.states[:, : len(fused.gain.vector)]
    center = predicted.weights @ points
    return reweight(predicted, log_factor(points, fused.gain, center))


def draw_optimal(
    previous: Particles, fused: Fused, motion: MotionModel, rng: np.random.Generator
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


def fuse(
    previous: Particles,
    predicted: Particles,
    fused: Fused,
    motion: MotionModel,
    options: FusionOptions,
    rng: np.random.Generator,
) -> Particles:
    """The fusion filter's posterior from its particles of the frame before and the fused factor.

    Args:
        previous: The particles of the frame before.
        predicted: The same, propagated: drawn from the prior.
        fused: From `unpack`.
        motion: The state model.
        options: The proposal.
        rng: The fusion filter's stream.
    """
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
