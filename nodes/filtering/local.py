"""The local filter: what one camera's picture says about the target, in two Gaussians.

Source: Jing & Chen, section 3.1, Eq. 9-14.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from nodes.filtering.gaussian import (
    Information,
    Moments,
    fit_log_quadratic,
    moments,
    net_information,
    to_information,
    with_smaller_steps,
)
from nodes.filtering.particles import Particles, reweight
from nodes.filtering.rules.rule import LocalEstimate


@dataclass(frozen=True, slots=True, eq=False)
class LocalResult:
    """What the local filter found.

    Attributes:
        predicted: v and r, before the measurement.
        posterior: u and p, after it.
        prior: The particles before it.
        particles: The same, reweighted.
        log_likelihoods: ℓ of each particle.
    """

    predicted: Moments
    posterior: Moments
    prior: Particles
    particles: Particles
    log_likelihoods: Float[np.ndarray, " N"]


def local_filter(predicted: Particles, log_likelihoods: Float[np.ndarray, " N"]) -> LocalResult:
    """Weights predicted particles with one camera's likelihoods.

    Args:
        predicted: Propagated particles with their old weights, the filter's own or the fusion filter's.
        log_likelihoods: ℓ of each.
    """
    # v, r: propagated particles with the weights not updated yet (Eq. 9-10)
    before = moments(predicted.states, predicted.weights)
    # ω(k) ∝ ω(k-1) P(z | χ(k)) (Eq. 12)
    posterior = reweight(predicted, log_likelihoods)
    # u, p: with the updated weights (Eq. 13-14)
    after = moments(posterior.states, posterior.weights)
    return LocalResult(before, after, predicted, posterior, log_likelihoods)


@dataclass(frozen=True, slots=True, eq=False)
class LocalGaussians(LocalEstimate):
    """A local filter's result in the forms that rules ask for; what no rule asks for costs nothing.

    Attributes:
        result: Of the local filter.
        ridge: Added to covariances' diagonals before they are inverted.
    """

    result: LocalResult
    ridge: float

    @property
    def posterior(self) -> Moments:
        """Mean u and covariance p."""
        return self.result.posterior

    @property
    def after(self) -> Information:
        """p⁻¹ and p⁻¹u."""
        return to_information(self.result.posterior, self.ridge)

    @property
    def before(self) -> Information:
        """r⁻¹ and r⁻¹v."""
        return to_information(self.result.predicted, self.ridge)

    @property
    def measured(self) -> Information:
        """The net information about the position, from the moments before and after."""
        return net_information(self.result.posterior.position(), self.result.predicted.position(), self.ridge)

    @property
    def fitted(self) -> Information:
        """The quadratic fitted to the log-likelihood over the particles, by the smaller steps."""
        # halfway between prior and posterior, where the fused result will be
        halfway = reweight(self.result.prior, 0.5 * self.result.log_likelihoods)
        fit = fit_log_quadratic(halfway.positions, self.result.log_likelihoods, halfway.weights)
        posterior, predicted = self.result.posterior.position(), self.result.predicted.position()
        return with_smaller_steps(fit, posterior, predicted, self.ridge)
