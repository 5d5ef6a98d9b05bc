"""Whether a filter still learns anything: how it knows, without the truth, that it has lost the target."""

from dataclasses import dataclass

import numpy as np

from nodes.filtering.gaussian import Moments, regularized

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

    def after(self, predicted: Moments, posterior: Moments) -> "Sighting":
        """The count after another frame, from the position's moments before and after its measurements."""
        r = regularized(predicted.covariance, NEGLIGIBLE)
        p = regularized(posterior.covariance, NEGLIGIBLE)
        # tr(r⁻¹ p) / A is 1 where nothing was learnt
        ratio = np.trace(np.linalg.solve(r, p)) / len(predicted.mean)
        return Sighting(0 if ratio < 1 - LEARNT else self.unseen + 1)
