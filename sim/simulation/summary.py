"""What a simulation has found: errors of all nodes over the frames, and the numbers that sum them up."""

import resource
import sys
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from network.streams import stream
from nodes.filtering.fusion import packed_size
from nodes.filtering.gaussian import Moments
from sim.metrics.errors import rmse
from sim.scenario.model import Scenario
from sim.simulation.gaussians import normalized_errors
from sim.simulation.simulation import SimulatedFrames


@dataclass(slots=True)
class Simulated:
    """Collects the frames of a simulation.

    Attributes:
        scenario: The scenario.
        truth: The true states.
        exact: The estimates with all measurements.
        errors: Of each node's position in each frame, m.
        exact_errors: Of the estimate with all measurements.
        nees: Normalised squared errors, of each node and frame, over the axes.
        exact_nees: Of the estimate with all measurements.
        seen: Who saw the target.
        disagreement: Mean distance between two nodes, in each frame, m.
        residual: Of the rounds, in each frame.
        last: The nodes' estimates in the last frame.
    """

    scenario: Scenario
    truth: list[Float[np.ndarray, " D"]] = field(default_factory=list)
    exact: list[Float[np.ndarray, " D"]] = field(default_factory=list)
    errors: list[Float[np.ndarray, " C"]] = field(default_factory=list)
    exact_errors: list[float] = field(default_factory=list)
    nees: list[Float[np.ndarray, " C"]] = field(default_factory=list)
    exact_nees: list[float] = field(default_factory=list)
    seen: list[Bool[np.ndarray, " C"]] = field(default_factory=list)
    disagreement: list[float] = field(default_factory=list)
    residual: list[float] = field(default_factory=list)
    last: Moments | None = None
    _orders: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self._orders = stream(self.scenario.seed, "disagreement")

    def add(self, frames: SimulatedFrames) -> None:
        """Takes a block of frames."""
        n_axes = frames.truth.shape[1] // 2
        truth, positions = frames.truth[:, :n_axes], frames.nodes.mean[:, :, :n_axes]
        exact = Moments(frames.exact.mean[:, None], frames.exact.covariance[:, None])
        self.disagreement.extend(self._disagreement(positions))
        self.truth.extend(frames.truth)
        self.exact.extend(frames.exact.mean)
        self.errors.extend(np.linalg.norm(positions - truth[:, None], axis=2))
        self.exact_errors.extend(np.linalg.norm(frames.exact.mean[:, :n_axes] - truth, axis=1).tolist())
        self.nees.extend(normalized_errors(frames.nodes, frames.truth))
        self.exact_nees.extend(normalized_errors(exact, frames.truth)[:, 0].tolist())
        self.seen.extend(frames.seen)
        self.residual.extend(frames.residual.tolist())
        self.last = Moments(frames.nodes.mean[-1], frames.nodes.covariance[-1])

    def _disagreement(self, positions: Float[np.ndarray, "T C A"]) -> list[float]:
        """Mean distance of nodes next to each other in a random order: of all pairs, there are too many."""
        n_frames, n_cameras, _ = positions.shape
        orders = self._orders.permuted(np.tile(np.arange(n_cameras), (n_frames, 1)), axis=1)
        shuffled = np.take_along_axis(positions, orders[:, :, None], axis=1)
        apart = np.linalg.norm(shuffled - np.roll(shuffled, 1, axis=1), axis=2)
        return apart.mean(axis=1).tolist()

    def summary(self, frame_s: float, total_s: float) -> dict[str, Any]:
        """The numbers, frame 0 left out.

        Args:
            frame_s: Median time of a frame.
            total_s: Time of everything.
        """
        scenario, errors, seen = self.scenario, np.array(self.errors)[1:], np.array(self.seen)[1:]
        size = packed_size(2 * scenario.target.n_axes, scenario.fusion)
        dcpf, cpf = rmse(errors), rmse(np.array(self.exact_errors)[1:])
        return {
            "scenario": scenario.name,
            "seed": scenario.seed,
            "frames": scenario.frames,
            "n_cameras": errors.shape[1],
            "rule": scenario.fusion.rule,
            "rmse_m": {
                "dcpf": dcpf,
                "cpf": cpf,
                "seeing": rmse(errors[seen]) if seen.any() else None,
                "median_node": float(np.median(np.sqrt((errors**2).mean(axis=0)))),
            },
            "ratio_dcpf_cpf": dcpf / cpf if cpf else None,
            "disagreement_m": float(np.mean(self.disagreement[1:])),
            "anees": {
                "dcpf": float(np.mean(self.nees[1:])),
                "cpf": float(np.mean(self.exact_nees[1:])),
                "median_node": float(np.median(np.mean(self.nees[1:], axis=0))),
            },
            "seeing_cameras": float(seen.sum(axis=1).mean()),
            "network": {
                "algorithm": scenario.network.consensus.algorithm,
                "iterations": scenario.network.iterations,
                "links": len(scenario.graph.edges),
                "numbers_per_message": size,
                "residual": float(np.mean(self.residual[1:])),
            },
            "timing": {
                "frame_ms": 1e3 * frame_s,
                "us_per_camera_and_frame": 1e6 * frame_s / errors.shape[1],
                "total_s": total_s,
            },
            "peak_memory_mb": _peak_memory_mb(),
        }


def _peak_memory_mb() -> float:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1 << 20 if sys.platform == "darwin" else 1 << 10)
