"""What a run has found, collected estimate by estimate, and its summary."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from network.wire.messages import EstimateMessage, PreviewMessage, StatusMessage, TruthMessage
from sim.metrics.errors import (
    LOST_DIAGONALS,
    LOST_ERROR,
    LOST_FRAMES,
    anees,
    disagreement,
    is_lost,
    position_errors,
    rmse,
)
from sim.metrics.loss import losses
from sim.metrics.sets import gospa, ospa
from sim.results.members import disagreements, membership
from sim.results.traffic import network_figures
from sim.scenario.model import Scenario

Track = tuple[str, str]
"""An estimator and the node that runs it."""


@dataclass(slots=True)
class Results:
    """Everything that a run has told.

    Attributes:
        scenario: The scenario as run.
        tracks: Each estimator's messages by frame.
        truth: The truth by frame.
        first_statuses: The status of each node after frame 0, whose messages are larger.
        statuses: The last status of each node that could tell it.
        timing: What the launcher has timed, by the names of the summary.
    """

    scenario: Scenario
    tracks: dict[Track, dict[int, EstimateMessage]] = field(default_factory=dict)
    truth: dict[int, TruthMessage] = field(default_factory=dict)
    first_statuses: dict[str, StatusMessage] = field(default_factory=dict)
    statuses: dict[str, StatusMessage] = field(default_factory=dict)
    timing: dict[str, float] = field(default_factory=dict)

    @property
    def frames_done(self) -> int:
        """Frames of which something is known."""
        return 1 + max((max(found) for found in self.tracks.values()), default=-1)

    def add(self, message: EstimateMessage | TruthMessage | StatusMessage | PreviewMessage) -> None:
        """Takes what a node, or the world, has told; pictures are no results."""
        match message:
            case EstimateMessage():
                self.tracks.setdefault((message.estimator, message.node), {})[message.frame] = message
            case TruthMessage():
                self.truth[message.frame] = message
            case StatusMessage(state="ready"):
                # a node that was started again counts from 0
                self.first_statuses.pop(message.node, None)
            case StatusMessage(state="running"):
                self.first_statuses.setdefault(message.node, message)
            case StatusMessage(state="done" | "failed"):
                self.statuses[message.node] = message

    def means(self, track: Track) -> Float[np.ndarray, "T D"]:
        """The estimates of a track from frame 0 on; NaN where there is none."""
        n_states = 2 * self.scenario.target.n_axes
        missing = np.full(n_states, np.nan)
        found = self.tracks.get(track, {})
        return np.array([found[k].mean if k in found else missing for k in range(self.scenario.frames)])

    def covariances(self, track: Track) -> Float[np.ndarray, "T D D"]:
        """The covariances of a track from frame 0 on; NaN where there is none."""
        n_states = 2 * self.scenario.target.n_axes
        missing = np.full((n_states, n_states), np.nan)
        found = self.tracks.get(track, {})
        return np.array([found[k].covariance if k in found else missing for k in range(self.scenario.frames)])

    def true_states(self) -> Float[np.ndarray, "T D"] | None:
        """The truth from frame 0 on, None where nobody knows it."""
        if not self.truth:
            return None
        missing = np.full(2 * self.scenario.target.n_axes, np.nan)
        return np.array(
            [self.truth[k].mean if k in self.truth else missing for k in range(self.scenario.frames)]
        )

    def errors(self, track: Track) -> Float[np.ndarray, " T"] | None:
        """The position error of a track in each frame from 1 on; None without a truth."""
        truth = self.true_states()
        return None if truth is None else position_errors(self.means(track), truth)[1:]

    @property
    def lost_error(self) -> float:
        """Mean error of the last frames above which the target counts as lost, in the target's unit."""
        size_px = self.scenario.target.size_px
        return LOST_ERROR if size_px is None else LOST_DIAGONALS * float(np.hypot(*size_px))

    def of(self, estimator: str) -> dict[str, Track]:
        """The tracks of an estimator by node, sorted by node."""
        return {node: (kind, node) for kind, node in sorted(self.tracks) if kind == estimator}


def summarize(results: Results, *, processes: int) -> dict[str, Any]:
    """The run's `summary.json`.

    Args:
        results: The run.
        processes: How many processes it took.

    Returns:
        Plain data; figures that cannot be known, as errors without a truth, are None. What is in metres is
        None in the image plane, and stands beside it in pixels.
    """
    scenario = results.scenario
    dcpf, single = results.of("dcpf"), results.of("single")
    cpf = next(iter(results.of("cpf").values()), None)
    joint = {node: results.tracks[track] for node, track in dcpf.items()}
    errors = {track: results.errors(track) for track in results.tracks}
    per_node = {node: _rmse(errors[track]) for node, track in dcpf.items()}
    all_nodes = [e for track in dcpf.values() if (e := errors[track]) is not None]
    total = _rmse(np.concatenate(all_nodes)) if all_nodes else None
    central = _rmse(errors[cpf]) if cpf else None
    lengths = {
        "rmse": {
            "dcpf": total,
            "cpf": central,
            "single": {node: _rmse(errors[track]) for node, track in single.items()},
            "dcpf_per_node": per_node,
        },
        "disagreement_per_frame": disagreements(joint, scenario.frames, scenario.target.n_axes),
        "disagreement": _number(disagreement(np.array([results.means(t)[1:] for t in dcpf.values()])))
        if dcpf
        else None,
    }
    limit = results.lost_error
    return {
        "scenario": scenario.name,
        "preset": scenario.preset,
        "seed": scenario.seed,
        "frames": scenario.frames,
        "cameras": [camera.name for camera in scenario.cameras],
        "processes": processes,
        "unit": scenario.target.unit,
        **in_unit(lengths, scenario.target.unit),
        "ratio_dcpf_cpf": _number(total / central) if total is not None and central else None,
        "lost": {
            "dcpf": _any_lost([errors[track] for track in dcpf.values()], limit),
            "cpf": _any_lost([errors[cpf]], limit) if cpf else None,
            "single": {node: _any_lost([errors[track]], limit) for node, track in single.items()},
        },
        "anees": {
            "dcpf": _anees(results, list(dcpf.values())),
            "cpf": _anees(results, [cpf] if cpf else []),
        },
        "tracking": {
            "dcpf": _tracking(results, list(dcpf.values())),
            "cpf": _tracking(results, [cpf] if cpf else []),
        },
        "network": network_figures(scenario, results.first_statuses, results.statuses),
        "members": membership(
            joint, [camera.name for camera in scenario.cameras], scenario.frames, results.statuses
        ),
        "fusion": _fusion(results),
        **_array(results),
        "timing": {**results.timing, **_timing(results)},
    }


