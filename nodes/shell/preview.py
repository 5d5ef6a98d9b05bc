"""What a camera shows to people who look: its picture as a JPEG, and a thinned sample of its particles."""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from network.wire.messages import PreviewMessage
from nodes.filtering.particles import Particles, systematic_indices

N_SHOWN = 100
"""Particles of a preview, at most."""
JPEG_QUALITY = 80
"""In percent; a picture of 640 x 480 has some 40 kB."""
_DECIMALS = 4  # tenths of a millimetre


def preview(
    run: str, node: str, frame: int, time_s: float, image: UInt8[np.ndarray, "H W 3"], particles: Particles
) -> PreviewMessage:
    """The preview of a frame.

    Args:
        run: Name of the run.
        node: The camera.
        frame: The frame.
        time_s: Its time, seconds from frame 0.
        image: The picture, BGR.
        particles: Of the fusion filter, after the frame.
    """
    shown = thinned(particles, N_SHOWN).round(_DECIMALS)
    return PreviewMessage(run, node, frame, time_s, shown, encode_jpeg(image))


def encode_jpeg(image: UInt8[np.ndarray, "H W 3"]) -> bytes:
    """A picture, BGR, as JPEG."""
    _, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return jpeg.tobytes()


def thinned(particles: Particles, n: int) -> Float[np.ndarray, "M A"]:
    """Positions of at most n particles that stand for all: every particle as often as its weight asks.

    Systematic resampling from the middle of each stratum, and every so-many-th of the result: nothing is
    drawn, so that looking at a filter changes no random numbers.
    """
    indices = systematic_indices(particles.weights, 0.5)
    every = -(-len(indices) // n)
    return particles.positions[indices[::every]]
