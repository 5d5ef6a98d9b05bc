"""The part of a scenario that says what a camera without pictures sees."""

from pydantic import Field

from network.options import Options


class SensorOptions(Options):
    """What a camera of `dcpf simulate` sees."""

    noise_px: float = Field(default=4.0, gt=0)
    """Standard deviation with which the target's middle is found in a picture, on each axis."""
    range_m: float = Field(default=15.0, gt=0)
    """Distance beyond which the target is too small to be seen."""
    occlusion: float = Field(default=0.1, ge=0, le=1)
    """Probability that something hides a target that is in view, in each camera and frame by itself."""
