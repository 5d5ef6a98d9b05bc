"""Light and sensor: from the colours of things to grey levels."""

from typing import Annotated

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from pydantic import Field, field_validator

from network.options import Options
from network.streams import stream
from nodes.imaging.camera import Camera
from sim.world.curves import Curve, curve, require_increasing

_NEUTRAL_K = 6500.0
_WAVELENGTHS_UM = np.array([0.465, 0.550, 0.610])  # where the blue, green and red pixels are most sensitive
_SECOND_RADIATION_CONSTANT = 14387.77  # hc/k, micrometre kelvin
_PLAY_PX = 64  # the noise field is this much larger than a picture


class LightOptions(Options):
    """The light at a time."""

    time_s: Annotated[float, Field(allow_inf_nan=False)]
    """Seconds since the run's first frame."""
    brightness: Annotated[float, Field(ge=0, le=4)] = 1.0
    """1 shows colours as they are."""
    temperature_k: Annotated[float, Field(ge=2000, le=20000)] = _NEUTRAL_K
    """Colour temperature, kelvin: 6500 is neutral, less is warmer."""


class LightingOptions(Options):
    """How the light changes, and how cameras differ in their answer to it."""

    keyframes: Annotated[tuple[LightOptions, ...], Field(min_length=1)] = (LightOptions(time_s=0.0),)
    """The light over time, joined smoothly; constant before the first and after the last."""
    camera_spread: Annotated[float, Field(ge=0, le=0.3)] = 0.03
    """Standard deviation of each camera's gain in each colour."""

    @field_validator("keyframes")
    @classmethod
    def _in_order(cls, keyframes: tuple[LightOptions, ...]) -> tuple[LightOptions, ...]:
        require_increasing([keyframe.time_s for keyframe in keyframes])
        return keyframes


def build_light(options: LightingOptions) -> Curve:
    """Brightness and colour temperature over time."""
    frames = options.keyframes
    return curve([k.time_s for k in frames], [(k.brightness, k.temperature_k) for k in frames])


def gain_at(light: Curve, time_s: float) -> Float[np.ndarray, " 3"]:
    """What the light does to blue, green and red.

    The colours of a black body, by Wien's approximation, relative to those of neutral light and to green.
    """
    brightness, temperature_k = light.at(time_s)
    # L(λ, T) ∝ exp(-c₂ / λT)
    exponent = -_SECOND_RADIATION_CONSTANT / _WAVELENGTHS_UM * (1 / temperature_k - 1 / _NEUTRAL_K)
    return brightness * np.exp(exponent - exponent[1])


class Sensor:
    """The sensor of a camera: its own gain for each colour, and its noise."""

    def __init__(self, camera: Camera, noise: float, gain_spread: float, seed: int) -> None:
        """Draws the noise once, as a field larger than a picture; every frame shows another part of it.

        Args:
            camera: The camera.
            noise: Standard deviation, grey levels.
            gain_spread: Standard deviation of the gains among cameras.
            seed: The run's seed.
        """
        self._camera = camera
        rng = stream(seed, "world", camera.name, "sensor")
        self.gain = 1 + gain_spread * np.clip(rng.standard_normal(3), -3, 3)
        shape = (camera.height_px + _PLAY_PX, camera.width_px + _PLAY_PX, 3)
        field = np.rint(noise * rng.standard_normal(shape, dtype=np.float32))
        # no two of so many frames show the same part
        self._corners = rng.permutation((_PLAY_PX + 1) ** 2)
        # two unsigned halves: saturating addition and subtraction are the fastest way to add noise
        self._brighter = np.clip(field, 0, 255).astype(np.uint8)
        self._darker = np.clip(-field, 0, 255).astype(np.uint8)

    def read_out(self, exposed: UInt8[np.ndarray, "H W 3"], index: int) -> UInt8[np.ndarray, "H W 3"]:
        """Adds the noise of one frame to a picture.

        Args:
            exposed: The picture without noise; it is overwritten.
            index: The frame's number.

        Returns:
            The same picture with noise.
        """
        y, x = divmod(int(self._corners[index % len(self._corners)]), _PLAY_PX + 1)
        part = np.s_[y : y + self._camera.height_px, x : x + self._camera.width_px]
        cv2.add(exposed, self._brighter[part], dst=exposed)
        cv2.subtract(exposed, self._darker[part], dst=exposed)
        return exposed
