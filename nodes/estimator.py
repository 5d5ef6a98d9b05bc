"""The SIR estimator on one or more cameras, frame by frame: CPF, or a camera on its own."""

from collections.abc import Iterable, Mapping
from typing import Literal

import numpy as np
from jaxtyping import UInt8

from network.messages import EstimateMessage
from nodes.filtering.appearance import Appearance, pack_looks, unpack_looks
from nodes.filtering.gaussian import Moments
from nodes.filtering.observation import ObservationModel
from nodes.filtering.sighting import Sighting
from nodes.filtering.sir import View, sir_step
from nodes.setup import TrackingSetup

Images = Mapping[str, UInt8[np.ndarray, "H W 3"]]
"""Pictures by camera, BGR."""


class SirEstimator:
    """Everything about a filter on raw pictures lives here."""

    def __init__(
        self,
        node: str,
        kind: Literal["cpf", "single"],
        models: Iterable[ObservationModel],
        setup: TrackingSetup,
    ) -> None:
        """A filter before its first frame.

        Args:
            node: Name of the node that runs it.
            kind: Which of the two it is.
            models: The observation model of each camera.
            setup: What the run tracks.
        """
        self._node, self._kind, self._setup = node, kind, setup
        self._models = {model.camera.name: model for model in models}
        self._appearances: dict[str, Appearance | None] = {}
        self._rng = setup.stream(node, kind)
        self._particles = setup.first_particles(self._rng)
        self._sighting = Sighting()

    def begin(
        self, images: Images, appearances: Mapping[str, Appearance | None] | None = None
    ) -> EstimateMessage:
        """Frame 0: takes the target's looks at its start.

        Args:
            images: The first picture of each camera.
            appearances: The looks, where somebody has them already; else each camera takes its own, and one
                that cannot see the target is told by the others.
        """
        self._models = {name: self._models[name].with_first(image) for name, image in sorted(images.items())}
        self._appearances = dict(appearances or self._first_appearances(images))
        n = float(self._setup.filter.n_particles)
        return self._message(0, self._setup.start.moments, n, visible=True)

    def step(self, frame: int, images: Images) -> EstimateMessage:
        """One frame of every camera that delivered one."""
        setup = self._setup
        views = {
            name: View(model, model.look(images[name]), self._appearances[name])
            for name, model in self._models.items()
            if name in images
        }
        threshold = setup.filter.resampling.threshold
        self._particles, info = sir_step(
            self._particles, list(views.values()), setup.motion, threshold, self._rng
        )
        self._sighting = self._sighting.after(info.predicted.position(), info.estimate.position())
        position = info.estimate.position().mean
        visible = any(view.model.sees(view.picture, position, view.appearance) for view in views.values())
        # update the references (Eq. 4)
        for name, view in views.items():
            if view.appearance is not None:
                self._appearances[name] = view.model.updated(view.picture, position, view.appearance)
        return self._message(frame, info.estimate, info.ess, visible=visible)

    def _first_appearances(self, images: Images) -> dict[str, Appearance | None]:
        position = self._setup.start.moments.position().mean
        own = {
            name: model.first_appearance(model.look(images[name]), position)
            for name, model in self._models.items()
        }
        color = self._setup.filter.color
        told = unpack_looks(np.mean([pack_looks(seen, color) for seen in own.values()], axis=0), color)
        return {name: seen or told for name, seen in own.items()}

    def _message(self, frame: int, estimate: Moments, ess: float, *, visible: bool) -> EstimateMessage:
        return EstimateMessage(
            run=self._setup.run,
            node=self._node,
            estimator=self._kind,
            frame=frame,
            time_s=frame / self._setup.rate_hz,
            mean=estimate.mean,
            covariance=estimate.covariance,
            visible=visible,
            lost=self._sighting.lost,
            ess=ess,
            iterations=0,
            members=tuple(sorted(self._models)),
        )
