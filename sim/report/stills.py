"""Pictures of the cameras at moments of a run, small enough for a page.

Boxes and truth in the whole picture; particles, 2σ ellipses and means in a close-up, since they are small.
"""

import base64
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float

from network.wire.messages import EstimateMessage, PreviewMessage
from nodes.imaging.camera import Camera
from nodes.vision.target import TargetOptions
from sim.assembly import Assembly
from sim.pictures.canvas import Image, draw_dots, draw_lines
from sim.pictures.ground import ellipse
from sim.pictures.overlay import Shown, draw_frame
from sim.pictures.theme import COLORS, LABELS, PAPER, PARTICLE
from sim.recording.scene import in_world
from sim.report.elements import Moment, Still
from sim.report.retelling import Previews
from sim.results.results import Results
from sim.world.colors import bgr

WIDTH_PX = 480
"""Of a picture, at most; less if there are so many that the page would become heavy."""
LIMIT_BYTES = 1_500_000
"""All pictures of a run's page together."""
_FUSED: tuple[Shown, ...] = ("dcpf", "cpf")
_MIN_WIDTH_PX = 120
_QUALITY = 75
_INSET = 0.3  # side of a close-up against the picture's width
_FRAME_PX = 2  # around a close-up
_ROOM = 1.3  # what a close-up shows, against what it must
_AT_HAND = 3  # times as large, at most, to have the truth in it
_LEAST_PX = 4  # of the camera's picture in a close-up


def choose_moments(results: Results) -> dict[int, str]:
    """Frames to show, with the reason: the first estimates, the middle, the end, and where DCPF is worst."""
    errors = [e for track in results.of("dcpf").values() if (e := results.errors(track)) is not None]
    return moments_by(results.frames_done - 1, np.array(errors))


