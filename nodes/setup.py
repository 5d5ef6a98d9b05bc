"""What every estimator of a run is told: the target and its start, the options, the run's name and seed."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from pydantic import Field

from network.options import Options
from network.streams import stream
from nodes.filtering.fusion import FusionOptions
from nodes.filtering.gaussian import Moments
from nodes.filtering.motion import DynamicsOptions, MotionModel, motion_model
from nodes.filtering.particles import Particles, sample_gaussian, sample_moments
from nodes.vision.observation import ObservationOptions
from nodes.vision.target import TargetOptions


class ResamplingOptions(Options):
    """When particles are resampled (systematically)."""

    threshold: float = Field(default=0.5, ge=0, le=1)
    """Effective sample size, as a fraction of the particles, below which they are."""


class FilterOptions(ObservationOptions):
    """The particle filters: local, fusion, centralised and single-camera alike."""

    n_particles: int = Field(default=500, ge=2, le=1_000_000)
    """Particles of each filter."""
    dynamics: DynamicsOptions = DynamicsOptions()
    resampling: ResamplingOptions = ResamplingOptions()


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """What is known of the target's state at frame 0.

    Attributes:
        mean: The state.
        deviation: Standard deviation of each of its components.
    """

    mean: Float[np.ndarray, " D"]
    deviation: Float[np.ndarray, " D"]

    @property
    def moments(self) -> Moments:
        """The start as a Gaussian: the estimate of frame 0."""
        return Moments(self.mean, np.diag(self.deviation**2))


@dataclass(frozen=True, eq=False)
class TrackingSetup:
    """What a smart camera and the central node have in common.

    Attributes:
        run: Name of the run.
        seed: The scenario's seed.
        rate_hz: Frames a second.
        target: What is tracked.
        start: Its state at frame 0.
        filter: Options of the filters.
        fusion: Options of the fusion.
    """

    run: str
    seed: int
    rate_hz: float
    target: TargetOptions
    start: Start
    filter: FilterOptions
    fusion: FusionOptions

    @cached_property
    def motion(self) -> MotionModel:
        """The state model at the run's frame rate."""
        return motion_model(self.target.n_axes, 1 / self.rate_hz, self.filter.dynamics)

    def stream(self, *names: str) -> np.random.Generator:
        """The random stream of a filter, by its node's and its own name."""
        return stream(self.seed, *names)

    def particles(self, known: Moments, rng: np.random.Generator) -> Particles:
        """Particles around a state that is known from elsewhere."""
        return sample_moments(known.mean, known.covariance, self.filter.n_particles, rng)

    def first_particles(self, rng: np.random.Generator) -> Particles:
        """Particles around the start."""
        return sample_gaussian(self.start.mean, self.start.deviation, self.filter.n_particles, rng)
