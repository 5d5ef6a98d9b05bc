"""A clip of a run for a page: the cameras' pictures, the ground from above and the error over time.

Of one camera that tracks in its image plane, the picture and the error: there is no ground to see.
"""

from collections.abc import Callable, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from sim.assembly import Assembly
from sim.pictures.canvas import Image, blank
from sim.pictures.chart import Chart, Line, mean_known
from sim.pictures.ground_map import GroundMap
from sim.pictures.mp4 import require_ffmpeg, write_mp4
from sim.pictures.overlay import Shown, draw_frame, text_size
from sim.pictures.theme import COLORS, FAINT, LABELS
from sim.results.results import Results

FORMATS: Mapping[str, tuple[int, ...]] = {
    ".webp": (cv2.IMWRITE_WEBP_QUALITY, 80),  # below, still walls flicker in patches
    ".gif": (),
    ".mp4": (),
}
"""File suffixes that a clip can have, and what OpenCV's encoder is told; MP4 is ffmpeg's."""

_CAMERAS_SHARE = 2 / 3  # of the clip's width, at most
_TALLEST = 3 / 4  # of the clip's width, without the chart
_CHART_SHARE = 1 / 8  # height of the chart against the clip's width
_GAP_PX = 2


@dataclass(frozen=True, slots=True)
class Tiling:
    """Pictures of equal size in rows.

    Attributes:
        columns: Pictures in a row.
        rows: Rows.
        width_px: Width of each picture.
        height_px: Height of each picture.
    """

    columns: int
    rows: int
    width_px: int
    height_px: int


