"""Measured positions of a target in real footage, as CSV beside the scenario."""

import csv
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from sim.footage.registry import FootageError

_COLUMNS = {"m": ["frame", "x_m", "y_m", "z_m"], "px": ["frame", "x_px", "y_px"]}
_WORDS = {2: "two", 3: "three"}


def read_ground_truth(path: Path, unit: Literal["m", "px"] = "m") -> Float[np.ndarray, "T _"]:
    """Reads the target's position in each frame.

    Args:
        path: CSV with the columns frame, x_m, y_m, z_m, or frame, x_px, y_px: one row a frame, from 0, none
            left out.
        unit: Which of the two.

    Returns:
        World positions in metres, or positions in the video's picture in pixels.

    Raises:
        FootageError: The file cannot be read, or a row is not as it must be.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            header, *rows = csv.reader(file)
    except OSError as error:
        raise FootageError(f"{path}: cannot be read: {error.strerror}") from error
    except (csv.Error, ValueError):
        raise FootageError(f"{path}: is empty or no CSV in UTF-8: save it as one") from None
    columns = _COLUMNS[unit]
    if header != columns:
        raise FootageError(f"{path}:1: the columns must be {','.join(columns)}, got {','.join(header)}")
    if not rows:
        raise FootageError(f"{path}: holds no frames: add a row for each")
    n_axes = len(columns) - 1
    positions = np.empty((len(rows), n_axes))
    for index, row in enumerate(rows):
        try:
            frame, *position = row
            positions[index] = [float(coordinate) for coordinate in position]
            whole = int(frame) == index and len(position) == n_axes and np.isfinite(positions[index]).all()
        except ValueError:
            whole = False
        if not whole:
            needs = f"frame {index} and {_WORDS[n_axes]} finite numbers"
            raise FootageError(f"{path}:{index + 2}: must be {needs}, got {','.join(row)}")
    return positions