def in_unit(lengths: Mapping[str, Any], unit: str) -> dict[str, Any]:
    """Lengths by name and unit; the keys in metres are always there."""
    unknown = {f"{name}_m": None for name in lengths}
    return {**unknown, **{f"{name}_{unit}": value for name, value in lengths.items()}}


def length(figures: Mapping[str, Any], name: str) -> Any:
    """A length of a summary, or of a comparison of summaries, in the unit that it has.

    Args:
        figures: The summary.
        name: `rmse` or `disagreement`.
    """
    return figures[f"{name}_{figures.get('unit', 'm')}"]


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _rmse(errors: Float[np.ndarray, " T"] | None) -> float | None:
    return None if errors is None else _number(rmse(errors))


def _any_lost(errors: list[Float[np.ndarray, " T"] | None], limit: float) -> bool | None:
    known = [e for e in errors if e is not None]
    # A node that died on the way has not lost the target, unless nobody is left who knows where it is.
    to_the_end = [e for e in known if not np.isnan(e[-LOST_FRAMES:]).all()]
    return any(is_lost(e, limit) for e in to_the_end or known) if known else None


def _anees(results: Results, tracks: list[Track]) -> float | None:
    truth = results.true_states()
    if truth is None or not tracks:
        return None
    each = np.array([anees(results.means(t)[1:], results.covariances(t)[1:], truth[1:]) for t in tracks])
    known = each[~np.isnan(each)]
    return _number(float(known.mean())) if known.size else None


def _tracking(results: Results, tracks: list[Track]) -> dict[str, float | None] | None:
    """The mean OSPA and GOSPA of an estimator's nodes, its losses of the target, and how long they lasted."""
    truth = results.true_states()
    if truth is None or not tracks:
        return None
    # Where nobody knows the truth, there is nothing to be far from.
    there = np.isfinite(truth[1:]).all(axis=1)
    known = [position_errors(results.means(track), truth)[1:][there] for track in tracks]
    cutoff = results.lost_error
    each = [loss for errors in known for loss in losses(errors, cutoff)]
    found_after = [loss.found - loss.first for loss in each if loss.found is not None]
    lengths = {
        "ospa": float(np.mean([ospa(errors, cutoff) for errors in known])),
        "gospa": float(np.sqrt(np.mean([gospa(errors, cutoff) ** 2 for errors in known]))),
    }
    return {
        **in_unit(lengths, results.scenario.target.unit),
        "losses_per_node": len(each) / len(known),
        "reacquired_after_s": float(np.mean(found_after)) / results.scenario.rate_hz if found_after else None,
    }


def counted(status: StatusMessage, group: str) -> Counter[str]:
    """What a node has counted of a group, such as `bytes`, by kind."""
    found = status.counters.get(group)
    return Counter(
        {kind: int(number) for kind, number in (found if isinstance(found, Mapping) else {}).items()}
    )


def _fusion(results: Results) -> dict[str, Any]:
    """How often Eq. 17's difference of information matrices was no density's; 0 for the other rules."""
    steps = max(1, len(results.of("dcpf")) * (results.scenario.frames - 1))
    names = ("indefinite_local", "indefinite_fused")
    return {
        f"{name}_fraction": sum(_plain(s.counters.get(name)) for s in results.statuses.values()) / steps
        for name in names
    }


def _array(results: Results) -> dict[str, Any]:
    """What a frame costs a camera on the emulated array, if there is one: the most over the cameras."""
    told = [status.counters["simd"] for status in results.statuses.values() if "simd" in status.counters]
    each = [figures for figures in told if isinstance(figures, Mapping)]
    if not each:
        return {}
    most = {name: max(figures[name] for figures in each) for name in each[0]}
    return {"simd": {**most, "rate_hz": min(figures["rate_hz"] for figures in each)}}


def _timing(results: Results) -> dict[str, Any]:
    """Percentiles over the cameras: the median of their medians, the largest of their 99th percentiles."""
    cameras = {camera.name for camera in results.scenario.cameras}
    timing: dict[str, Any] = {}
    for name in ("local_filter_ms", "consensus_round_ms"):
        found = [
            s.timing[name] for node, s in results.statuses.items() if node in cameras and name in s.timing
        ]
        each = [percentiles for percentiles in found if isinstance(percentiles, Mapping)]
        if each:
            timing[name] = {
                "p50": float(np.median([p["p50"] for p in each])),
                "p99": max(p["p99"] for p in each),
            }
    return timing


def _plain(value: object) -> float:
    return float(value) if isinstance(value, int | float) else 0.0
