"""The state models: constant velocity, and an autoregression on the last two positions.

Sources: Jing & Chen, Eq. 1, 5 and 18, in seconds and the space's unit of length: the state is position and
velocity, [x, y, vx, vy] or [x, y, z, vx, vy, vz]. Medeiros et al. (2008), Eq. 2: it is this position and the
last one, [x, y, x_prev, y_prev]. The first half of a state is the position in both.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from network.options import Options

Matrix2 = tuple[tuple[float, float], tuple[float, float]]


class DynamicsOptions(Options):
    """How the target is expected to move from one frame to the next."""

    model: Literal["constant_velocity", "autoregressive"] = "constant_velocity"
    """`constant_velocity`: position and velocity, each with its noise; `autoregressive`: the next position is
    A times this one plus B times the last one, plus noise."""
    position_variance: float = Field(default=1e-3, gt=0)
    """Variance that a frame adds to each position axis, in m² (the paper's 10 cm²), in px² in the image
    plane."""
    velocity_variance: float = Field(default=1e-2, gt=0)
    """Variance that a frame adds to each velocity axis, in (m/s)² (the paper's 1 (cm/frame)² at 10 Hz), in
    (px/s)² in the image plane; for constant velocity only."""
    A: float | Matrix2 = 1.5
    """Weight of this position, a number or a 2 x 2 matrix (autoregressive). A = 2, B = -1 keeps the velocity,
    A = 1, B = 0 forgets it; between them it fades."""
    B: float | Matrix2 = -0.5
    """Weight of the last position. Where A + B is not 1, the target is drawn to the origin or away from
    it."""


@dataclass(frozen=True, eq=False)
class MotionModel:
    """x(k) = F x(k-1) + ξ(k), ξ ~ N(0, diag(variances)) (Eq. 1).

    Attributes:
        F: Transition matrix.
        variances: Diagonal of the process noise's covariance Q, per frame; 0 where the state only remembers.
    """

    F: Float[np.ndarray, "D D"]
    variances: Float[np.ndarray, " D"]

    @property
    def n_axes(self) -> int:
        """Axes of the position: 2 on a plane, 3 in a volume."""
        return len(self.variances) // 2

    @cached_property
    def deviations(self) -> Float[np.ndarray, "D M"]:
        """G, the root of Q without its columns of zeros: from M independent normals to ξ."""
        return np.diag(np.sqrt(self.variances))[:, self.variances > 0]


def constant_velocity(n_axes: int, interval: float, options: DynamicsOptions) -> MotionModel:
    """The model of Eq. 18 for a position of `n_axes` axes and frames `interval` seconds apart."""
    F = np.eye(2 * n_axes)
    F[:n_axes, n_axes:] = interval * np.eye(n_axes)
    variances = np.repeat([options.position_variance, options.velocity_variance], n_axes)
    return MotionModel(F, variances)


def autoregression(n_axes: int, options: DynamicsOptions) -> MotionModel:
    """x(t+1) = A x(t) + B x(t-1) + n, n ~ N(0, σ² I) (Medeiros et al. 2008, Eq. 2).

    Args:
        n_axes: Axes of the position.
        options: A and B, numbers, or matrices where there are two axes; σ² is the position variance.
    """
    # [x(t+1), x(t)] = [A B; I 0] [x(t), x(t-1)] + [n, 0]
    F = np.zeros((2 * n_axes, 2 * n_axes))
    F[:n_axes, :n_axes] = _matrix(options.A, n_axes)
    F[:n_axes, n_axes:] = _matrix(options.B, n_axes)
    F[n_axes:, :n_axes] = np.eye(n_axes)
    return MotionModel(F, np.repeat([options.position_variance, 0.0], n_axes))


def _matrix(weight: float | Matrix2, n_axes: int) -> Float[np.ndarray, "A A"]:
    return np.array(weight) if isinstance(weight, tuple) else weight * np.eye(n_axes)


def motion_model(n_axes: int, interval: float, options: DynamicsOptions) -> MotionModel:
    """The model that the options name, for frames `interval` seconds apart."""
    if options.model == "autoregressive":
        return autoregression(n_axes, options)
    return constant_velocity(n_axes, interval, options)


def transition(states: Float[np.ndarray, "N D"], model: MotionModel) -> Float[np.ndarray, "N D"]:
    """F x of every particle, without noise."""
    # One row a component: NumPy is quick along the long axis only.
    return model.F.dot(states.T).T


def predict(
    states: Float[np.ndarray, "N D"], model: MotionModel, rng: np.random.Generator
) -> Float[np.ndarray, "N D"]:
    """Draws from the prior P(x(k) | x(k-1)), the proposal of the SIR filter."""
    # x(k) = F x(k-1) + ξ(k), ξ = G n: nothing is drawn for what only remembers
    G = model.deviations
    moved = transition(states, model)
    moved += G.dot(rng.standard_normal((G.shape[1], len(states)))).T
    return moved
