"""The folder of a run: written as the run goes, readable at any moment, the summary whole or not at all."""

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol, TextIO, runtime_checkable

from network.errors import RefusedMessage
from network.wire.codec import decode_public, encode_public
from network.wire.messages import EstimateMessage, PreviewMessage, StatusMessage, TruthMessage
from sim.results.results import Results, Track
from sim.scenario.document import dump
from sim.scenario.loading import load_scenario
from sim.scenario.model import Scenario

ESTIMATORS = ("dcpf", "cpf", "single")
"""The order of a frame's estimates in the file, then by node: the same whatever order they came in."""


class RecordingError(Exception):
    """The folder of a run cannot be written or read; the text names it and says what to do."""


def default_folder(scenario: Scenario, root: Path = Path("runs")) -> Path:
    """A folder for a run that begins now."""
    return root / f"{scenario.name}-{datetime.now(UTC).strftime('%Y%m%dT%H%M%S.%fZ')}"


def expected_tracks(scenario: Scenario) -> set[Track]:
    """Who will tell estimates in each frame."""
    cameras = [camera.name for camera in scenario.cameras]
    tracks = {("dcpf", name) for name in cameras}
    if scenario.baselines.single:
        tracks |= {("single", name) for name in cameras}
    if scenario.baselines.cpf:
        tracks.add(("cpf", scenario.central.name))
    return tracks


FILM = "run.mcap"
"""The recording with pictures, in the folder of a run."""


@runtime_checkable
class Film(Protocol):
    """Records a run with its pictures as it goes; raises OSError where it cannot."""

    def add(self, message: EstimateMessage | TruthMessage | StatusMessage | PreviewMessage) -> None:
        """Records what a node, or the world, has told."""

    def event(self, event: str, node: str, details: dict[str, Any]) -> None:
        """Records that something happened to a node."""

    def close(self) -> None:
        """Ends it; a second time nothing happens."""


class Recorder:
    """Writes a run into its folder; estimates in one order, whatever order they come in."""

    def __init__(self, folder: Path, scenario: Scenario, film: Callable[[Path], Film] | None = None) -> None:
        """Makes the folder and begins its files.

        Args:
            folder: Where; an earlier run in it is replaced.
            scenario: As run.
            film: Begins a recording with pictures in a file, if there is to be one.

        Raises:
            RecordingError: It cannot be written.
        """
        self.folder = folder
        self._film: Film | None = None
        self._files: dict[str, TextIO] = {}
        self._expected = expected_tracks(scenario)
        self._waiting: dict[int, dict[Track, EstimateMessage]] = {}
        self._latest: dict[Track, int] = {}
        self._next = 0
        self._skips = scenario.pace == "realtime" or bool(scenario.faults)
        try:
            (folder / "logs").mkdir(parents=True, exist_ok=True)
            for earlier in ("summary.json", FILM):
                (folder / earlier).unlink(missing_ok=True)
            dump(as_run(scenario), folder / "scenario.yaml")
            for name in ("estimates", "truth", "events"):
                self._files[name] = (folder / f"{name}.jsonl").open("w", encoding="utf-8")
            if film is not None:
                self._film = film(folder / FILM)
        except OSError as error:
            self.close()
            raise _cannot_write(folder, error) from error

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def filming(self) -> bool:
        """Whether pictures are wanted."""
        return self._film is not None

    def add(self, message: EstimateMessage | TruthMessage | StatusMessage | PreviewMessage) -> None:
        """Records what a node, or the world, has told.

        Raises:
            RecordingError: The disk is full, or the folder gone.
        """
        if self._film is not None:
            with self._writing():
                self._film.add(message)
        if isinstance(message, TruthMessage):
            self._write("truth", encode_public(message).decode())
        elif isinstance(message, EstimateMessage):
            track = (message.estimator, message.node)
            self._waiting.setdefault(message.frame, {})[track] = message
            self._latest[track] = max(message.frame, self._latest.get(track, -1))
            self._write_complete()

    def event(self, event: str, node: str, **details: Any) -> None:
        """Records that something happened to a node."""
        self._write("events", json.dumps({"event": event, "node": node, **details}))
        if self._film is not None:
            with self._writing():
                self._film.event(event, node, details)

    def forget(self, node: str) -> None:
        """A node is gone: nobody waits for its estimates any more."""
        self._expected = {(kind, name) for kind, name in self._expected if name != node}
        self._write_complete()

    def finish(self, summary: dict[str, Any]) -> None:
        """Writes what is left and the summary.

        Raises:
            RecordingError: The disk is full, or the folder gone.
        """
        self._write_frames(sorted(self._waiting))
        part = self.folder / "summary.json.part"
        with self._writing():
            if self._film is not None:
                self._film.close()
            part.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
            part.replace(self.folder / "summary.json")

    def close(self) -> None:
        """Writes what is left and closes the files."""
        with suppress(RecordingError):
            self._write_frames(sorted(self._waiting))
        for file in self._files.values():
            with suppress(OSError):
                file.close()
        if self._film is not None:
            with suppress(OSError):
                self._film.close()

    def _write_complete(self) -> None:
        """Writes the next frames of which everything has come, or will not come any more."""
        while self._waiting and self._is_complete(min(self._waiting)):
            self._write_frames([min(self._waiting)])

    def _is_complete(self, frame: int) -> bool:
        if not self._skips:
            return frame <= self._next and self._expected <= self._waiting[frame].keys()
        # In real time, or away, a node that has told of a later frame has left this one out.
        return all(self._latest.get(track, -1) >= frame for track in self._expected)

    def _write_frames(self, frames: Iterable[int]) -> None:
        for frame in frames:
            tracks = self._waiting.pop(frame)
            for track in sorted(tracks, key=lambda each: (ESTIMATORS.index(each[0]), each[1])):
                self._write("estimates", encode_public(tracks[track]).decode())
            self._next = frame + 1

    def _write(self, name: str, line: str) -> None:
        file = self._files[name]
        with self._writing():
            file.write(line + "\n")
            file.flush()

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError) as error:
            raise _cannot_write(self.folder, error) from error


