"""When a filter has lost the target, and how long it takes to find it again."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sim.metrics.errors import LOST_ERROR, LOST_FRAMES


@dataclass(frozen=True, slots=True)
class Loss:
    """One time of being lost.

    Attributes:
        first: The first frame of it.
        found: The frame in which the target was found again, None if it was not.
    """

    first: int
    found: int | None


def losses(errors: Float[np.ndarray, " T"], limit: float = LOST_ERROR) -> tuple[Loss, ...]:
    """The times in which the error stays above a limit, or unknown, for five frames or more.

    It ends with the first frame whose error is not.

    Args:
        errors: By frame; NaN where there is no estimate.
        limit: In the errors' unit.
    """
    astray = np.isnan(errors) | (errors > limit)
    # Where it goes astray, and where it comes back.
    turns = np.diff(np.concatenate([[0], astray.astype(int), [0]]))
    starts, ends = np.flatnonzero(turns == 1), np.flatnonzero(turns == -1)
    return tuple(
        Loss(int(start), int(end) if end < len(errors) else None)
        for start, end in zip(starts, ends, strict=True)
        if end - start >= LOST_FRAMES
    )
