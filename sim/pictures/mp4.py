"""Films as MP4 (H.264), which every browser plays: by the ffmpeg that the optional extra `mp4` brings.

OpenCV's wheel cannot write H.264, and what it writes as MP4 no browser plays.
"""

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from sim.pictures.canvas import Image


def require_ffmpeg() -> None:
    """Says what to install.

    Raises:
        ValueError: The extra is not installed.
    """
    if find_spec("imageio_ffmpeg") is None:
        raise ValueError("MP4 needs ffmpeg: pip install 'dcpf[mp4]', or choose .webp or .gif")


def write_mp4(pictures: Sequence[Image], path: Path, fps: float) -> None:
    """Writes pictures of one size, BGR, as a film.

    Args:
        pictures: At least one.
        path: The file.
        fps: Pictures a second.

    Raises:
        OSError: The file cannot be written.
    """
    import imageio_ffmpeg  # noqa: PLC0415 - an optional extra

    # H.264 halves the resolution of colours: even sizes only
    height, width = (size - size % 2 for size in pictures[0].shape[:2])
    film = imageio_ffmpeg.write_frames(
        str(path),
        (width, height),
        pix_fmt_in="bgr24",
        fps=fps,
        codec="libx264",
        quality=7,
        macro_block_size=2,
        output_params=["-movflags", "+faststart"],
    )
    film.send(None)
    for picture in pictures:
        film.send(np.ascontiguousarray(picture[:height, :width]))
    film.close()
    if not path.is_file():
        raise OSError(f"{path}: ffmpeg could not write there")
