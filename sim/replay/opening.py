"""Opens whatever holds a run: its folder, with pictures or without, or a recording on its own."""

from pathlib import Path

from sim.recording.reader import McapRecording
from sim.replay.folder import FolderRecording
from sim.results.recorder import FILM, RecordingError


def film_of(path: Path) -> Path:
    """The recording with pictures of a run.

    Raises:
        RecordingError: There is none.
    """
    film = path / FILM if path.is_dir() else path
    if not film.is_file():
        raise RecordingError(f"{path}: was recorded without pictures: run it again with --record")
    return film


def open_recording(path: Path) -> McapRecording | FolderRecording:
    """The recording of a run.

    Args:
        path: Folder of a run, or a file that ends in .mcap.

    Raises:
        RecordingError: It is neither, or cannot be read.
        ScenarioError: The folder's scenario cannot be read.
    """
    if (path / FILM).is_file():
        return McapRecording(path / FILM)
    if path.is_dir():
        return FolderRecording(path)
    if path.suffix == ".mcap":
        return McapRecording(path)
    raise RecordingError(f"{path}: is neither the folder of a run nor a recording (.mcap): name one")
