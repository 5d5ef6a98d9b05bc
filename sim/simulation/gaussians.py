"""The filters of all nodes at once, in closed form: what particles approach where measurements are Gaussian.

Every node has its own estimate. The fusion rules are those of the nodes (`nodes.filtering.rules`), with the
nodes along the first axis; the fusion filter is the Kalman filter's step in place of the particles'.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from nodes.filtering.gaussian import Information, Moments, to_information, to_moments
from nodes.filtering.motion import MotionModel
from nodes.filtering.rules.rule import LocalEstimate, plus_on_position


@dataclass(frozen=True, eq=False)
class GaussianEstimate(LocalEstimate):
    """What all local filters have found in a frame.

    Attributes:
        predicted: v and r.
        told: What each camera's measurement told about the position.
        ridge: Added to covariances' diagonals before they are inverted.
    """

    predicted: Moments
    told: Information
    ridge: float

    @cached_property
    def posterior(self) -> Moments:
        """Means u and covariances p."""
        return to_moments(self.after)

    @cached_property
    def after(self) -> Information:
        """p⁻¹ = r⁻¹ + Λ."""
        return plus_on_position(self.before, self.told)

    @cached_property
    def before(self) -> Information:
        """r⁻¹ and r⁻¹v."""
        return to_information(self.predicted, self.ridge)

    @property
    def measured(self) -> Information:
        """What the measurement told."""
        return self.told

    @property
    def fitted(self) -> Information:
        """The same: the log-likelihood is this quadratic."""
        return self.told


def predict(moments: Moments, motion: MotionModel) -> Moments:
    """The predictions v = F u and r = F p Fᵀ + Q."""
    F = motion.F
    return Moments(moments.mean @ F.T, F @ moments.covariance @ F.T + np.diag(motion.variances))


def fused(local: GaussianEstimate, answer: Information | Moments) -> Moments:
    """The fusion filters' posteriors from what the rule made of the averages.

    Args:
        local: Of the frame.
        answer: A factor on the own prediction, or the posterior itself.

    Returns:
        The posteriors; a node whose answer is no density keeps its prediction.
    """
    if isinstance(answer, Information):
        # NaN, where it is no density
        posterior = to_moments(plus_on_position(local.before, answer))
        sound = np.isfinite(posterior.covariance).all(axis=(1, 2))
    else:
        posterior = answer
        sound = np.isfinite(posterior.covariance).all(axis=(1, 2))
        sound[sound] = np.linalg.eigvalsh(posterior.covariance[sound])[:, 0] > 0
    return Moments(
        np.where(sound[:, None], posterior.mean, local.predicted.mean),
        np.where(sound[:, None, None], posterior.covariance, local.predicted.covariance),
    )


def summed(told: Information) -> Information:
    """All cameras' information about the position: what a central node would have."""
    return Information(told.matrix.sum(axis=0), told.vector.sum(axis=0))


def normalized_errors(moments: Moments, truth: Float[np.ndarray, " D"]) -> Float[np.ndarray, " C"]:
    """eᵀ p⁻¹ e of the positions over their axes: 1 on average where a filter knows how good it is."""
    position = moments.position()
    n_axes = position.mean.shape[1]
    e = position.mean - truth[:n_axes]
    return np.vecdot(e, np.linalg.solve(position.covariance, e[:, :, None])[:, :, 0]) / n_axes
