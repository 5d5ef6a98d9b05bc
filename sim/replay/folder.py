"""The folder of a run as a recording: estimates and truth; pictures come from where the run's came."""

import json
from collections.abc import Iterator
from contextlib import suppress
from functools import cached_property
from pathlib import Path

import numpy as np

from network.wire import codec, keys
from network.wire.messages import PreviewMessage
from nodes.imaging.sources import FrameSource
from nodes.shell.preview import encode_jpeg
from sim.assembly import Assembly
from sim.results.recorder import ESTIMATORS, read_run


class FolderRecording:
    """A run that was recorded without pictures.

    Attributes:
        scenario: As run.
        frames: How many are recorded.
    """

    def __init__(self, folder: Path) -> None:
        """Reads the folder.

        Raises:
            RecordingError: It is no folder of a run.
            ScenarioError: Its scenario cannot be read.
        """
        self._results = read_run(folder)
        self.scenario = self._results.scenario
        self.frames = max(1, self._results.frames_done)
        self._events = list(_events(folder / "events.jsonl"))
        self._sources: dict[str, FrameSource] = {}
        self._next_picture = 0

    def at(self, frame: int, *, pictures: bool) -> Iterator[tuple[str, bytes]]:
        """What was told of a frame: keys of the network and payloads."""
        run, tracks = self.scenario.name, self._results.tracks
        for estimator, node in sorted(tracks, key=lambda track: (ESTIMATORS.index(track[0]), track[1])):
            message = tracks[estimator, node].get(frame)
            if message is not None:
                yield keys.estimate(run, node), codec.encode_public(message)
        if frame in self._results.truth:
            yield keys.truth(run), codec.encode_public(self._results.truth[frame])
        if pictures:
            for name, source in self._at_picture(frame).items():
                shown = encode_jpeg(source.read(frame))
                time_s = frame / self.scenario.rate_hz
                preview = PreviewMessage(run, name, frame, time_s, np.empty((0, 2)), shown)
                yield keys.preview(run, name), codec.encode_preview(preview)

    def alive_at(self, frame: int) -> set[str] | None:
        """The nodes that were heard of at a frame; None where nobody listened for them."""
        alive: set[str] = set()
        for event, node, at in self._events:
            if at <= frame:
                (alive.add if event == "seen" else alive.discard)(node)
        return alive if self._events else None

    def close(self) -> None:
        """Closes videos."""
        for source in self._sources.values():
            source.close()

    def _at_picture(self, frame: int) -> dict[str, FrameSource]:
        """The cameras' sources, opened anew where a video would have to run backwards."""
        if frame < self._next_picture or not self._sources:
            self.close()
            self._sources = {name: self._assembly.source(name) for name in self._assembly.cameras}
        self._next_picture = frame + 1
        return self._sources

    @cached_property
    def _assembly(self) -> Assembly:
        return Assembly(self.scenario)


def _events(path: Path) -> Iterator[tuple[str, str, int]]:
    """Nodes that came and went: event, node and frame. The last line may have been cut off."""
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else ():
        with suppress(json.JSONDecodeError, KeyError):
            event = json.loads(line)
            if event["event"] in ("seen", "lost"):
                yield event["event"], event["node"], event["frame"]
