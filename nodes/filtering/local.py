"""The local filter: what one camera's picture says about the target, in two Gaussians.

Source: Jing & Chen, section 3.1, Eq. 9-14.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from nodes.filtering.gaussian import Moments, moments
from nodes.filtering.particles import Particles, reweight


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
