"""A smart camera of the network: local filter, consensus, fusion filter.

Sans-I/O: it is given pictures, messages and deadlines, and returns messages. Everything that a frame does to
a camera lives in this file, in the order in which it happens (Jing & Chen, section 3 and Algorithm 1).
"""

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, UInt8

from network.rounds.consensus import Consensus
from network.wire.messages import ConsensusMessage, EstimateMessage, PreviewMessage, StateMessage
from nodes.estimators.array_estimator import ArrayEstimator
from nodes.estimators.estimator import SirEstimator
from nodes.filtering.fusion import fuse, is_density, left_of, pack, propagate, unpack
from nodes.filtering.gaussian import Moments, moments
from nodes.filtering.local import LocalResult, local_filter
from nodes.filtering.particles import Particles, resample_if_degenerate
from nodes.filtering.sighting import Sighting
from nodes.frame import FrameInProgress, is_new
from nodes.rounds import Rounds
from nodes.setup import TrackingSetup
from nodes.shell.preview import preview
from nodes.shell.telemetry import Counters
from nodes.simd.report import FrameReport
from nodes.vision.appearance import Appearance, pack_looks, settled, unpack_looks
from nodes.vision.observation import ObservationModel, Picture
from nodes.vision.standstill import Standstill

Outgoing = tuple[ConsensusMessage | EstimateMessage, ...]


