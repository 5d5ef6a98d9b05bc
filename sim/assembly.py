"""Puts a run together: from a resolved scenario to the nodes, their pictures and the truth."""

from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from network.averaging.algorithm import Algorithm
from network.graphs.graph import Graph
from network.links.transport import Links, links_of
from network.rounds.consensus import Consensus
from network.rounds.membership import Membership
from network.streams import stream
from network.wire.messages import TruthMessage, Visibility
from nodes.central import Central
from nodes.counting.build import load_kernel
from nodes.estimators.array_estimator import ArrayEstimator
from nodes.estimators.estimator import SirEstimator
from nodes.imaging.camera import Camera
from nodes.imaging.sources import FrameSource
from nodes.setup import Start, TrackingSetup
from nodes.shell.pace import Pace
from nodes.simd.likelihood import SimdLikelihood
from nodes.smart_camera import SmartCamera
from nodes.vision.observation import ObservationModel
from sim.faults.pictures import with_faults
from sim.scenario.loading import cameras_of, video_source
from sim.scenario.model import Scenario
from sim.scenario.parsing import ScenarioError
from sim.truth import measured_truth, rendered_truth
from sim.world.renderer import Renderer
from sim.world.visibility import visibility
from sim.world.world import World, build_world


class RenderedSource:
    """The pictures of a camera in the simulated world."""

    def __init__(self, world: World, camera: Camera, rate_hz: float) -> None:
        """A camera that looks at the world `rate_hz` times a second."""
        self._renderer = Renderer(world, camera)
        self._rate_hz = rate_hz

    def read(self, index: int) -> UInt8[np.ndarray, "H W 3"]:
        """The picture of a frame, BGR."""
        return self._renderer.frame(index, index / self._rate_hz)

    def close(self) -> None:
        """Nothing is open."""


