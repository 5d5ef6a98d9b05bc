"""A recording as a run: what it found, and its cameras' pictures, for whoever draws runs."""

from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from network.errors import RefusedMessage
from network.wire import codec, keys
from network.wire.messages import EstimateMessage, StatusMessage, TruthMessage
from nodes.imaging.sources import FrameSource, SourceError
from sim.assembly import Assembly
from sim.recording.reader import McapRecording
from sim.results.results import Results


def results_of(recording: McapRecording) -> Results:
    """What a run has found, as its recording tells."""
    results = Results(recording.scenario)
    kinds: dict[str, type[EstimateMessage | TruthMessage | StatusMessage]] = {
        kind.kind: kind for kind in (EstimateMessage, TruthMessage, StatusMessage)
    }
    for frame in range(recording.frames):
        for key, data in recording.at(frame, pictures=False):
            kind = kinds.get(key.rpartition("/")[2])
            if kind is not None:
                with suppress(RefusedMessage):
                    results.add(codec.decode_public(kind, data))
    return results


@dataclass(frozen=True, slots=True)
class FilmedSource:
    """The pictures of a camera in a recording."""

    recording: McapRecording
    camera: str

    def read(self, index: int) -> UInt8[np.ndarray, "H W 3"]:
        """The picture of a frame, BGR.

        Raises:
            SourceError: It was not recorded.
        """
        key = keys.preview(self.recording.scenario.name, self.camera)
        data = dict(self.recording.at(index, pictures=True)).get(key)
        image = None if data is None else cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            raise SourceError(
                f"the recording has no picture of {self.camera} at frame {index}: name the run's folder"
            )
        return np.asarray(image, dtype=np.uint8)

    def close(self) -> None:
        """The recording stays open."""


@dataclass(frozen=True, eq=False)
class FilmedAssembly(Assembly):
    """A run whose cameras' pictures are those that were recorded."""

    recording: McapRecording

    def source(self, camera: str) -> FrameSource:
        """The recorded pictures of a camera."""
        return FilmedSource(self.recording, camera)


@contextmanager
def opened(path: Path) -> Iterator[tuple[Results, Assembly]]:
    """A recording, for whoever draws runs.

    Raises:
        RecordingError: It cannot be read.
    """
    with closing(McapRecording(path)) as recording:
        yield results_of(recording), FilmedAssembly(recording.scenario, recording)
