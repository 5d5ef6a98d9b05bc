"""Where a camera's pictures come from: anything that gives frame after frame. Video files live here."""

from pathlib import Path
from typing import Protocol, runtime_checkable

import cv2
import numpy as np
from jaxtyping import UInt8


class SourceError(Exception):
    """A picture cannot be had; the text names the file and what to do."""


@runtime_checkable
class FrameSource(Protocol):
    """Gives the pictures of one camera."""

    def read(self, index: int) -> UInt8[np.ndarray, "H W 3"]:
        """The picture of a frame, blue, green, red as in OpenCV; asked for in increasing order."""

    def close(self) -> None:
        """Gives back what the source holds open."""


class VideoSource:
    """The frames of a video file, optionally from a later one on, and at reduced size."""

    def __init__(self, path: Path, scale: float = 1.0, first_frame: int = 0) -> None:
        """Opens a video.

        Args:
            path: The file.
            scale: Size of the pictures against the video's, above 0, at most 1; see
                :func:`nodes.imaging.calibration.scaled` for the camera that goes with it.
            first_frame: The frame of the file that is frame 0 here.

        Raises:
            SourceError: There is no such file, or it is no video that OpenCV decodes.
        """
        if not path.is_file():
            raise SourceError(f"{path}: there is no such video: check the path")
        self._path = path
        self._scale = scale
        self._first = first_frame
        self._next = -first_frame
        self._capture = cv2.VideoCapture(str(path))
        if not self._capture.isOpened():
            raise SourceError(f"{path}: OpenCV cannot decode this video: convert it to MP4 (H.264)")

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the pictures, as ``cv2.resize`` rounds them."""
        sizes = [self._capture.get(each) for each in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)]
        return round(sizes[0] * self._scale), round(sizes[1] * self._scale)

    def read(self, index: int) -> UInt8[np.ndarray, "H W 3"]:
        """The picture of a frame, blue, green, red.

        Args:
            index: The frame, counted from 0; larger than at the last call.

        Raises:
            SourceError: The video ends before, or is damaged there.
            ValueError: The frame has gone by.
        """
        if index < self._next:
            raise ValueError(f"{self._path}: frame {index} has gone by, the next is {self._next}")
        while self._capture.grab():
            self._next += 1
            if self._next > index:
                return self._retrieve()
        raise SourceError(
            f"{self._path}: the video ends after {self._first + self._next} frames, frame "
            f"{self._first + index} was asked for: set frames to at most {max(self._next, 0)}"
        )

    def _retrieve(self) -> UInt8[np.ndarray, "H W 3"]:
        decoded, picture = self._capture.retrieve()
        if not decoded:
            raise SourceError(f"{self._path}: frame {self._next - 1} cannot be decoded: copy the file anew")
        if self._scale != 1:
            # By factor and not by size: the same exact scale on both axes, whatever the rounding.
            picture = cv2.resize(picture, None, fx=self._scale, fy=self._scale, interpolation=cv2.INTER_AREA)
        return np.asarray(picture, dtype=np.uint8)

    def close(self) -> None:
        """Closes the file."""
        self._capture.release()
