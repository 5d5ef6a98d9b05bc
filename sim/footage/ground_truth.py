"""Measured positions of a target in real footage, as CSV beside the scenario."""

import csv
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sim.footage.registry import FootageError

_COLUMNS = ["frame", "x_m", "y_m", "z_m"]


def read_ground_truth(path: Path) -> Float[np.ndarray, "T 3"]:
    """Reads the target's position in each frame.

    Args:
        path: CSV with the columns frame, x_m, y_m, z_m: one row a frame, from 0, none left out.

    Returns:
        World positions in metres.

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
    if header != _COLUMNS:
        raise FootageError(f"{path}:1: the columns must be {','.join(_COLUMNS)}, got {','.join(header)}")
    if not rows:
        raise FootageError(f"{path}: holds no frames: add a row for each")
    positions = np.empty((len(rows), 3))
    for index, row in enumerate(rows):
        try:
            frame, *position = row
            positions[index] = [float(coordinate) for coordinate in position]
            whole = int(frame) == index and len(position) == 3 and np.isfinite(positions[index]).all()
        except ValueError:
            whole = False
        if not whole:
            raise FootageError(
                f"{path}:{index + 2}: must be frame {index} and three finite numbers, got {','.join(row)}"
            )
    return positions
