"""Whether a filter still learns anything: how it knows, without the truth, that it has lost the target."""

from dataclasses import dataclass

import numpy as np

from nodes.filtering.gaussian import Information, Moments, regularized

LEARNT = 0.05
"""Least relative shrinkage of the position's covariance in a frame in which something was seen."""
PATIENCE = 4
"""Frames without anything learnt after which the target counts as lost."""
NEGLIGIBLE = 1e-9
"""A position's variance in m² below which a filter has nothing left to learn."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """How many frames in a row the measurements told nothing."""

    unseen: int = 0

    @property
    def lost(self) -> bool:
        """Whether nothing was learnt for too long."""
        return self.unseen >= PATIENCE

    def after(self, ratio: float) -> "Sighting":
        """The count after another frame.

        Args:
            ratio: How much of the position's covariance its measurements left, 1 where nothing was learnt.
        """
        return Sighting(0 if ratio < 1 - LEARNT else self.unseen + 1)


def shrinkage(predicted: Moments, posterior: Moments) -> float:
    """The part of a covariance that measurements left, tr(r⁻¹ p) / A, from the moments before and after."""
    r = regularized(predicted.covariance, NEGLIGIBLE)
    p = regularized(posterior.covariance, NEGLIGIBLE)
    return float(np.trace(np.linalg.solve(r, p)) / len(predicted.mean))


def shrinkage_by(gain: Information, predicted: Moments) -> float:
    """The part of the position's covariance that a fused factor leaves, tr((I + r Λ)⁻¹) / A.

    From the factor itself, since two samples' moments differ by chance as well. What takes information away,
    as Eq. 17's difference can, counts as nothing.
    """
    n_axes = len(predicted.mean) // 2
    L = np.linalg.cholesky(regularized(predicted.covariance[:n_axes, :n_axes], NEGLIGIBLE))
    gained = np.linalg.eigvalsh(L.T @ gain.matrix[:n_axes, :n_axes] @ L)
    return float(np.mean(1 / (1 + np.maximum(gained, 0.0))))
