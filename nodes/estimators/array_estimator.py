"""The tracker of Medeiros et al. (2008), whole on the emulated processor array, as a camera's own estimator.

In the image plane of one camera, with `filter.backend: simd`, prediction, weights, mean and resampling run on
the array too, and not the likelihood alone.
"""

from collections.abc import Mapping
from operator import attrgetter
from types import MappingProxyType
from typing import Any

import numpy as np

from network.wire.messages import EstimateMessage
from nodes.filtering.gaussian import Moments, moments
from nodes.filtering.motion import DynamicsOptions
from nodes.filtering.sighting import Sighting, shrinkage
from nodes.setup import FilterOptions, TrackingSetup
from nodes.simd.programs.binning import MAX_BINS, BinningOptions
from nodes.simd.report import FrameReport
from nodes.simd.tracker import SimdTracker
from nodes.simd.tracker_options import TrackerOptions
from nodes.vision.appearance import Appearance
from nodes.vision.observation import ObservationModel, Picture

FIXED: Mapping[str, Any] = MappingProxyType(
    {
        "color.parts": (1.0,),
        "color.background_weighting": False,
        "color.gain_correction": False,
        "likelihood.form": "literal",
        "likelihood.calibration": "fixed",
        "model_update.alpha": 0.0,
        "resampling.threshold": 1.0,
    }
)
"""Options of the filter whose value the paper's tracker has once and for all."""


def not_on_array(options: FilterOptions) -> dict[str, Any]:
    """What a filter asks for and the array's tracker does otherwise: the options, with what it does."""
    return {key: fixed for key, fixed in FIXED.items() if attrgetter(key)(options) != fixed}


class ArrayEstimator:
    """A camera's own filter on the array."""

    def __init__(self, node: str, setup: TrackingSetup) -> None:
        """A filter before its first frame.

        Args:
            node: Name of the node that runs it.
            setup: What the run tracks.

        Raises:
            ValueError: The array cannot do what the options ask for; the text says which and what to do.
        """
        self._node, self._setup = node, setup
        self._tracker = SimdTracker(_tracker_options(setup), setup.stream(node, "array"))
        self._appearance: Appearance | None = None
        self._sighting = Sighting()
        self._before = setup.start.moments

    @property
    def report(self) -> FrameReport:
        """What the last frame has cost."""
        return self._tracker.report()

    def begin(self, picture: Picture, appearance: Appearance | None) -> EstimateMessage:
        """Frame 0: takes the reference at the target's start.

        Args:
            picture: Of the camera.
            appearance: What the target looks like, to tell whether the estimate shows it.

        Raises:
            ValueError: The array cannot begin with this picture, or with the target at that place.
        """
        self._appearance = appearance
        self._tracker.begin(picture.image, self._before.mean)
        n = float(self._setup.filter.n_particles)
        return self._message(0, self._before, n, visible=True)

    def step(self, frame: int, pictures: Mapping[str, tuple[ObservationModel, Picture]]) -> EstimateMessage:
        """One frame.

        Args:
            frame: Its index.
            pictures: The camera's picture, and how it observes.
        """
        model, picture = pictures[self._node]
        position = self._tracker.step(picture.image)[0]
        particles, weights = self._tracker.particles(), self._tracker.weights()
        after = moments(particles, weights)
        ratio = shrinkage(moments(particles, np.full(len(particles), 1 / len(particles))), after)
        self._sighting = self._sighting.after(ratio)
        # [x, y, x_prev, y_prev], as the array holds it
        state = Moments(
            np.r_[position, self._before.mean[:2]],
            np.block(
                [
                    [after.covariance, np.zeros((2, 2))],
                    [np.zeros((2, 2)), self._before.covariance[:2, :2]],
                ]
            ),
        )
        self._before = state
        visible = self._appearance is not None and model.sees(
            model.sight(picture, position, self._appearance), self._appearance
        )
        return self._message(frame, state, self._tracker.ess(), visible=visible)

    def _message(self, frame: int, estimate: Moments, ess: float, *, visible: bool) -> EstimateMessage:
        return EstimateMessage(
            run=self._setup.run,
            node=self._node,
            estimator="single",
            frame=frame,
            time_s=frame / self._setup.rate_hz,
            mean=estimate.mean,
            covariance=estimate.covariance,
            visible=visible,
            lost=self._sighting.lost,
            ess=ess,
            iterations=0,
            members=(self._node,),
        )


def _tracker_options(setup: TrackingSetup) -> TrackerOptions:
    """The tracker's options from those of the run.

    Raises:
        ValueError: The array's tracker has no program for one of them.
    """
    chosen, size_px = setup.filter, setup.target.size_px
    if size_px is None or size_px != tuple(map(int, size_px)):
        raise ValueError(
            f"target.size_px is {size_px}: the array's tracker reads whole pixels, give such a size"
        )
    if chosen.color.space == "rgb":
        raise ValueError(
            "filter.color.space is rgb: the array's tracker bins hue or joint_rgb, take one of them"
        )
    if chosen.color.n_bins > MAX_BINS:
        raise ValueError(
            f"filter.color.bins_per_channel is {chosen.color.bins_per_channel}, which makes"
            f" {chosen.color.n_bins:,} bins, and the array's tracker has {MAX_BINS} at most: take fewer"
        )
    region_px = int(size_px[0]), int(size_px[1])
    if chosen.sampling.grid != region_px:
        raise ValueError(
            f"filter.sampling.grid is not {list(region_px)}, which target.size_px is: the array's tracker"
            " reads every pixel of the box, make them alike"
        )
    return TrackerOptions(
        simd=chosen.simd,
        binning=BinningOptions(space=chosen.color.space, bins=chosen.color.bins_per_channel),
        n_particles=(chosen.n_particles,),
        region_px=region_px,
        kernel=chosen.sampling.kernel,
        process=_process(chosen.dynamics),
        noise_px=float(np.sqrt(chosen.dynamics.position_variance)),
        # set from the background, it would be too sharp for ten bits: the paper's tracker has a fixed one
        sigma=chosen.likelihood.sigma,
    )


def _process(dynamics: DynamicsOptions) -> tuple[float, float]:
    if dynamics.model != "autoregressive" or isinstance(dynamics.A, tuple) or isinstance(dynamics.B, tuple):
        raise ValueError(
            "filter.dynamics must be autoregressive with numbers for A and B on the array (Eq. 2): set"
            " filter.dynamics.model, A and B"
        )
    return dynamics.A, dynamics.B
