"""A smart camera of the network: local filter, consensus, fusion filter.

Sans-I/O: it is given pictures, messages and deadlines, and returns messages. Everything that a frame does to
a camera lives in this file, in the order in which it happens (Jing & Chen, section 3 and Algorithm 1).
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from network.consensus import Consensus
from network.messages import ConsensusMessage, EstimateMessage, PreviewMessage
from nodes.array_estimator import ArrayEstimator
from nodes.estimator import SirEstimator
from nodes.filtering.fusion import fuse, is_density, left_of, pack, propagate, unpack
from nodes.filtering.gaussian import Moments, moments
from nodes.filtering.local import LocalResult, local_filter
from nodes.filtering.particles import Particles, effective_sample_size, resample_if_degenerate
from nodes.filtering.sighting import Sighting
from nodes.preview import preview
from nodes.setup import TrackingSetup
from nodes.simd.report import FrameReport
from nodes.telemetry import Counters
from nodes.vision.appearance import Appearance, pack_looks, settled, unpack_looks
from nodes.vision.observation import ObservationModel, Picture

Outgoing = tuple[ConsensusMessage | EstimateMessage, ...]


@dataclass(frozen=True, slots=True, eq=False)
class FrameInProgress:
    """What a camera keeps of a frame while its neighbours' messages come in."""

    index: int
    picture: Picture
    predicted: Particles