def moments_by(last: int, errors: Float[np.ndarray, "..."]) -> dict[int, str]:
    """The same by the last frame and the errors of all nodes from frame 1 on; there may be none."""
    moments = {min(1, last): "the first step", last // 2: "the middle of the run", last: "the last frame"}
    if np.isfinite(errors).any():
        worst = 1 + int(np.nan_to_num(errors, nan=-1.0).max(axis=0).argmax())
        moments.setdefault(worst, "DCPF is farthest from the truth")
    return dict(sorted(moments.items()))


def moments_of(
    results: Results,
    assembly: Assembly,
    previews: Previews,
    why: Mapping[int, str],
    limit_bytes: int = LIMIT_BYTES,
) -> list[Moment]:
    """The pictures of all cameras at some frames.

    Args:
        results: The run.
        assembly: Its scenario, put together.
        previews: What the cameras saw.
        why: The frames, and the reason to show each.
        limit_bytes: All pictures together, at most, unless there are hundreds.

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
        if total <= limit_bytes or width <= _MIN_WIDTH_PX:
            return moments
        width = max(_MIN_WIDTH_PX, int(0.9 * width * np.sqrt(limit_bytes / total)))


def drawn_in(results: Results) -> list[Shown]:
    """What the pictures of a run have drawn in them."""
    found: list[Shown] = [kind for kind in _FUSED if results.of(kind)]
    return [*found, "truth"] if results.truth else found


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """A part of a camera's picture, enlarged or made smaller, and how positions get into it."""

    camera: Camera
    target: TargetOptions
    corner: Float[np.ndarray, " 2"]
    scale: float

    def pixels(self, positions: Float[np.ndarray, "N A"]) -> Float[np.ndarray, "N 2"]:
        """Where positions are in the part; NaN where the camera cannot picture them."""
        if self.target.space == "image":
            pixels = positions
        else:
            pixels, _ = self.camera.project(in_world(positions, self.target))
        return (pixels + 0.5 - self.corner) * self.scale - 0.5

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
        image = cv2.imdecode(np.frombuffer(preview.jpeg, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            continue
        seen, width = np.asarray(image, dtype=np.uint8), min(width_px, camera.width_px)
        view = _View(camera, results.scenario.target, np.zeros(2), 1.0)
        positions: dict[Shown, Float[np.ndarray, " A"]] = {
            kind: estimate.mean[: view.target.n_axes] for kind, estimate in found.items()
        }
        if truth is not None:
            positions["truth"] = truth.mean[: view.target.n_axes]
        picture = draw_frame(seen, camera, view.target, positions, frame=frame, width_px=width)
        part = _close_up(seen, preview, found, positions, view, round(_INSET * width))
        if part is not None:
            target_px = view.pixels(positions["dcpf"][None])[0, 0]
            _insert(picture, part, at_left=bool(target_px > camera.width_px / 2))
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


def _close_up(
    image: Image,
    preview: PreviewMessage,
    found: Mapping[Shown, EstimateMessage],
    positions: Mapping[Shown, Float[np.ndarray, " A"]],
    whole: _View,
    size_px: int,
) -> Image | None:
    """A square around what this camera's DCPF believes: particles, 2σ ellipses, means, truth.

    None where the camera does not see that place.
    """
    if "dcpf" not in found:
        return None
    rim = whole.ellipse(found["dcpf"])
    cloud = whole.pixels(preview.particles) if preview.particles.shape[1] == whole.target.n_axes else rim[:0]
    shown = np.concatenate([rim, cloud])
    middle = whole.pixels(positions["dcpf"][None])
    if not (np.isfinite(shown).all() and whole.camera.contains(middle)[0]):
        return None
    half = max(_ROOM * float(np.abs(shown - middle).max()), _LEAST_PX / 2)
    if "truth" in positions:
        aside = _ROOM * float(np.abs(whole.pixels(positions["truth"][None]) - middle).max())
        half = max(half, aside) if aside < _AT_HAND * half else half
    view = replace(whole, corner=middle[0] + 0.5 - half, scale=size_px / (2 * half))
    # [u', v'] = scale [u - corner]: the part of the picture, its rim repeated where it ends
    shift = -view.scale * view.corner + 0.5 * (view.scale - 1)
    affine = np.column_stack([view.scale * np.eye(2), shift])
    part = np.asarray(
        cv2.warpAffine(
            image, affine, (size_px, size_px), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        ),
        dtype=np.uint8,
    )
    draw_dots(part, view.pixels(preview.particles[:, : whole.target.n_axes]), PARTICLE, 1.5)
    for kind, estimate in found.items():
        draw_lines(part, view.ellipse(estimate), PAPER, 4)
        draw_lines(part, view.ellipse(estimate), COLORS[kind], 2)
    for kind, position in positions.items():
        draw_dots(part, view.pixels(position[None]), PAPER, 4.5)
        draw_dots(part, view.pixels(position[None]), COLORS[kind], 3.0)
    return part


def _insert(picture: Image, part: Image, *, at_left: bool) -> None:
    """Puts a close-up into a lower corner, in a light frame."""
    size = min(len(part), picture.shape[0] - _FRAME_PX)
    across = slice(0, size + _FRAME_PX) if at_left else slice(-size - _FRAME_PX, None)
    picture[-size - _FRAME_PX :, across] = bgr(PAPER)
    picture[-size:, slice(0, size) if at_left else slice(-size, None)] = part[:size, :size]


def _words(camera: str, frame: int, positions: Mapping[Shown, Float[np.ndarray, " A"]], unit: str) -> str:
    """What a picture shows, for those who cannot see it."""
    off = [
        f"{LABELS[kind]} {np.linalg.norm(position - positions['truth']):.{1 if unit == 'px' else 2}f} {unit}"
        for kind, position in positions.items()
        if kind != "truth" and "truth" in positions
    ]
    return f"Camera {camera} at frame {frame}" + (f"; off the truth: {', '.join(off)}" if off else "")
