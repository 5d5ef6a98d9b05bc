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
    ridge: float = Field(default=1e-10, ge=0)
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


def _position_information(result: LocalResult, options: FusionOptions) -> Information:
    if options.rule == "net_information":
        return net_information(result.posterior.position(), result.predicted.position(), options.ridge)
    flat = np.all(result.log_likelihoods == result.log_likelihoods[0])
    if flat:
        n_axes = result.particles.positions.shape[1]
        return Information(np.zeros((n_axes, n_axes)), np.zeros(n_axes))
    # halfway between prior and posterior, where the fused result will be
    halfway = reweight(
        Particles(result.particles.states, np.log(np.maximum(result.prior_weights, 1e-300))),
        0.5 * result.log_likelihoods,
    )
    return fit_log_quadratic(result.particles.positions, result.log_likelihoods, halfway.weights)


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
    total = n_cameras * average
    if options.rule != "eq17":
        n_axes = n_states // 2
        split = n_axes * (n_axes + 1) // 2
        return Fused(Information(unpack_symmetric(total[:split], n_axes), total[split:]), is_density=True)
    # N(χ; u, p) / N(χ; v, r), with p⁻¹ = N X_c1, p⁻¹u = N x_c2, r⁻¹ = N X_c3, r⁻¹v = N x_c4
    split = n_states * (n_states + 1) // 2
    after, before = total[: split + n_states], total[split + n_states :]
    matrix = unpack_symmetric(after[:split] - before[:split], n_states)
    return Fused(Information(matrix, after[split:] - before[split:]), _is_semidefinite(matrix))


def reweight_by_ratio(predicted: Particles, fused: Fused) -> Particles:
    """ω(k) = ω(k-1) N(χ; u, p) / N(χ; v, r), with the prior as proposal (Eq. 17)."""
    points = predicted.states[:, : len(fused.gain.vector)]
    center = predicted.weights @ points
    return reweight(predicted, log_factor(points, fused.gain, center))


def draw_optimal(
    previous: Particles, fused: Fused, motion: MotionModel, rng: np.random.Generator
) -> Particles:
    """Draws from P(x(k) | x(k-1), fused factor), and weights by its normaliser.

    With a Gaussian factor exp(-½ xᵀΛx + xᵀη) on the position, the optimal proposal is closed (Doucet et al.
    2000): covariance Σ = (Q⁻¹ + Λ)⁻¹, mean Σ(Q⁻¹Fx + η).
    """
    n_axes = motion.n_axes
    moved = transition(previous.states, motion)
    # around the cloud's middle, so that the products below stay small
    center = previous.weights @ moved[:, :n_axes]
    y = moved[:, :n_axes] - center
    eta = fused.gain.vector - fused.gain.matrix @ center
    precision = 1 / motion.variances[:n_axes]
    # Σ = (Q⁻¹ + Λ)⁻¹, b = Q⁻¹Fx + η
    covariance = np.linalg.inv(np.diag(precision) + fused.gain.matrix)
    covariance = (covariance + covariance.T) / 2
    b = precision * y + eta
    # ω(k) = ω(k-1) exp(½ bᵀΣb - ½ (Fx)ᵀQ⁻¹Fx)
    normalizer = 0.5 * np.einsum("ni,ij,nj->n", b, covariance, b) - 0.5 * (y * y) @ precision
    # x(k) ~ N(Σb, Σ); the velocity's noise is independent of the position's
    noise = rng.standard_normal(moved.shape)
    positions = center + b @ covariance + noise[:, :n_axes] @ np.linalg.cholesky(covariance).T
    velocities = moved[:, n_axes:] + np.sqrt(motion.variances[n_axes:]) * noise[:, n_axes:]
    return reweight(Particles(np.hstack([positions, velocities]), previous.log_weights), normalizer)


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
        predicted: The same, propagated (used by the prior proposal).
        fused: From `unpack`.
        motion: The state model.
        options: The proposal.
        rng: The fusion filter's stream.
    """
    if options.proposal == "optimal" and fused.is_density:
        return draw_optimal(previous, fused, motion, rng)
    return reweight_by_ratio(predicted, fused)


def propagate(particles: Particles, motion: MotionModel, rng: np.random.Generator) -> Particles:
    """Propagated particles with their old weights."""
    return Particles(predict(particles.states, motion, rng), particles.log_weights)
