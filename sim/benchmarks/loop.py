"""The loop that a user would write: a histogram by OpenCV for one particle after the other."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from nodes.vision.appearance import Appearance
from nodes.vision.color import ColorOptions
from nodes.vision.observation import ObservationModel, Picture

HUE_RANGE = 180
"""OpenCV's hues of 8 bits are whole 2 degrees."""


@dataclass(frozen=True, slots=True, eq=False)
class LoopModel(ObservationModel):
    """An observation model that compares boxes in a loop, and is the same in everything else.

    Attributes:
        reference: The target's histogram, as `histogram` takes it.
    """

    reference: Float32[np.ndarray, "..."] | None = None

    def box_distances(
        self,
        picture: Picture,
        boxes: Float[np.ndarray, "N 4"],
        appearance: Appearance,  # noqa: ARG002 - as the model has it
    ) -> Float[np.ndarray, " N"]:
        """d² of each box to the reference, that of the loop itself."""
        color = self.options.color
        if self.reference is None:
            raise ValueError("the loop has no reference: make it by looping_like")
        values = channels(picture.image, color)
        limits = np.array([self.camera.width_px, self.camera.height_px] * 2)
        corners = np.clip(np.floor(np.nan_to_num(boxes) + 0.5), 0, limits).astype(int).tolist()
        distances = np.ones(len(boxes))
        for i, (left, top, right, bottom) in enumerate(corners):
            if right > left and bottom > top:
                found = histogram(values[top:bottom, left:right], color)
                distances[i] = cv2.compareHist(found, self.reference, cv2.HISTCMP_HELLINGER)
        return distances**2


def looping_like(model: ObservationModel, picture: Picture, box: Float[np.ndarray, " 4"]) -> LoopModel:
    """A model that loops, with the reference that a box of a picture shows."""
    left, top, right, bottom = np.floor(box + 0.5).astype(int).tolist()
    color = model.options.color
    reference = histogram(channels(picture.image, color)[top:bottom, left:right], color)
    return LoopModel(model.camera, model.target, model.options, model.gain, reference=reference)


def channels(image: UInt8[np.ndarray, "H W 3"], color: ColorOptions) -> UInt8[np.ndarray, "H W *C"]:
    """What histograms are taken of: the picture itself, or its hues, worked out once for all boxes."""
    if color.space != "hue":
        return image
    return np.asarray(cv2.extractChannel(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), 0), dtype=np.uint8)


def histogram(region: UInt8[np.ndarray, "h w *C"], color: ColorOptions) -> Float32[np.ndarray, "..."]:
    """The histogram of a box, not normalised: `compareHist` does so itself."""
    n = color.bins_per_channel
    if color.space == "hue":
        return _found(cv2.calcHist([region], [0], None, [n], [0, HUE_RANGE]))
    if color.space == "joint_rgb":
        return _found(cv2.calcHist([region], [2, 1, 0], None, [n] * 3, [0, 256] * 3))
    return np.concatenate(
        [_found(cv2.calcHist([region], [channel], None, [n], [0, 256])) for channel in (2, 1, 0)]
    )


def _found(histogram: object) -> Float32[np.ndarray, "..."]:
    return np.asarray(histogram, dtype=np.float32)
