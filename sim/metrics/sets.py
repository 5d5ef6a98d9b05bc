"""OSPA and GOSPA: one distance for where the target is and for whether it is there at all.

Both compare a set of estimates with a set of truths. Here either has at most one target in it, so that the
assignment of one to the other is plain and the sums have one term.

Sources: Schuhmacher, Vo & Vo (2008), Eq. 3; Rahmathullah, García-Fernández & Svensson (2017), Eq. 1.
"""

import numpy as np
from jaxtyping import Float


def ospa(errors: Float[np.ndarray, " T"], cutoff: float) -> Float[np.ndarray, " T"]:
    """OSPA in each frame: min(c, ‖x - y‖), and c where the one target has no estimate. Any order p.

    Args:
        errors: Distance between estimate and truth in each frame; NaN where there is no estimate.
        cutoff: c, in the errors' unit: an estimate that is farther away is as bad as none.
    """
    return np.where(np.isnan(errors), cutoff, np.fmin(errors, cutoff))


def gospa(errors: Float[np.ndarray, " T"], cutoff: float, order: float = 2) -> Float[np.ndarray, " T"]:
    """GOSPA (α = 2) in each frame: min(c, ‖x - y‖), and c / 2^(1/p) where the one target has no estimate.

    A target that is farther than c from its estimate counts as one missed and one false: c in all.

    Args:
        errors: Distance between estimate and truth in each frame; NaN where there is no estimate.
        cutoff: c, in the errors' unit: an estimate that is farther away is as bad as none.
        order: p, at least 1.
    """
    return np.where(np.isnan(errors), cutoff / 2 ** (1 / order), np.fmin(errors, cutoff))
