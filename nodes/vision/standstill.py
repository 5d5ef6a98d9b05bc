"""Whether a camera still looks where it did in its first picture: who has been knocked sees things elsewhere.

As in Ribnick et al., "Real-time detection of camera tampering" (AVSS 2006), what a picture shows is held
against an older one of the same camera. Here it is fine structure on a grid, block by block, so that changes
of light count for nothing, and what moves before the background for little: the median block tells.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8

ROWS = 120
"""About how many rows of pixels are looked at: a shift counts by the part of the picture that it is."""
BLOCK = 12
"""Side of a block, in pixels of the grid."""
SMOOTH = 9
"""Side of the square, in pixels of the grid, whose mean is taken away: what is left is fine structure."""
NOTHING = 1e-6
"""Energy of a block below which there is nothing to see, in squared grey levels."""


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """The fine structure of a camera's first picture.

    Attributes:
        structure: On the grid.
        energy: Mean square of each block.
        textured: The half of the blocks that show most.
    """

    structure: Float32[np.ndarray, "h w"]
    energy: Float32[np.ndarray, "b c"]
    textured: Bool[np.ndarray, "b c"]


def background_of(image: UInt8[np.ndarray, "H W 3"]) -> Background:
    """Keeps what `likeness` needs of a picture."""
    structure = _structure(image)
    energy = _block_means(structure * structure)
    return Background(structure, energy, energy >= np.median(energy))


def likeness(image: UInt8[np.ndarray, "H W 3"], background: Background) -> float:
    """The correlation of a picture with the first one, in the median block: 1 for the same, 0 for another."""
    structure, y = _structure(image), background.structure
    # ρ = Σxy / sqrt(Σx² Σy²) of each block
    product = _block_means(structure * y)
    energy = np.maximum(_block_means(structure * structure) * background.energy, NOTHING**2)
    return float(np.median((product / np.sqrt(energy))[background.textured]))


class Standstill:
    """Whether one camera has been knocked, over its frames.

    Attributes:
        knocked: In how many `frames`, and the `first` of them; empty if in none.
    """

    def __init__(self) -> None:
        self.knocked: dict[str, int] = {}
        self._stood = False

    def holds(self, frame: int, *, like_the_first: bool) -> bool:
        """Whether the camera looks where it should in a frame.

        Args:
            frame: The frame.
            like_the_first: Whether its picture is like the first one. Where none has ever been, as where that
                was black, nothing can be told.
        """
        self._stood |= like_the_first
        if like_the_first or not self._stood:
            return True
        self.knocked = {
            "frames": self.knocked.get("frames", 0) + 1,
            "first": self.knocked.get("first", frame),
        }
        return False


def _structure(image: UInt8[np.ndarray, "H W 3"]) -> Float32[np.ndarray, "h w"]:
    step = max(1, len(image) // ROWS)
    # green is nearly what is bright
    grey = image[::step, ::step, 1].astype(np.float32)
    return np.asarray(grey - cv2.blur(grey, (SMOOTH, SMOOTH)))


def _block_means(values: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "b c"]:
    height, width = values.shape
    size = max(1, width // BLOCK), max(1, height // BLOCK)
    return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_AREA))