@dataclass(frozen=True, eq=False)
class Assembly:
    """Everything that a run needs, worked out from its scenario."""

    scenario: Scenario

    @cached_property
    def cameras(self) -> Mapping[str, Camera]:
        """The calibrated cameras."""
        return cameras_of(self.scenario)

    @cached_property
    def graph(self) -> Graph:
        """The communication graph."""
        return self.scenario.graph

    @cached_property
    def algorithm(self) -> Algorithm[Any]:
        """How the cameras average, tuned to their graph."""
        network = self.scenario.network
        return network.consensus.tuned(self.graph, network.iterations)

    @cached_property
    def links(self) -> Mapping[str, Links]:
        """The nodes, the central one last if there is one, and whom each exchanges messages with."""
        return links_of(self.graph, [self.scenario.central.name] if self.scenario.baselines.cpf else [])

    @property
    def pace(self) -> Pace:
        """When frames and rounds begin and end."""
        network = self.scenario.network
        return Pace(
            self.scenario.pace,
            self.scenario.rate_hz,
            network.deadline_s,
            network.iterations,
            self.scenario.lag_frames,
        )

    def prepare(self) -> None:
        """Works out what all nodes share, before they part."""
        _ = self.cameras, self.links, self.algorithm, self.setup
        if self.world is not None:
            _ = self.world.interior
        self.require_backend()

    def require_backend(self) -> None:
        """Makes sure that the cameras can have what the filter is to run on, before anything starts.

        Raises:
            KernelError: The compiled kernel cannot be had.
            ScenarioError: The emulated array cannot do what the options ask for.
        """
        if self.scenario.filter.backend == "compiled":
            load_kernel()
        elif self.scenario.filter.backend == "simd":
            first = self.scenario.cameras[0].name
            _ = self.model_on_camera(first), self.single(first)

    def try_array(self) -> None:
        """Takes a frame on the emulated array, if the whole tracker runs there: the picture must fit it too.

        Raises:
            ScenarioError: The array cannot follow the target from where it starts.
            SourceError: The camera's video cannot be read.
        """
        camera = self.scenario.cameras[0].name
        single = self.single(camera)
        if isinstance(single, ArrayEstimator):
            model = self.model(camera)
            with closing(self.source(camera)) as source:
                picture = model.look(source.read(0))
            with self._array_errors():
                single.begin(picture, None)
                single.step(1, {camera: (model, picture)})

    @contextmanager
    def _array_errors(self) -> Iterator[None]:
        try:
            yield
        except ValueError as error:
            raise ScenarioError(f"{self.scenario.name}: filter.backend is simd, but {error}") from error

    @cached_property
    def world(self) -> World | None:
        """The rendered world, if it is one."""
        if self.scenario.world is None:
            return None
        return build_world(self.scenario.world, self.scenario.seed)

    @cached_property
    def truth(self) -> Float[np.ndarray, "T D"] | None:
        """The target's true state in each frame, or None where nobody knows it.

        Raises:
            ScenarioError: The ground truth is shorter than the run.
        """
        scenario = self.scenario
        target, dynamics = scenario.target, scenario.filter.dynamics
        if self.world is not None:
            times = np.arange(scenario.frames) / scenario.rate_hz
            camera = next(iter(self.cameras.values()))
            return rendered_truth(self.world, target, camera, times, dynamics)
        if scenario.footage is None:
            return None
        return measured_truth(scenario.footage, target, scenario.frames, scenario.rate_hz, dynamics)

    @cached_property
    def start(self) -> Start:
        """What every filter is told about the target at frame 0.

        Raises:
            ScenarioError: It should be the truth, and there is none, or the camera cannot picture it.
        """
        scenario = self.scenario
        options, n_axes = scenario.target.start, scenario.target.n_axes
        if options.position == "truth":
            if self.truth is None:
                raise ScenarioError(
                    "target.start.position is truth, but the footage has no ground_truth: give the position"
                )
            position = self.truth[0, :n_axes]
            if not np.isfinite(position).all():
                raise ScenarioError(
                    f"target.start.position is truth, but camera {scenario.cameras[0].name} has"
                    f" {scenario.target.subject} behind it at frame 0: turn it, or begin the path in its view"
                )
        else:
            position = np.array(options.position)
        error = options.position_error * stream(scenario.seed, "start").standard_normal(n_axes)
        position, velocity = position + error, np.array(options.velocity)
        if scenario.filter.dynamics.model == "autoregressive":
            # [x(0), x(-1)]: both known as well
            before = position - velocity / scenario.rate_hz
            return Start(np.r_[position, before], np.full(2 * n_axes, options.position_deviation))
        deviations = np.repeat([options.position_deviation, options.velocity_deviation], n_axes)
        return Start(np.r_[position, velocity], deviations)

    @cached_property
    def setup(self) -> TrackingSetup:
        """What every estimator is told."""
        scenario = self.scenario
        return TrackingSetup(
            scenario.name,
            scenario.seed,
            scenario.rate_hz,
            scenario.target,
            self.start,
            scenario.filter,
            scenario.fusion,
        )

    def model(self, camera: str) -> ObservationModel:
        """The observation model of a camera, on the machine that this is."""
        return ObservationModel(self.cameras[camera], self.scenario.target, self.scenario.filter)

    def model_on_camera(self, camera: str) -> ObservationModel:
        """The observation model of a camera on its own processor.

        Raises:
            ScenarioError: The processor cannot do what the options ask for.
        """
        model, options = self.model(camera), self.scenario.filter
        if options.backend != "simd":
            return model
        with self._array_errors():
            return replace(model, processor=SimdLikelihood(options.simd, options.color, options.sampling))

    def single(self, camera: str) -> SirEstimator | ArrayEstimator | None:
        """A camera's filter on its own, if it is asked for; in the image plane wholly on its processor.

        Raises:
            ScenarioError: The processor cannot do what the options ask for.
        """
        if not self.scenario.baselines.single:
            return None
        if self.scenario.filter.backend != "simd" or self.scenario.target.space != "image":
            return SirEstimator(camera, "single", self.setup)
        with self._array_errors():
            return ArrayEstimator(camera, self.setup)

    def smart_camera(self, name: str) -> SmartCamera:
        """A camera's node."""
        network, neighbors = self.scenario.network, self.links[name].neighbors
        quantizer = network.payload.quantizer(self.scenario.seed, name)
        return SmartCamera(
            self.model_on_camera(name),
            self.setup,
            [
                Consensus(
                    name,
                    neighbors,
                    self.algorithm,
                    network.iterations,
                    quantizer,
                    Membership(name, self.graph, network.iterations),
                )
                for _ in range(1 + self.scenario.lag_frames)
            ],
            self.single(name),
        )

    def central(self) -> Central:
        """The central node."""
        models = {name: self.model(name) for name in self.cameras}
        return Central(self.scenario.central.name, models, self.setup)

    def source(self, camera: str) -> FrameSource:
        """Where a camera's pictures come from.

        Raises:
            SourceError: Its video cannot be read.
        """
        if self.world is None:
            source: FrameSource = video_source(self.scenario, camera)
        else:
            source = self._render(self.cameras[camera])
        return with_faults(source, self.cameras[camera], self.scenario.faults, self._render)

    def _render(self, camera: Camera) -> RenderedSource:
        if self.world is None:
            raise ValueError(f"{self.scenario.name} has no rendered world")
        try:
            return RenderedSource(self.world, camera, self.scenario.rate_hz)
        except ValueError as error:
            raise ScenarioError(f"{self.scenario.name}: {error}") from error

    def truth_message(self, frame: int, *, with_visibility: bool = True) -> TruthMessage | None:
        """The truth of a frame, or None where nobody knows it.

        Args:
            frame: Its index.
            with_visibility: Whether to work out what each camera sees of the target, where the world is
                rendered; it takes some milliseconds.
        """
        if self.truth is None or not np.isfinite(self.truth[frame]).all():
            return None
        time_s = frame / self.scenario.rate_hz
        seen: dict[str, Visibility] = {}
        if self.world is not None and with_visibility:
            target = self.scenario.target
            for name, camera in self.cameras.items():
                sight = visibility(self.world, camera, target.subject, time_s, target.part)
                seen[name] = Visibility(sight.in_view, sight.occluded)
        return TruthMessage(self.scenario.name, frame, time_s, self.truth[frame], seen)
