"""The settings that the filter is measured in: three scenarios, in the middle of their run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import get_args

import numpy as np
from jaxtyping import Float

from nodes.counting.build import KernelError, load_kernel
from nodes.counting.histogram import SamplingOptions
from nodes.filtering.motion import predict
from nodes.filtering.particles import Particles
from nodes.filtering.sir import View, sir_step
from nodes.setup import TrackingSetup
from nodes.simd.likelihood import SimdLikelihood
from nodes.vision.appearance import Appearance
from nodes.vision.observation import ObservationModel, ObservationOptions, Picture
from nodes.vision.target import project_boxes
from sim.assembly import Assembly
from sim.benchmarks.loop import looping_like
from sim.scenario.loading import load_scenario
from sim.scenario.parsing import ScenarioError

SCENARIOS = Path(__file__).parents[2] / "scenarios"
"""Where the scenarios are, in a checkout."""
SETTINGS = {"A": "wica", "B": "embedded", "C": "scene1"}
"""A: 240 particles, boxes of 15 x 15 pixels, 40 hues, 256 x 240 (Medeiros et al. 2008); B: 300, 40 x 60, 512
joint bins, 320 x 240 (Truong & Kim 2017); C: 500, boxes that follow from the geometry, 3 x 8 bins, 640 x 480
(Jing & Chen)."""
FRAME = 10
"""The frame that is measured; the filter has followed the target until then."""
GRIDS = {"simd": (15, 15)}
"""Samples of a box, for a backend that cannot read all its pixels."""
LOOP = "loop"
"""The model that all others are measured against."""


@dataclass(frozen=True, eq=False)
class Setting:
    """A filter on one camera, before a frame.

    Attributes:
        setup: What the filter tracks.
        models: How the camera measures: by the loop, and by each backend that this machine has.
        picture: The frame.
        appearance: The reference.
        particles: The posterior of the frame before.
    """

    setup: TrackingSetup
    models: Mapping[str, ObservationModel]
    picture: Picture
    appearance: Appearance
    particles: Particles

    @cached_property
    def boxes(self) -> Float[np.ndarray, "N 4"]:
        """The boxes of the predicted particles."""
        model = self.models[LOOP]
        states = predict(self.particles.states, self.setup.motion, self.setup.stream("benchmark", "boxes"))
        return project_boxes(states[:, : model.target.n_axes], model.target, model.camera)

    def likelihood(self, name: str) -> Callable[[], object]:
        """From the picture and the boxes to d², by a model."""
        model = self.models[name]
        return lambda: model.box_distances(self.picture, self.boxes, self.appearance)

    def step(self, name: str) -> Callable[[], object]:
        """The filter's whole step, by a model: predict, likelihood, estimate, resample."""
        views = [View(self.models[name], self.picture, self.appearance)]
        motion, rng = self.setup.motion, self.setup.stream("benchmark", "step")
        threshold = self.setup.filter.resampling.threshold
        return lambda: sir_step(self.particles, views, motion, threshold, rng)


def setting(letter: str, folder: Path, overrides: Sequence[tuple[str, str]] = ()) -> Setting:
    """Runs a scenario's first camera until the frame that is measured.

    Args:
        letter: One of `SETTINGS`.
        folder: Where the scenarios are.
        overrides: Keys and values set besides.

    Raises:
        ScenarioError: A scenario is not there, or the camera does not see the target at the start.
    """
    path = folder / f"{SETTINGS[letter]}.yaml"
    measured = [("filter.backend", "fast"), ("filter.sampling.grid", "null")]
    fixed = [("preset", "paper"), ("frames", str(FRAME + 1)), *measured]
    assembly = Assembly(load_scenario(path, [*fixed, *overrides]))
    setup, camera = assembly.setup, next(iter(assembly.cameras))
    model, source = assembly.model(camera), assembly.source(camera)
    # frame 0: the reference
    start, first = setup.start.mean[: setup.target.n_axes], model.look(source.read(0))
    appearance = model.first_appearance(first, start)
    if appearance is None:
        raise ScenarioError(f"{path}: {camera} does not see the target at frame 0: take the shipped scenario")
    models = {
        LOOP: looping_like(model, first, project_boxes(start[None], setup.target, model.camera)[0]),
        **{name: _with_backend(model, name) for name in backends()},
    }
    # the frames until the one that is measured
    rng = setup.stream("benchmark", "before")
    particles = setup.first_particles(rng)
    for frame in range(1, FRAME):
        view = View(model, model.look(source.read(frame)), appearance)
        particles, _ = sir_step(particles, [view], setup.motion, setup.filter.resampling.threshold, rng)
    return Setting(setup, models, model.look(source.read(FRAME)), appearance, particles)


def backends() -> tuple[str, ...]:
    """The values of `filter.backend` that this machine has."""
    known: tuple[str, ...] = get_args(ObservationOptions.model_fields["backend"].annotation)
    try:
        load_kernel()
    except KernelError:
        return tuple(name for name in known if name != "compiled")
    return known


def _with_backend(model: ObservationModel, name: str) -> ObservationModel:
    sampling = SamplingOptions(grid=GRIDS.get(name))
    options = model.options.model_copy(update={"backend": name, "sampling": sampling})
    processor = SimdLikelihood(options.simd, options.color, sampling) if name == "simd" else None
    return replace(model, options=options, processor=processor)
