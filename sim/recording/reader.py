"""Reads recordings: what was told in each frame, under the keys of the network, byte for byte."""

import json
from collections.abc import Iterator
from pathlib import Path

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from mcap.exceptions import McapError
from mcap.reader import McapReader, make_reader

from network.wire import keys
from network.wire.messages import EstimateMessage, StatusMessage, TruthMessage
from sim.recording.film import SCENARIO
from sim.recording.foxglove import to_ns
from sim.recording.recovery import open_whole
from sim.results.recorder import RecordingError
from sim.scenario.model import Scenario

_PLAYED = frozenset(kind.kind for kind in (EstimateMessage, StatusMessage, TruthMessage))
"""What is told again; orders to a run, for one, are not."""


class McapRecording:
    """A recording with pictures.

    Attributes:
        scenario: As run.
        frames: How many are recorded.
    """

    def __init__(self, path: Path) -> None:
        """Opens a recording, also one that was cut off.

        Raises:
            RecordingError: It cannot be read, or is not of this simulator.
        """
        try:
            self._file = open_whole(path)
        except OSError as error:
            raise RecordingError(f"{path}: cannot be read: {error.strerror}: check the path") from error
        self._path = path
        self._reader: McapReader = make_reader(self._file)
        try:
            self._read_index()
        except (McapError, ValueError, LookupError, TypeError, StopIteration) as error:
            self.close()
            raise RecordingError(
                f"{path}: is no recording of a run: name one that `dcpf run --record` has written"
            ) from error

    def at(self, frame: int, *, pictures: bool) -> Iterator[tuple[str, bytes]]:
        """What was told of a frame: keys of the network and payloads.

        Raises:
            RecordingError: It is damaged there.
        """
        start, end = (to_ns(max(0.0, frame + half) / self.scenario.rate_hz) for half in (-0.5, 0.5))
        topics = [*self._told, *(self._images if pictures else ())]
        try:
            for _, channel, message in self._reader.iter_messages(
                topics, starting_at=start, ending_before=end
            ):
                if channel.topic in self._images:
                    yield self._images[channel.topic], CompressedImage.FromString(message.data).data
                else:
                    yield channel.topic, message.data
        except Exception as error:  # readers and decompressors raise whatever comes to them
            raise RecordingError(
                f"{self._path}: is damaged at frame {frame}: take a copy that is whole"
            ) from error

    def alive_at(self, frame: int) -> set[str] | None:
        """The nodes that were heard of at a frame; None where nobody listened for them."""
        alive: set[str] = set()
        for log_time, node, here in self._alive:
            if log_time <= to_ns(frame / self.scenario.rate_hz):
                (alive.add if here else alive.discard)(node)
        return alive if self._alive else None

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def _read_index(self) -> None:
        attached = next(each for each in self._reader.iter_attachments() if each.name == SCENARIO)
        self.scenario = Scenario.model_validate_json(attached.data)
        summary = self._reader.get_summary()
        topics = [channel.topic for channel in summary.channels.values()] if summary else []
        end_ns = summary.statistics.message_end_time if summary and summary.statistics else 0
        self.frames = min(1 + round(end_ns * 1e-9 * self.scenario.rate_hz), self.scenario.frames)
        run = self.scenario.name
        self._images = {f"/{each.name}/image": keys.preview(run, each.name) for each in self.scenario.cameras}
        own = [topic for topic in topics if topic.startswith(keys.of_run(run))]
        self._told = [topic for topic in own if topic.rpartition("/")[2] in _PLAYED]
        self._alive = [
            (message.log_time, keys.node_of(channel.topic), bool(json.loads(message.data)["alive"]))
            for _, channel, message in self._reader.iter_messages([k for k in own if k.endswith("/alive")])
        ]
