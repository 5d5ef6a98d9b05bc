"""The pictures of an experiment: made once for all parts that share them, and sent in other codings."""

import time
from functools import cached_property, lru_cache

import cv2
import numpy as np
from jaxtyping import UInt8

from nodes.imaging.sources import FrameSource
from nodes.vision.color import ColorOptions, quantize
from sim.assembly import Assembly

Picture = UInt8[np.ndarray, "H W 3"]
Kept = dict[tuple[str, int], Picture]

KEPT_BYTES = 300_000_000
"""Pictures that a worker keeps for the next part; those of longer runs are made anew."""


@lru_cache(maxsize=1)
def kept_pictures(_key: str) -> Kept:
    """The pictures that this process has made already, by camera and frame; those of one key at a time."""
    return {}


class KeptSource:
    """A camera's pictures, each made once in this process.

    Attributes:
        spent_s: Processor time that the pictures took.
    """

    def __init__(self, assembly: Assembly, camera: str, kept: Kept) -> None:
        """The pictures of a camera of a run; nothing is opened before it is needed."""
        self.spent_s = 0.0
        self._assembly, self._name, self._kept = assembly, camera, kept
        cameras = assembly.cameras.values()
        size = sum(3 * camera.width_px * camera.height_px for camera in cameras)
        self._keeps = size * assembly.scenario.frames <= KEPT_BYTES

    @cached_property
    def _source(self) -> FrameSource:
        return self._assembly.source(self._name)

    def read(self, index: int) -> Picture:
        """The picture of a frame, BGR; not to be written to."""
        found = self._kept.get((self._name, index))
        if found is not None:
            return found
        began = time.process_time()
        picture = self._source.read(index)
        self.spent_s += time.process_time() - began
        if self._keeps:
            picture.setflags(write=False)
            self._kept[self._name, index] = picture
        return picture

    def close(self) -> None:
        """Gives back what is open."""
        if "_source" in self.__dict__:
            self._source.close()


class CodedSource:
    """A camera's pictures as they arrive after JPEG, with the size of each way to send them.

    Attributes:
        jpeg_bytes: Of all pictures read, as JPEG.
        bins_bytes: Of all pictures read, as bin indices in PNG, which loses nothing: a filter on them finds
            what it finds on the raw pictures.
    """

    def __init__(self, source: KeptSource, quality: int, color: ColorOptions) -> None:
        """The pictures of another source, coded with JPEG's quality (1 to 100)."""
        self._source, self._quality, self._color = source, quality, color
        self._spent_s = 0.0
        self.jpeg_bytes = self.bins_bytes = 0

    @property
    def spent_s(self) -> float:
        """Processor time that the pictures and their coding took."""
        return self._source.spent_s + self._spent_s

    def read(self, index: int) -> Picture:
        """The picture of a frame as a receiver decodes it, BGR."""
        picture = self._source.read(index)
        began = time.process_time()
        _, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, self._quality])
        bins = np.ascontiguousarray(quantize(picture, self._color, np.ones(3)).transpose(1, 2, 0))
        _, png = cv2.imencode(".png", bins)
        self.jpeg_bytes += len(jpeg)
        self.bins_bytes += len(png)
        decoded = np.asarray(cv2.imdecode(jpeg, cv2.IMREAD_COLOR), dtype=np.uint8)
        self._spent_s += time.process_time() - began
        return decoded

    def close(self) -> None:
        """Gives back what is open."""
        self._source.close()
