"""Finished parts on disk, one file each: what an interruption cannot take away."""

import json
import os
from pathlib import Path
from typing import Any

from sim.results.recorder import RecordingError


class Store:
    """A folder of finished parts, by key."""

    def __init__(self, folder: Path) -> None:
        """Opens or makes the folder.

        Raises:
            RecordingError: It cannot be made.
        """
        self._folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RecordingError(f"{folder}: cannot be made: {error.strerror}: name another --out") from error

    def read(self, key: str) -> dict[str, Any] | None:
        """The result of a part, None if it is not there or was not written whole."""
        try:
            found = json.loads((self._folder / f"{key}.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) else None

    def write(self, key: str, result: dict[str, Any]) -> None:
        """Keeps the result of a part, whole or not at all.

        Raises:
            RecordingError: There is no room.
        """
        path = self._folder / f"{key}.json"
        unfinished = path.with_suffix(f".{os.getpid()}")
        try:
            unfinished.write_text(json.dumps(result) + "\n", encoding="utf-8")
            unfinished.replace(path)
        except OSError as error:
            text = f"{path}: cannot be written: {error.strerror}: free space, or name another --out"
            raise RecordingError(text) from error
