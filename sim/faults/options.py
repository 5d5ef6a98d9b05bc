"""What can go wrong in a run, frame by frame; the scenario lists it under `faults`."""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, PositiveInt

from network.options import Options
from network.wire.keys import check_name

Name = Annotated[str, AfterValidator(check_name)]


class NodeFault(Options):
    """A fault of one camera's node, from the begin of a frame on; frame 0 is the initialisation."""

    frame: int = Field(ge=1)
    """When."""
    node: Name
    """Whose: a camera."""


class KillOptions(NodeFault):
    """The node's process ends without a word, for good."""

    kind: Literal["kill"]
    """What happens."""


class RestartOptions(NodeFault):
    """The node's process ends without a word, and a new one is started."""

    kind: Literal["restart"]
    """What happens."""
    frames: PositiveInt = 5
    """Frames of the others until it is started."""


class HangOptions(NodeFault):
    """The node's process is stopped, and goes on where it was."""

    kind: Literal["hang"]
    """What happens."""
    frames: PositiveInt = 5
    """Frames of the others until it goes on."""


class SlowOptions(NodeFault):
    """The node takes longer for its frames."""

    kind: Literal["slow"]
    """What happens."""
    seconds: float = Field(gt=0, le=3600)
    """How much longer, in s a frame."""
    frames: PositiveInt | None = None
    """For how many frames; null to the end."""


class RestartRouterOptions(Options):
    """The run's router ends and is started again; nodes talk to each other without it."""

    kind: Literal["restart_router"]
    """What happens."""
    frame: int = Field(ge=1)
    """When."""


class PictureFault(Options):
    """A fault of a camera's pictures; its node knows nothing of it."""

    frame: int = Field(ge=0)
    """The first such picture."""
    node: Name
    """Whose."""
    frames: PositiveInt | None = None
    """For how many frames; null to the end."""

    def holds(self, frame: int) -> bool:
        """Whether a frame's picture has it."""
        return self.frame <= frame and (self.frames is None or frame < self.frame + self.frames)


class BlackOptions(PictureFault):
    """The pictures are black."""

    kind: Literal["black"]
    """What happens."""


class FreezeOptions(PictureFault):
    """The camera gives the same picture again and again: the last one before the fault."""

    kind: Literal["freeze"]
    """What happens."""


class MiscalibrateOptions(PictureFault):
    """The camera has been knocked: it looks elsewhere than its calibration says. In rendered worlds only."""

    kind: Literal["miscalibrate"]
    """What happens."""
    yaw_deg: float = Field(default=0.0, ge=-180, le=180)
    """By how many degrees it is turned to the left, about the plumb line."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """By how much it is moved, in m."""


FaultOptions = Annotated[
    KillOptions
    | RestartOptions
    | HangOptions
    | SlowOptions
    | RestartRouterOptions
    | BlackOptions
    | FreezeOptions
    | MiscalibrateOptions,
    Field(discriminator="kind"),
]
"""One thing that goes wrong, by its `kind`."""


def require_possible(
    faults: Sequence[FaultOptions], cameras: Sequence[str], frames: int, *, rendered: bool
) -> None:
    """Checks that every fault can happen.

    Args:
        faults: Those of a scenario.
        cameras: Its cameras' names.
        frames: Its frames.
        rendered: Whether its world is rendered.

    Raises:
        ValueError: One cannot.
    """
    for fault in faults:
        if fault.frame >= frames:
            raise ValueError(
                f"faults has a {fault.kind} at frame {fault.frame}: the run ends with frame {frames - 1},"
                " take an earlier one"
            )
        if not isinstance(fault, RestartRouterOptions) and fault.node not in cameras:
            raise ValueError(
                f"faults has a {fault.kind} of {fault.node}, which is no camera: name one of"
                f" {', '.join(cameras)}"
            )
        if isinstance(fault, MiscalibrateOptions) and not rendered:
            raise ValueError(
                f"faults has a miscalibrate of {fault.node}: only a rendered world shows what a camera"
                " elsewhere sees, take the fault out"
            )