class SmartCamera:
    """One camera's part of the distributed filter.

    Attributes:
        name: The camera's name, which is the node's.
    """

    def __init__(
        self,
        model: ObservationModel,
        setup: TrackingSetup,
        consensus: Consensus,
        cameras: tuple[str, ...],
        single: SirEstimator | ArrayEstimator | None = None,
    ) -> None:
        """A camera before its first frame.

        Args:
            model: The camera's observation model.
            setup: What the run tracks.
            consensus: Its part of the averaging.
            cameras: The cameras of the network.
            single: The camera's own filter beside, as a baseline.
        """
        self.name = model.camera.name
        self._indefinite: Counter[str] = Counter(indefinite_local=0, indefinite_fused=0)
        self._model, self._setup, self._consensus, self._cameras = model, setup, consensus, set(cameras)
        self._motion = setup.motion
        self._fusion_rng = setup.stream(self.name, "fusion")
        self._local_rng = setup.stream(self.name, "local")
        self._particles = setup.first_particles(self._fusion_rng)
        self._local_particles = setup.first_particles(self._local_rng)
        self._appearance: Appearance | None = None
        self._sighting = Sighting()
        self._frame: FrameInProgress | None = None
        self._last_frame = 0
        self._single = single

    def on_frame(self, index: int, image: UInt8[np.ndarray, "H W 3"]) -> Outgoing:
        """A picture has been taken: filters it and opens the frame's consensus.

        Args:
            index: The frame, from 0, which initialises the filters.
            image: The picture, BGR.
        """
        if index == 0:
            return self._begin(image)
        picture = self._model.look(image)
        # frames that were left out, for want of time, move the particles all the same
        for _ in range(self._last_frame + 1, index):
            self._particles = propagate(self._particles, self._motion, self._fusion_rng)
            self._local_particles = propagate(self._local_particles, self._motion, self._local_rng)
        self._last_frame = index
        # predict: χ(k) ~ P(χ(k) | χ(k-1))
        predicted = propagate(self._particles, self._motion, self._fusion_rng)
        # reweight by the own picture: u, p, v, r
        local = self._filter_locally(picture, predicted)
        self._indefinite["indefinite_local"] += not is_density(local, self._setup.fusion)
        # exchange (Eq. 3)
        self._frame = FrameInProgress(index, picture, predicted)
        packed = pack(local, len(self._cameras), self._setup.fusion)
        return self._with_result(self._consensus.begin(index, packed))

    def on_message(self, message: ConsensusMessage) -> Outgoing:
        """A neighbour's value of a round has come."""
        return self._with_result(self._consensus.receive(message))

    def on_lost(self, neighbor: str) -> Outgoing:
        """A neighbour is gone: the rounds go on without it."""
        self._cameras.discard(neighbor)
        return self._with_result(self._consensus.drop(neighbor))

    def on_deadline(self) -> Outgoing:
        """The frame's time is up: what the rounds have reached must do."""
        self._consensus.cut()
        return self._with_result(())

    def preview(self, index: int, image: UInt8[np.ndarray, "H W 3"]) -> PreviewMessage:
        """What a frame that is done looks like, for people."""
        run, time_s = self._setup.run, index / self._setup.rate_hz
        return preview(run, self.name, index, time_s, image, self._particles)

    @property
    def waiting_for(self) -> tuple[str, ...]:
        """Neighbours without whose message the frame cannot go on; none when it is done."""
        return self._consensus.waiting_for()

    @property
    def counters(self) -> Counters:
        """What it has counted.

        Frames in which the local (`indefinite_local`) or the fused (`indefinite_fused`) difference of
        information matrices was not positive semidefinite, so that Eq. 17 had no density; and messages
        of the rounds that were of no use, by reason (`unused`); the cost of a frame on the emulated array
        (`simd`), if there is one.
        """
        report = self._array_report
        return {
            **self._indefinite,
            "unused": dict(self._consensus.counters),
            **({"simd": report.figures} if report else {}),
        }

    @property
    def _array_report(self) -> FrameReport | None:
        """What the last frame has cost on the emulated array: the whole tracker, or the likelihoods."""
        if isinstance(self._single, ArrayEstimator) and self._last_frame:
            return self._single.report
        return self._model.processor.report if self._model.processor else None

    @property
    def rounds_done(self) -> int:
        """Rounds of consensus done in the frame."""
        return self._consensus.rounds_done

    def _with_result(self, messages: tuple[ConsensusMessage, ...]) -> Outgoing:
        """The messages of the rounds, and the estimates once the rounds are over."""
        frame = self._frame
        if frame is None or not self._consensus.done:
            return messages
        self._frame = None
        estimates = self._finish_first(frame) if frame.index == 0 else self._finish(frame)
        return (*messages, *estimates)

    def _filter_locally(self, picture: Picture, predicted: Particles) -> LocalResult:
        """Eq. 9-14 on the fusion filter's particles, or on the local filter's own."""
        own = self._setup.fusion.local_particles == "own"
        if own:
            predicted = propagate(self._local_particles, self._motion, self._local_rng)
        log_likelihoods = self._model.log_likelihoods(picture, predicted.positions, self._appearance)
        result = local_filter(predicted, log_likelihoods)
        if own:
            options = self._setup.filter
            self._local_particles = resample_if_degenerate(
                result.particles, options.resampling.threshold, self._local_rng, options.threads
            )
        return result

    def _finish(self, frame: FrameInProgress) -> tuple[EstimateMessage, ...]:
        """The second half of a frame: the fusion filter on the network's average."""
        setup = self._setup
        # sum: N times the average (Eq. 15-16)
        fused = unpack(self._consensus.value, len(self._cameras), len(setup.start.mean), setup.fusion)
        self._indefinite["indefinite_fused"] += not fused.is_density
        # reweight, from the prior or the optimal proposal (Eq. 17)
        posterior = fuse(
            self._particles, frame.predicted, fused, self._motion, setup.fusion, self._fusion_rng
        )
        # estimate
        estimate = moments(posterior.states, posterior.weights)
        ess = effective_sample_size(posterior)
        prior = moments(frame.predicted.states, frame.predicted.weights)
        self._sighting = self._sighting.after(left_of(prior, fused))
        # resample
        threshold, n_threads = setup.filter.resampling.threshold, setup.filter.threads
        self._particles = resample_if_degenerate(posterior, threshold, self._fusion_rng, n_threads)
        # update the reference (Eq. 4)
        visible = self._update_appearance(frame.picture, estimate.position().mean)
        message = self._message(frame, estimate, ess, visible=visible)
        if self._single is None:
            return (message,)
        return message, self._single.step(frame.index, {self.name: (self._model.off_array, frame.picture)})

    def _update_appearance(self, picture: Picture, position: Float[np.ndarray, " A"]) -> bool:
        """Updates the reference by what the estimate's box shows; returns whether it shows the target."""
        appearance = self._appearance
        if appearance is None:
            return False
        sight = self._model.sight(picture, position, appearance)
        self._appearance = self._model.updated(picture, position, sight, appearance)
        return self._model.sees(sight, appearance)

    def _begin(self, image: UInt8[np.ndarray, "H W 3"]) -> Outgoing:
        """Frame 0: the target's looks, averaged over the cameras that see it at the start."""
        self._model = self._model.with_first(image)
        picture = self._model.look(image)
        position = self._setup.start.moments.position().mean
        self._appearance = self._model.first_appearance(picture, position)
        self._frame = FrameInProgress(0, picture, self._particles)
        looks = pack_looks(self._appearance, self._setup.filter.color)
        return self._with_result(self._consensus.begin(0, looks))

    def _finish_first(self, frame: FrameInProgress) -> tuple[EstimateMessage, ...]:
        """A camera that saw nothing, or something else, takes the looks that the others saw."""
        color = self._setup.filter.color
        self._appearance = settled(self._appearance, unpack_looks(self._consensus.value, color), color)
        visible = self._appearance is not None and self._appearance.own
        n = float(self._setup.filter.n_particles)
        message = self._message(frame, self._setup.start.moments, n, visible=visible)
        if self._single is None:
            return (message,)
        if isinstance(self._single, ArrayEstimator):
            return message, self._single.begin(frame.picture, self._appearance)
        return message, self._single.begin({self.name: self._appearance})

    def _message(
        self, frame: FrameInProgress, estimate: Moments, ess: float, *, visible: bool
    ) -> EstimateMessage:
        return EstimateMessage(
            run=self._setup.run,
            node=self.name,
            estimator="dcpf",
            frame=frame.index,
            time_s=frame.index / self._setup.rate_hz,
            mean=estimate.mean,
            covariance=estimate.covariance,
            visible=visible,
            lost=self._sighting.lost,
            ess=ess,
            iterations=self._consensus.rounds_done,
            members=tuple(sorted(self._cameras)),
        )
