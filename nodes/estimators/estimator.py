"""The SIR estimator on one or more cameras, frame by frame: CPF, or a camera on its own."""

from collections.abc import Mapping
from typing import Literal

from network.wire.messages import EstimateMessage
from nodes.filtering.fusion import propagate
from nodes.filtering.gaussian import Moments
from nodes.filtering.sighting import Sighting, shrinkage
from nodes.filtering.sir import View, sir_step
from nodes.setup import TrackingSetup
from nodes.vision.appearance import Appearance
from nodes.vision.observation import ObservationModel, Picture


class SirEstimator:
    """Everything about a filter on raw pictures lives here."""

    def __init__(self, node: str, kind: Literal["cpf", "single"], setup: TrackingSetup) -> None:
        """A filter before its first frame.

        Args:
            node: Name of the node that runs it.
            kind: Which of the two it is.
            setup: What the run tracks.
        """
        self._node, self._kind, self._setup = node, kind, setup
        self._appearances: dict[str, Appearance | None] = {}
        self._rng = setup.stream(node, kind)
        self._particles = setup.first_particles(self._rng)
        self._sighting = Sighting()
        self._last_frame = 0

    def begin(self, appearances: Mapping[str, Appearance | None]) -> EstimateMessage:
        """Frame 0: is told what the target looks like to each camera."""
        self._appearances = dict(appearances)
        n = float(self._setup.filter.n_particles)
        members = tuple(sorted(appearances))
        return self._message(0, self._setup.start.moments, n, members, visible=True)

    def step(self, frame: int, pictures: Mapping[str, tuple[ObservationModel, Picture]]) -> EstimateMessage:
        """One frame of every camera that delivered a picture.

        Args:
            frame: Its index.
            pictures: The picture of each camera, and how it observes.
        """
        setup = self._setup
        views = {name: View(*pictures[name], self._appearances.get(name)) for name in sorted(pictures)}
        # frames that were left out, for want of time, move the particles all the same
        for _ in range(self._last_frame + 1, frame):
            self._particles = propagate(self._particles, setup.motion, self._rng)
        self._last_frame = frame
        # predict, reweight by all pictures, estimate, resample
        options = setup.filter
        self._particles, info = sir_step(
            self._particles,
            list(views.values()),
            setup.motion,
            options.resampling.threshold,
            self._rng,
            options.threads,
        )
        self._sighting = self._sighting.after(shrinkage(info.predicted.position(), info.estimate.position()))
        # update the references (Eq. 4)
        position, visible = info.estimate.position().mean, False
        for name, view in views.items():
            if view.appearance is not None:
                sight = view.model.sight(view.picture, position, view.appearance)
                visible |= view.model.sees(sight, view.appearance)
                self._appearances[name] = view.model.updated(view.picture, position, sight, view.appearance)
        return self._message(frame, info.estimate, info.ess, tuple(views), visible=visible)

    def _message(
        self, frame: int, estimate: Moments, ess: float, members: tuple[str, ...], *, visible: bool
    ) -> EstimateMessage:
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
            members=members,
        )