class SmartCamera:
    """One camera's part of the distributed filter.

    Attributes:
        name: The camera's name, which is the node's.
        rounds: Its averaging with its neighbours.
    """

    def __init__(
        self,
        model: ObservationModel,
        setup: TrackingSetup,
        lanes: Sequence[Consensus],
        single: SirEstimator | ArrayEstimator | None = None,
    ) -> None:
        """A camera before its first frame.

        Args:
            model: The camera's observation model.
            setup: What the run tracks.
            lanes: Its part of the averaging, one for each of the frames whose rounds may overlap.
            single: The camera's own filter beside, as a baseline.
        """
        self.name = model.camera.name
        self._indefinite: Counter[str] = Counter(indefinite_local=0, indefinite_fused=0)
        self._model, self._setup, self.rounds = model, setup, Rounds(lanes)
        self._motion = setup.motion
        self._fusion_rng = setup.stream(self.name, "fusion")
        self._local_rng = setup.stream(self.name, "local")
        self._particles = setup.first_particles(self._fusion_rng)
        self._local_particles = setup.first_particles(self._local_rng)
        self._appearance: Appearance | None = None
        self._sighting = Sighting()
        self._image: UInt8[np.ndarray, "H W 3"] | None = None
        self._standstill = Standstill()
        self._estimate = setup.start.moments
        self._frames: dict[int, FrameInProgress] = {}
        self._last_frame = 0
        self._done_frame = 0
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
            self._local_particles = propagate(self._local_particles, self._motion, self._local_rng)
        self._last_frame = index
        # predict: χ(k) ~ P(χ(k) | χ(k-1))
        previous, predicted = self._predict(index)
        # reweight by the own picture: u, p, v, r
        usable, self._image = self._is_usable(index, image), image
        believed = usable and self._appearance is not None and not self._appearance.doubted
        local = self._filter_locally(picture, predicted, self._appearance if believed else None)
        self._indefinite["indefinite_local"] += not is_density(local, self._setup.fusion)
        # exchange (Eq. 3)
        self._frames[index] = FrameInProgress(index, picture, self._done_frame, previous, predicted, usable)
        packed = pack(local, len(self.rounds.of(index).members), self._setup.fusion)
        return self.rounds.begin(index, packed) + self.on_rounds_over()

    def on_message(self, message: ConsensusMessage) -> Outgoing:
        """A neighbour's value of a round has come; one that was gone is counted on again."""
        return self.rounds.receive(message) + self.on_rounds_over()

    def on_rounds_over(self) -> tuple[EstimateMessage, ...]:
        """The second half of the frames whose rounds are over, if there are any: their estimates."""
        estimates: tuple[EstimateMessage, ...] = ()
        while self._frames and self.rounds.of(index := min(self._frames)).done:
            frame = self._frames.pop(index)
            estimates += self._finish(frame) if index else self._finish_first(frame)
            self._done_frame = index
        return estimates

    def on_return(self, image: UInt8[np.ndarray, "H W 3"], state: StateMessage) -> None:
        """The camera was away: it goes on with what a neighbour knows.

        Args:
            image: What it sees now; the gain is measured against it where nothing was seen before.
            state: The neighbour's state, of a frame before the next one.
        """
        setup = self._setup
        if len(state.mean) != len(setup.start.mean):
            return
        known = Moments(state.mean, state.covariance)
        self._particles = setup.particles(known, self._fusion_rng)
        self._local_particles = setup.particles(known, self._local_rng)
        self.rounds.cut()
        self._frames.clear()
        self._last_frame = self._done_frame = state.frame
        self._sighting = Sighting()
        if self._appearance is None:
            self._model = self._model.with_first(image)
            self._appearance = unpack_looks(state.looks, setup.filter.color)
            # its own filter, the baseline, has nobody to ask
            self._single = None

    def on_lost(self, neighbor: str) -> Outgoing:
        """A neighbour is gone: the rounds go on without it."""
        return self.rounds.lose(neighbor) + self.on_rounds_over()

    def on_round_deadline(self, frame: int) -> Outgoing:
        """The time of a frame's round is up: it is done without those that are late."""
        return self.rounds.expire(frame) + self.on_rounds_over()

    def on_deadline(self, frame: int) -> Outgoing:
        """A frame's time is up: what the rounds have reached must do."""
        self.rounds.of(frame).cut()
        return self.on_rounds_over()

    def preview(self, index: int, image: UInt8[np.ndarray, "H W 3"]) -> PreviewMessage:
        """What a frame that is done looks like, for people."""
        run, time_s = self._setup.run, index / self._setup.rate_hz
        return preview(run, self.name, index, time_s, image, self._particles)

    @property
    def open_rounds(self) -> Mapping[int, int]:
        """Frames whose rounds are not over, from the oldest on, and the round, from 1, that each is in."""
        return self.rounds.under_way(self._frames)

    def awaited(self) -> tuple[str, ...]:
        """Neighbours whose messages the rounds wait for; none where a frame's second half is due."""
        return self.rounds.awaited(self._frames)

    @property
    def state(self) -> StateMessage:
        """What a neighbour that was away needs to know."""
        looks = pack_looks(self._appearance, self._setup.filter.color)
        mean, covariance = self._estimate.mean, self._estimate.covariance
        return StateMessage(self.name, self._done_frame, mean, covariance, looks)

    @property
    def counters(self) -> Counters:
        """What it has counted, by name.

        Frames in which the local or fused difference of information matrices was no density's (Eq. 17);
        messages of no use, by reason (`unused`); in how many `frames` it did not look where it should, and
        the `first` of them (`knocked`); what a frame costs on the emulated array (`simd`).
        """
        report = self._array_report
        return {
            **self._indefinite,
            "unused": self.rounds.counters,
            "knocked": self._standstill.knocked,
            **({"simd": report.figures} if report else {}),
        }

    @property
    def _array_report(self) -> FrameReport | None:
        """What the last frame has cost on the emulated array: the whole tracker, or the likelihoods."""
        if isinstance(self._single, ArrayEstimator) and self._last_frame:
            return self._single.report
        return self._model.processor.report if self._model.processor else None

    def _is_usable(self, index: int, image: UInt8[np.ndarray, "H W 3"]) -> bool:
        """Whether a picture tells anything: a camera that hangs, or that was knocked, is as good as blind."""
        stands = self._standstill.holds(index, like_the_first=self._model.stands_still(image))
        return stands and is_new(image, self._image)

    def _predict(self, index: int) -> tuple[Particles, Particles]:
        """The particles of the last frame that is done, moved to the frame before this one, and to it."""
        previous = self._particles
        for _ in range(self._done_frame + 1, index):
            previous = propagate(previous, self._motion, self._fusion_rng)
        return previous, propagate(previous, self._motion, self._fusion_rng)

    def _filter_locally(
        self, picture: Picture, predicted: Particles, appearance: Appearance | None
    ) -> LocalResult:
        """Eq. 9-14 on the fusion filter's particles, or on the local filter's own."""
        own = self._setup.fusion.local_particles == "own"
        if own:
            predicted = propagate(self._local_particles, self._motion, self._local_rng)
        log_likelihoods = self._model.log_likelihoods(picture, predicted.positions, appearance)
        result = local_filter(predicted, log_likelihoods)
        if own:
            options = self._setup.filter
            self._local_particles = resample_if_degenerate(
                result.particles, options.resampling.threshold, self._local_rng, options.threads
            )
        return result

    def _finish(self, frame: FrameInProgress) -> tuple[EstimateMessage, ...]:
        """The second half of a frame: the fusion filter on the network's average."""
        setup, previous, predicted = self._setup, frame.previous, frame.predicted
        # frames that were under way then are done by now
        if frame.since != self._done_frame:
            previous, predicted = self._predict(frame.index)
        # sum: N times the average (Eq. 15-16)
        lane = self.rounds.of(frame.index)
        fused = unpack(lane.value, len(lane.members), len(setup.start.mean), setup.fusion)
        self._indefinite["indefinite_fused"] += not fused.is_density
        # reweight, from the prior or the optimal proposal (Eq. 17)
        posterior = fuse(previous, predicted, fused, self._motion, setup.fusion, self._fusion_rng)
        # estimate
        estimate = moments(posterior.states, posterior.weights)
        self._estimate = estimate
        ess = posterior.effective_sample_size
        prior = moments(predicted.states, predicted.weights)
        self._sighting = self._sighting.after(left_of(prior, fused))
        # resample
        threshold, n_threads = setup.filter.resampling.threshold, setup.filter.threads
        self._particles = resample_if_degenerate(posterior, threshold, self._fusion_rng, n_threads)
        # update the reference (Eq. 4)
        visible = frame.usable and self._update_appearance(frame.picture, estimate.position().mean)
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
        self._model, self._image = self._model.with_first(image), image
        picture = self._model.look(image)
        position = self._setup.start.moments.position().mean
        self._appearance = self._model.first_appearance(picture, position)
        self._frames[0] = FrameInProgress(0, picture, 0, self._particles, self._particles)
        looks = pack_looks(self._appearance, self._setup.filter.color)
        return self.rounds.begin(0, looks) + self.on_rounds_over()

    def _finish_first(self, frame: FrameInProgress) -> tuple[EstimateMessage, ...]:
        """A camera that saw nothing, or something else, takes the looks that the others saw."""
        color = self._setup.filter.color
        self._appearance = settled(self._appearance, unpack_looks(self.rounds.of(0).value, color), color)
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
            iterations=self.rounds.of(frame.index).rounds_done,
            members=self.rounds.of(frame.index).members,
        )