def tile(n_pictures: int, aspect: float, width_px: int, height_px: int) -> Tiling:
    """The tiling that shows pictures largest within a size, with the fewest columns.

    Args:
        n_pictures: How many, at least 1.
        aspect: Their width to height.
        width_px: Width that all of them may take.
        height_px: Height that all of them may take.
    """
    tilings = []
    for columns in range(1, n_pictures + 1):
        rows = -(-n_pictures // columns)
        width = int(min(width_px / columns, height_px / rows * aspect))
        tilings.append(Tiling(columns, rows, width, round(width / aspect)))
    return max(tilings, key=lambda each: each.width_px)


def make_clip(
    results: Results,
    assembly: Assembly,
    path: Path,
    *,
    width_px: int = 960,
    fps: float = 10.0,
    every: int = 1,
    progress: Callable[[int, int], None],
) -> None:
    """Writes an animation of a run that plays for ever.

    All pictures are held in memory until the end: of a long run, take every n-th frame.

    Args:
        results: The run.
        assembly: Its scenario, put together; gives the pictures.
        path: A file that ends in .webp (small, many colours), .gif (shown everywhere) or .mp4 (H.264).
        width_px: Width of the clip, at most; its height follows.
        fps: Pictures a second.
        every: Every which frame is shown.
        progress: Called after each picture with how many there are, and will be.

    Raises:
        ValueError: The file's ending is another, or the run has no estimates, or MP4 is not installed.
        OSError: The file cannot be written.
        SourceError: A camera's pictures cannot be read.
    """
    if path.suffix.lower() not in FORMATS:
        raise ValueError(f"{path}: a clip ends in {' or '.join(FORMATS)}: name it so")
    if path.suffix.lower() == ".mp4":
        require_ffmpeg()
    if not results.tracks:
        raise ValueError(f"the run of {results.scenario.name} has no estimates: there is nothing to show")
    frames = range(0, 1 + max(max(track) for track in results.tracks.values()), every)
    scene = _Scene(results, assembly, width_px)
    pictures = []
    with ExitStack() as open_sources:
        sources = {
            name: open_sources.enter_context(closing(assembly.source(name))) for name in assembly.cameras
        }
        for frame in frames:
            images = {name: source.read(frame) for name, source in sources.items()}
            pictures.append(scene.draw(images, frame))
            progress(len(pictures), len(frames))
    _write(pictures, path, fps)


class _Scene:
    """Composes the pictures of a clip."""

    def __init__(self, results: Results, assembly: Assembly, width_px: int) -> None:
        self._results = results
        self._assembly = assembly
        cameras = list(assembly.cameras.values())
        aspect = float(np.median([camera.width_px / camera.height_px for camera in cameras]))
        tallest = round(_TALLEST * width_px)
        on_ground = results.scenario.target.space != "image"
        share = _CAMERAS_SHARE if on_ground else 1.0
        self._tiling = tile(len(cameras), aspect, round(share * width_px), tallest)
        if on_ground:
            height_px = self._tiling.rows * self._tiling.height_px
            map_width = width_px - self._tiling.columns * self._tiling.width_px
            self._map: GroundMap | None = GroundMap(results, assembly, map_width, height_px)
        else:
            self._map, width_px = None, self._tiling.columns * self._tiling.width_px
        self._chart = _error_chart(results, width_px)
        self._means = {track: results.means(track) for track in results.tracks}
        self._truth = results.true_states()

    def draw(self, images: Mapping[str, Image], frame: int) -> Image:
        tiling = self._tiling
        grid = blank(tiling.columns * tiling.width_px, tiling.rows * tiling.height_px, FAINT)
        for index, (name, image) in enumerate(images.items()):
            row, column = divmod(index, tiling.columns)
            self._place(grid, self._picture(name, image, frame), row, column)
        rows = [grid if self._map is None else np.concatenate([grid, self._map.draw(frame)], axis=1)]
        if self._chart is not None:
            rows.append(self._chart.draw(frame))
        return np.concatenate(rows)

    def _picture(self, name: str, image: Image, frame: int) -> Image:
        """A camera's picture, its size such that it fits into a tile with a gap beside and below."""
        camera = self._assembly.cameras[name]
        width, height = self._tiling.width_px - _GAP_PX, self._tiling.height_px - _GAP_PX
        fitting = int(min(width, height * camera.width_px / camera.height_px))
        positions = self._positions(name, frame)
        return draw_frame(
            image, camera, self._assembly.scenario.target, positions, frame=frame, width_px=fitting
        )

    def _place(self, grid: Image, picture: Image, row: int, column: int) -> None:
        top = row * self._tiling.height_px
        left = column * self._tiling.width_px
        height = min(picture.shape[0], self._tiling.height_px - _GAP_PX)
        grid[top : top + height, left : left + picture.shape[1]] = picture[:height]

    def _positions(self, camera: str, frame: int) -> dict[Shown, np.ndarray]:
        """Where the target is for this camera's DCPF, for CPF, and in truth."""
        results = self._results
        n_axes = results.scenario.target.n_axes
        states: dict[Shown, np.ndarray | None] = {
            "dcpf": self._means.get(("dcpf", camera)),
            "cpf": self._means.get(next(iter(results.of("cpf").values()), ("cpf", ""))),
            "truth": self._truth,
        }
        found: dict[Shown, np.ndarray] = {}
        for kind, state in states.items():
            if state is not None and np.isfinite(state[frame, 0]):
                found[kind] = state[frame, :n_axes]
        return found


def _error_chart(results: Results, width_px: int) -> Chart | None:
    """The position errors over the frames; None where nobody knows the truth or nothing is fused."""
    if results.true_states() is None:
        return None
    lines = []
    for kind in ("cpf", "dcpf"):
        errors = [results.errors(track) for track in results.of(kind).values()]
        if errors:
            mean = mean_known(np.array(errors, dtype=float))
            lines.append(Line(LABELS[kind], np.r_[np.nan, mean], COLORS[kind]))
    if not lines:
        return None
    highest = max(float(np.nanmax(line.values, initial=0.0)) for line in lines) or 1.0
    height, text_px = round(_CHART_SHARE * width_px), text_size(width_px // 2)
    unit = results.scenario.target.unit
    return Chart(f"position error / {unit}", lines, 0.0, 1.05 * highest, width_px, height, text_px)


def _write(pictures: list[Image], path: Path, fps: float) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix.lower() == ".mp4":
        write_mp4(pictures, path, fps)
        return
    animation = cv2.Animation(0)
    animation.frames = pictures
    animation.durations = [round(1000 / fps)] * len(pictures)
    if not cv2.imwriteanimation(str(path), animation, FORMATS[path.suffix.lower()]):
        raise OSError(f"{path}: the clip cannot be written there: check the folder and the space")
