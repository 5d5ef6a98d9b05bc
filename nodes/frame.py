"""A frame under way, and whether its picture is one at all."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import UInt8

from nodes.filtering.particles import Particles
from nodes.vision.observation import Picture


@dataclass(frozen=True, slots=True, eq=False)
class FrameInProgress:
    """What a camera keeps of a frame while its neighbours' messages come in.

    Attributes:
        index: The frame.
        picture: Its picture.
        since: The last frame that was done when it began.
        previous: The particles of the frame before, as far as they were known then.
        predicted: The same, propagated.
        usable: Whether the picture is a measurement: new, and of what the camera should look at.
    """

    index: int
    picture: Picture
    since: int
    previous: Particles
    predicted: Particles
    usable: bool = True


def is_new(image: UInt8[np.ndarray, "H W 3"], last: UInt8[np.ndarray, "H W 3"] | None) -> bool:
    """Whether a picture differs from the one before, as a sensor's noise alone makes it.

    A camera that hangs gives the same picture again. That is no measurement independent of the last one, as
    Eq. 12 takes for granted, and tells nothing new.

    Args:
        image: The picture.
        last: The one before, None before the first.
    """
    few = slice(None, None, 16)
    # a few pixels tell nearly all pictures apart, the others are compared whole
    if last is None or not np.array_equal(image[few, few], last[few, few]):
        return True
    return not np.array_equal(image, last)
