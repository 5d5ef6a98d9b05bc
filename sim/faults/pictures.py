"""Cameras whose pictures are wrong: sources around sources."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import UInt8

from nodes.imaging.camera import Camera
from nodes.imaging.sources import FrameSource
from sim.faults.options import BlackOptions, FaultOptions, MiscalibrateOptions, PictureFault


class FaultySource:
    """The pictures of a camera with one fault."""

    def __init__(self, source: FrameSource, fault: PictureFault, knocked: FrameSource | None = None) -> None:
        """A camera before its first picture.

        Args:
            source: Its pictures.
            fault: What is wrong with some of them.
            knocked: The pictures from where the camera really is, for a wrong calibration.
        """
        self._source, self._fault, self._knocked = source, fault, knocked
        self._last: UInt8[np.ndarray, "H W 3"] | None = None

    def read(self, index: int) -> UInt8[np.ndarray, "H W 3"]:
        """The picture of a frame, BGR."""
        if not self._fault.holds(index):
            self._last = self._source.read(index)
            return self._last
        if self._knocked is not None:
            return self._knocked.read(index)
        picture = self._source.read(index)
        if isinstance(self._fault, BlackOptions):
            return np.zeros_like(picture)
        if self._last is None:
            self._last = picture
        return self._last

    def close(self) -> None:
        """Closes what it reads from."""
        self._source.close()
        if self._knocked is not None:
            self._knocked.close()


def with_faults(
    source: FrameSource,
    camera: Camera,
    faults: Sequence[FaultOptions],
    render: Callable[[Camera], FrameSource],
) -> FrameSource:
    """A camera's source with the faults that concern its pictures.

    Args:
        source: Without them.
        camera: Where it is by its calibration.
        faults: Those of the scenario.
        render: The pictures of a camera elsewhere.
    """
    for fault in faults:
        if isinstance(fault, PictureFault) and fault.node == camera.name:
            knocked = render(moved(camera, fault)) if isinstance(fault, MiscalibrateOptions) else None
            source = FaultySource(source, fault, knocked)
    return source


def moved(camera: Camera, fault: MiscalibrateOptions) -> Camera:
    """Where a camera that was knocked really is."""
    angle = np.deg2rad(fault.yaw_deg)
    # to the left, seen from above: the axes turn by +angle about z
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]]
    )
    R = camera.R @ turn.T
    return replace(camera, R=R, t=-R @ (camera.center + np.array(fault.offset)))
