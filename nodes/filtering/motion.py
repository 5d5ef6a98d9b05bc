"""The state model: constant velocity with independent noise on position and velocity.

Source: Jing & Chen, Eq. 1, 5 and 18, in metres and seconds. A state is [x, y, vx, vy] on a plane and
[x, y, z, vx, vy, vz] in a volume; the first half of it is the position.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from pydantic import Field

from network.options import Options


class DynamicsOptions(Options):
    """How the target is expected to move from one frame to the next."""

    position_variance: float = Field(default=1e-3, gt=0)
    """Variance that a frame adds to each position axis, in m² (the paper's 10 cm²)."""
    velocity_variance: float = Field(default=1e-2, gt=0)
    """Variance that a frame adds to each velocity axis, in (m/s)² (the paper's 1 (cm/frame)² at 10 Hz)."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionModel:
    """x(k) = F x(k-1) + ξ(k), ξ ~ N(0, diag(variances)) (Eq. 1).

    Attributes:
        F: Transition matrix.
        variances: Diagonal of the process noise's covariance Q, per frame.
    """

    F: Float[np.ndarray, "D D"]
    variances: Float[np.ndarray, " D"]

    @property
    def n_axes(self) -> int:
        """Axes of the position: 2 on a plane, 3 in a volume."""
        return len(self.variances) // 2


def constant_velocity(n_axes: int, interval: float, options: DynamicsOptions) -> MotionModel:
    """The model of Eq. 18 for a position of `n_axes` axes and frames `interval` seconds apart."""
    F = np.eye(2 * n_axes)
    F[:n_axes, n_axes:] = interval * np.eye(n_axes)
    variances = np.repeat([options.position_variance, options.velocity_variance], n_axes)
    return MotionModel(F, variances)


def transition(states: Float[np.ndarray, "N D"], model: MotionModel) -> Float[np.ndarray, "N D"]:
    """F x of every particle, without noise."""
    return states @ model.F.T


def predict(
    states: Float[np.ndarray, "N D"], model: MotionModel, rng: np.random.Generator
) -> Float[np.ndarray, "N D"]:
    """Draws from the prior P(x(k) | x(k-1)), the proposal of the SIR filter."""
    # x(k) = F x(k-1) + ξ(k)
    return transition(states, model) + np.sqrt(model.variances) * rng.standard_normal(states.shape)
