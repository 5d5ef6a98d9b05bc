"""Pictures of the cameras at moments of a run: particles, 2σ ellipses, boxes and the truth, small enough for a page."""

import base64
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float

from network.messages import EstimateMessage, PreviewMessage
from nodes.camera import Camera
from nodes.filtering.target import TargetOptions
from sim.assembly import Assembly
from sim.pictures.canvas import Image, draw_dots, draw_lines
from sim.pictures.ground import ellipse
from sim.pictures.overlay import Shown, draw_frame
from sim.pictures.theme import COLORS, LABELS, PAPER, PARTICLE
from sim.recording.scene import in_world
from sim.report.elements import Moment, Still
from sim.report.retelling import Previews
from sim.running.results import Results

WIDTH_PX = 480
"""Of a picture, at most; less if there are so many that the page would become heavy."""
LIMIT_BYTES = 1_500_000
"""All pictures of a page together, at most, unless there are hundreds."""
_MIN_WIDTH_PX = 120
_QUALITY = 75
_N_EVENLY = 3


def choose_moments(results: Results) -> dict[int, str]:
    """Frames to show, with the reason: the first estimates, the middle, the end, and where DCPF is worst."""
    last = results.frames_done - 1
    moments = {min(1, last): "the first step", last // 2: "the middle of the run", last: "the last frame"}
    errors = np.array(
        [e for track in results.of("dcpf").values() if (e := results.errors(track)) is not None]
    )
    if errors.size and np.isfinite(errors).any():
        worst = 1 + int(np.nanargmax(np.nanmax(errors, axis=0, initial=-np.inf)))
        moments.setdefault(worst, "DCPF is farthest from the truth")
    return dict(sorted(moments.items()))


def moments_of(
    results: Results, assembly: Assembly, previews: Previews, why: Mapping[int, str]
) -> list[Moment]:
    """The pictures of all cameras at some frames.

    Args:
        results: The run.
        assembly: Its scenario, put together.
        previews: What the cameras saw.
        why: The frames, and the reason to show each.

    Returns:
        Pictures as WebP, of one width for all, the widest that fits the limit.
    """
    width = WIDTH_PX
    while True:
        moments = [
            Moment(frame, reason, [*_stills(results, assembly, previews.get(frame, {}), frame, width)])
            for frame, reason in why.items()
        ]
        total = sum(len(still.source) for moment in moments for still in moment.stills)
        if total <= LIMIT_BYTES or width <= _MIN_WIDTH_PX:
            return moments
        width = max(_MIN_WIDTH_PX, int(0.9 * width * np.sqrt(LIMIT_BYTES / total)))


@dataclass(frozen=True, slots=True)
class _View:
    """One camera and how positions get into its picture of some width."""

    camera: Camera
    target: TargetOptions
    scale: float

    def pixels(self, positions: Float[np.ndarray, "N A"]) -> Float[np.ndarray, "N 2"]:
        """Where positions are in the picture; NaN where the camera cannot picture them."""
        if self.target.space == "image":
            pixels = positions
        else:
            pixels, _ = self.camera.project(in_world(positions, self.target))
        return (pixels + 0.5) * self.scale - 0.5

    def ellipse(self, estimate: EstimateMessage) -> Float[np.ndarray, "N 2"]:
        """The 2σ ellipse of an estimate's position across the ground, or in the picture itself."""
        rim = ellipse(estimate.mean[:2], estimate.covariance[:2, :2])
        if self.target.space == "volume":
            rim = np.column_stack([rim, np.full(len(rim), estimate.mean[2])])
        return self.pixels(np.concatenate([rim, rim[:1]]))


def _stills(
    results: Results, assembly: Assembly, previews: Mapping[str, PreviewMessage], frame: int, width_px: int
) -> Iterator[Still]:
    truth = results.truth.get(frame)
    for name, preview in sorted(previews.items()):
        camera, found = assembly.cameras[name], _found(results, name, frame)
        width = min(width_px, camera.width_px)
        view = _View(camera, results.scenario.target, width / camera.width_px)
        seen = _beneath(preview, found, view, width)
        if seen is None:
            continue
        positions: dict[Shown, Float[np.ndarray, " A"]] = {
            kind: estimate.mean[: view.target.n_axes] for kind, estimate in found.items()
        }
        if truth is not None:
            positions["truth"] = truth.mean[: view.target.n_axes]
        picture = draw_frame(seen, camera, view.target, positions, frame=frame, width_px=width)
        _, webp = cv2.imencode(".webp", picture, [cv2.IMWRITE_WEBP_QUALITY, _QUALITY])
        source = f"data:image/webp;base64,{base64.b64encode(webp.tobytes()).decode()}"
        yield Still(source, width, picture.shape[0], _words(name, frame, positions, view.target.unit))


def _found(results: Results, camera: str, frame: int) -> dict[Shown, EstimateMessage]:
    """What this camera's DCPF and CPF said of a frame."""
    central = next(iter(results.of("cpf").values()), None)
    tracks: dict[Shown, tuple[str, str] | None] = {"cpf": central, "dcpf": ("dcpf", camera)}
    return {
        kind: results.tracks[track][frame]
        for kind, track in tracks.items()
        if track is not None and frame in results.tracks.get(track, {})
    }


def _beneath(
    preview: PreviewMessage, found: Mapping[Shown, EstimateMessage], view: _View, width_px: int
) -> Image | None:
    """The picture with particles and ellipses, which lie below the boxes; None if it is none."""
    image = cv2.imdecode(np.frombuffer(preview.jpeg, np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        return None
    size = (width_px, round(view.camera.height_px * view.scale))
    picture = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    if preview.particles.shape[1] == view.target.n_axes:
        draw_dots(picture, view.pixels(preview.particles), PARTICLE, 1.5)
    for kind, estimate in found.items():
        rim = view.ellipse(estimate)
        draw_lines(picture, rim, PAPER, 3)
        draw_lines(picture, rim, COLORS[kind], 1)
    return picture


def _words(camera: str, frame: int, positions: Mapping[Shown, Float[np.ndarray, " A"]], unit: str) -> str:
    """What a picture shows, for those who cannot see it."""
    off = [
        f"{LABELS[kind]} {np.linalg.norm(position - positions['truth']):.{1 if unit == 'px' else 2}f} {unit}"
        for kind, position in positions.items()
        if kind != "truth" and "truth" in positions
    ]
    return f"Camera {camera} at frame {frame}" + (f"; off the truth: {', '.join(off)}" if off else "")
