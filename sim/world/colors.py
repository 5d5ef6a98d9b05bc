"""Colours: written '#rrggbb' by people, computed as blue, green, red in grey levels, OpenCV's order."""

from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

Color = Annotated[str, Field(pattern="^#[0-9a-fA-F]{6}$", examples=["#233ca5"])]
"""A colour as '#rrggbb'; YAML wants the quotes."""


def bgr(color: Color) -> Float[np.ndarray, " 3"]:
    """Blue, green and red of a colour, 0 to 255."""
    return np.array([int(color[i : i + 2], 16) for i in (5, 3, 1)], dtype=np.float64)
