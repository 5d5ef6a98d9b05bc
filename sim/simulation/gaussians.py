"""The filters of all nodes at once, in closed form: what particles approach where measurements are Gaussian.

Every node has its own estimate. The fusion rules are those of the nodes (`nodes.filtering.rules`), with the
nodes along the first axis; the fusion filter is the Kalman filter's step in place of the particles'. The last
row, behind the cameras' nodes, is a central node that has all measurements: its filter is the exact one.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from nodes.filtering.gaussian import Information, Moments, to_information, to_moments
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


def with_all(told: Information) -> Information:
    """What the cameras were told, and in a row more the sum of it: what a central node would have."""
    return Information(
        np.concatenate([told.matrix, told.matrix.sum(axis=-3, keepdims=True)], axis=-3),
        np.concatenate([told.vector, told.vector.sum(axis=-2, keepdims=True)], axis=-2),
    )


def predict(moments: Moments, F: Float[np.ndarray, "D D"], Q: Float[np.ndarray, "D D"]) -> Moments:
    """The predictions v = F u and r = F p Fᵀ + Q."""
    return Moments(moments.mean @ F.T, F @ moments.covariance @ F.T + Q)


def fused(local: GaussianEstimate, answer: Information | Moments) -> Moments:
    """The fusion filters' posteriors from what the rule made of the averages.

    Args:
        local: Of the frame, the central node's in the last row.
        answer: A factor on the own prediction, or the posterior itself.

    Returns:
        The posteriors; a node whose answer is no density keeps its prediction. The central node's is the
        exact one, whatever the rule.
    """
    if isinstance(answer, Information):
        # NaN, where it is no density
        posterior = to_moments(plus_on_position(local.before, answer))
        lost = ~np.isfinite(posterior.covariance[:, 0, 0])
    else:
        posterior = _with_exact(answer, local)
        lost = ~np.isfinite(posterior.covariance[:, 0, 0])
        lost[~lost] = np.linalg.eigvalsh(posterior.covariance[~lost])[:, 0] <= 0
    if lost.any():
        posterior.mean[lost] = local.predicted.mean[lost]
        posterior.covariance[lost] = local.predicted.covariance[lost]
    return posterior


def _with_exact(posterior: Moments, local: GaussianEstimate) -> Moments:
    """The posteriors of a rule, the last one by p⁻¹ = r⁻¹ + Λ with all measurements."""
    before, told = (Information(each.matrix[-1:], each.vector[-1:]) for each in (local.before, local.told))
    exact = to_moments(plus_on_position(before, told))
    return Moments(
        np.concatenate([posterior.mean[:-1], exact.mean]),
        np.concatenate([posterior.covariance[:-1], exact.covariance]),
    )


def normalized_errors(moments: Moments, truth: Float[np.ndarray, "*T D"]) -> Float[np.ndarray, "*T C"]:
    """eᵀ p⁻¹ e of the positions over their axes: 1 on average where a filter knows how good it is."""
    position = moments.position()
    n_axes = position.mean.shape[-1]
    e = position.mean - truth[..., None, :n_axes]
    return np.vecdot(e, np.linalg.solve(position.covariance, e[..., None])[..., 0]) / n_axes
