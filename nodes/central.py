"""The central node: collects every camera's pixels and runs the centralised particle filter (CPF).

Sans-I/O: it is given pictures and losses, and returns messages. Source: Jing & Chen, section 2.1.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import UInt8

from network.wire.messages import ConfirmMessage, EstimateMessage, PixelsMessage
from nodes.estimators.estimator import SirEstimator
from nodes.setup import TrackingSetup
from nodes.vision.appearance import Appearance, pack_looks, settled, unpack_looks
from nodes.vision.observation import ObservationModel

Outgoing = tuple[ConfirmMessage | EstimateMessage, ...]

MAX_AHEAD = 4
"""Frames ahead of its own whose pictures the central node keeps; no sender can fill its memory."""
MAX_BEHIND = 2
"""Frames by which the pictures of a camera that is back may be late: the next one will not be."""


class Central:
    """The sink of all pictures."""

    def __init__(self, name: str, models: Mapping[str, ObservationModel], setup: TrackingSetup) -> None:
        """A central node before its first frame.

        Args:
            name: Name of the node.
            models: The observation model of each camera.
            setup: What the run tracks.
        """
        self.name = name
        self._models, self._setup = dict(sorted(models.items())), setup
        self._cameras = set(models)
        self._estimator = SirEstimator(name, "cpf", setup)
        self._images: dict[int, dict[str, UInt8[np.ndarray, "H W 3"]]] = {}
        self._newest = dict.fromkeys(models, -1)
        self._frame = 0

    def on_message(self, message: PixelsMessage) -> Outgoing:
        """A camera's picture has come: of this frame, or of one soon after if the camera had to skip some.

        A camera that was gone is counted on again.
        """
        if message.sender not in self._models:
            return ()
        camera = self._models[message.sender].camera
        fits = message.image.shape[:2] == (camera.height_px, camera.width_px)
        ahead = message.frame - self._frame
        if fits and -MAX_BEHIND <= ahead <= MAX_AHEAD:
            self._cameras.add(message.sender)
            self._newest[message.sender] = message.frame
        if fits and 0 <= ahead <= MAX_AHEAD:
            self._images.setdefault(message.frame, {})[message.sender] = message.image
        return self._while_complete()

    def on_lost(self, camera: str) -> Outgoing:
        """A camera is gone: the filter goes on with the others."""
        self._cameras.discard(camera)
        return self._while_complete()

    def on_deadline(self) -> Outgoing:
        """The frame's time is up: goes on with the pictures that have come."""
        return (*self._step(), *self._while_complete())

    @property
    def cameras(self) -> frozenset[str]:
        """The cameras that are still there."""
        return frozenset(self._cameras)

    @property
    def frame(self) -> int:
        """The frame whose pictures it is collecting."""
        return self._frame

    @property
    def waiting_for(self) -> tuple[str, ...]:
        """Cameras whose picture of the frame may still come."""
        return tuple(sorted(name for name in self._cameras if self._newest[name] < self._frame))

    def _while_complete(self) -> Outgoing:
        """Steps through the frames of which every picture is there."""
        messages: Outgoing = ()
        while self._cameras and not self.waiting_for:
            messages += self._step()
        return messages

    def _step(self) -> Outgoing:
        frame = self._frame
        images = dict(sorted(self._images.pop(frame, {}).items()))
        self._frame = frame + 1
        if frame == 0:
            estimate = self._estimator.begin(self._first_appearances(images))
        else:
            models = {name: self._models[name] for name in images}
            pictures = {name: (model, model.look(images[name])) for name, model in models.items()}
            estimate = self._estimator.step(frame, pictures)
        return ConfirmMessage(self.name, frame), estimate

    def _first_appearances(
        self, images: Mapping[str, UInt8[np.ndarray, "H W 3"]]
    ) -> dict[str, Appearance | None]:
        """The target's looks at the start; a camera that cannot see it, or is late, is told by the others."""
        self._models |= {name: self._models[name].with_first(image) for name, image in images.items()}
        position, color = self._setup.start.moments.position().mean, self._setup.filter.color
        own = dict.fromkeys(self._models) | {
            name: self._models[name].first_appearance(self._models[name].look(image), position)
            for name, image in images.items()
        }
        told = unpack_looks(np.mean([pack_looks(seen, color) for seen in own.values()], axis=0), color)
        return {name: settled(seen, told, color) for name, seen in own.items()}