def as_run(scenario: Scenario) -> dict[str, Any]:
    """A scenario as plain data; null has a meaning everywhere but in the ways that a camera is not given."""
    data = scenario.model_dump(mode="json")
    cameras = [
        {key: value for key, value in camera.items() if value is not None} for camera in data["cameras"]
    ]
    return {**data, "cameras": cameras}


def read_run(folder: Path) -> Results:
    """Reads the folder of a run, finished or not.

    Raises:
        RecordingError: It is no folder of a run.
        ScenarioError: Its scenario cannot be read.
    """
    if not (folder / "scenario.yaml").is_file():
        raise RecordingError(f"{folder}: is not the folder of a run: name one that `dcpf run` has written")
    results = Results(load_scenario(folder / "scenario.yaml"))
    # The last line of a run that was cut off may be half a message.
    for line in _lines(folder / "estimates.jsonl"):
        with suppress(RefusedMessage):
            results.add(decode_public(EstimateMessage, line))
    for line in _lines(folder / "truth.jsonl"):
        with suppress(RefusedMessage):
            results.add(decode_public(TruthMessage, line))
    return results


def read_summary(folder: Path) -> dict[str, Any] | None:
    """The summary of a run; None if it was not finished.

    Raises:
        RecordingError: It is damaged.
    """
    path = folder / "summary.json"
    if not path.is_file():
        return None
    try:
        summary: dict[str, Any] = json.loads(path.read_bytes())
    except ValueError as error:
        raise RecordingError(f"{path}: is no summary of a run: take it away, or run again") from error
    return summary


def _lines(path: Path) -> list[bytes]:
    return path.read_bytes().splitlines() if path.is_file() else []


def _cannot_write(folder: Path, error: Exception) -> RecordingError:
    cause = error.strerror if isinstance(error, OSError) else str(error)
    return RecordingError(
        f"{folder}: the run cannot be recorded there: {cause}: free space, or name another --out"
    )
