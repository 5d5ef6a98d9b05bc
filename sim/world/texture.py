"""Textures: pictures of flat surfaces, seen straight on."""

import cv2
import numpy as np
from jaxtyping import UInt8

COARSE = 4  # soft shading is computed this much coarser than a texture

Texture = UInt8[np.ndarray, "_ _ 3"]
"""Blue, green and red."""


def cloudy(texture: Texture, strength: float, rng: np.random.Generator) -> Texture:
    """A texture with smooth variations of brightness and, less, of colour."""
    height, width = texture.shape[:2]
    size = (width // COARSE, height // COARSE)
    clouds = np.full((size[1], size[0], 3), 128.0, np.float32)
    for cells, amplitude in ((6, 0.7), (24, 0.5), (96, 0.4)):
        shape = (max(2, cells * height // max(width, height)), max(2, cells * width // max(width, height)))
        color = rng.standard_normal((*shape, 1)) + 0.3 * rng.standard_normal((*shape, 3))
        coarse = (strength * amplitude * color).astype(np.float32)
        clouds += cv2.resize(coarse, size, interpolation=cv2.INTER_CUBIC)
    variations = cv2.resize(np.clip(clouds, 0, 255).astype(np.uint8), (width, height))
    return cv2.addWeighted(texture, 1.0, variations, 1.0, -128.0).astype(np.uint8, copy=False)
