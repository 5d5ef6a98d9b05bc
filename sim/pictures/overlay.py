"""A camera's picture with what the filters believe drawn into it."""

from collections.abc import Mapping, Sequence
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float

from nodes.imaging.camera import Camera
from nodes.vision.target import TargetOptions, project_boxes, visible_fraction
from sim.pictures.canvas import Image, blank, dashes, draw_dots, draw_lines, draw_text, text_width
from sim.pictures.theme import COLORS, INK, LABELS, PAPER

Shown = Literal["dcpf", "cpf", "truth"]

_NESTED: tuple[Shown, ...] = ("dcpf", "cpf")
"""Whose lines lie side by side around the box, from the inside out: where all agree, all are seen."""
_HALO_PX = 1  # the light rim that parts a line from any background
_DASH_PX = 4.0


def draw_frame(
    image: Image,
    camera: Camera,
    target: TargetOptions,
    positions: Mapping[Shown, Float[np.ndarray, " A"]],
    *,
    frame: int,
    width_px: int,
) -> Image:
    """A camera's picture with the boxes of the estimates, the truth dotted, and a note of what is outside.

    Args:
        image: The picture, as the camera gives it.
        camera: The camera.
        target: What is tracked.
        positions: Where the target is: as this camera's DCPF has it, as CPF has it, in truth; what
            is left out is not drawn.
        frame: Frame of the run.
        width_px: Width of the picture that is wanted.

    Returns:
        The picture at that width, in its own proportions.
    """
    scale = width_px / camera.width_px
    size = (width_px, round(camera.height_px * scale))
    smooth = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    picture = np.asarray(cv2.resize(image, size, interpolation=smooth), dtype=np.uint8)
    boxes = {kind: project_boxes(position[None], target, camera) for kind, position in positions.items()}
    seen = {kind: bool(visible_fraction(box, camera)[0] > 0) for kind, box in boxes.items()}
    # pixel edges at whole numbers, as boxes have them; canvas coordinates are at the pixels' centres
    outlines = {kind: _corners(box[0] * scale - 0.5) for kind, box in boxes.items() if seen[kind]}
    if "truth" in outlines:
        _draw_truth(picture, outlines["truth"])
    _draw_boxes(picture, [(kind, outlines[kind]) for kind in _NESTED if kind in outlines])
    _caption(picture, camera.name, frame)
    hidden = [LABELS[kind] for kind in ("dcpf", "cpf") if not seen.get(kind, True)]
    if hidden:
        _note(picture, f"{', '.join(hidden)}: not in view")
    return picture


def _corners(box: Float[np.ndarray, " 4"]) -> Float[np.ndarray, "4 2"]:
    left, top, right, bottom = box
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])


def _draw_boxes(picture: Image, outlines: Sequence[tuple[Shown, Float[np.ndarray, "4 2"]]]) -> None:
    """Boxes with their lines outside of them, one around the other."""
    line = int(np.clip(round(picture.shape[1] / 160), 2, 4))
    outward = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    around = [
        (kind, outline + (1 + line * (_NESTED.index(kind) + 0.5)) * outward) for kind, outline in outlines
    ]
    for _, outline in around:
        draw_lines(picture, outline, PAPER, line + 2 * _HALO_PX, closed=True)
    for kind, outline in reversed(around):  # soft edges: the inner line, the shorter one, lies above
        draw_lines(picture, outline, COLORS[kind], line, closed=True)


def _draw_truth(picture: Image, outline: Float[np.ndarray, "4 2"]) -> None:
    """The true box, dashed in black and white, and its foot point."""
    foot = outline[2:].mean(axis=0, keepdims=True)
    draw_lines(picture, outline, PAPER, 1, closed=True)
    draw_lines(picture, dashes(outline, _DASH_PX, closed=True), COLORS["truth"], 1)
    draw_dots(picture, foot, PAPER, 4.0)
    draw_dots(picture, foot, COLORS["truth"], 2.5)


def _caption(picture: Image, name: str, frame: int) -> None:
    """The camera's name and the frame, on a light label in the upper corners."""
    size_px = text_size(picture.shape[1])
    _label(picture, name, size_px, at_right=False, at_bottom=False, bold=True)
    _label(picture, f"frame {frame}", size_px, at_right=True, at_bottom=False)


def _note(picture: Image, words: str) -> None:
    _label(picture, words, text_size(picture.shape[1]), at_right=False, at_bottom=True)


def _label(
    picture: Image, words: str, size_px: int, *, at_right: bool, at_bottom: bool, bold: bool = False
) -> None:
    height, width = picture.shape[:2]
    label_width, label_height = text_width(words, size_px, bold=bold) + size_px, round(1.5 * size_px)
    x = max(0, width - label_width) if at_right else 0
    y = max(0, height - label_height) if at_bottom else 0
    under = picture[y : y + label_height, x : x + label_width]
    under[:] = cv2.addWeighted(under, 0.2, blank(under.shape[1], under.shape[0], PAPER), 0.8, 0)
    draw_text(picture, words, (x + size_px / 2, y + 1.1 * size_px), INK, size_px, bold=bold)


def text_size(width_px: int) -> int:
    """The size of text that suits a picture of some width, pixels."""
    return int(np.clip(width_px / 25, 10, 14))
