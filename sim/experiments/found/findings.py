"""What an experiment has found, as arrays: runs x frames, in the unit of the target's space."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Float, Int

from sim.experiments.computing.parts import Kind
from sim.experiments.found.joining import joined
from sim.experiments.options import ExperimentOptions
from sim.experiments.plan import Group
from sim.metrics.errors import rmse

Track = Literal["dcpf", "cpf", "single", "coded"]
"""Whose error: all nodes of DCPF, CPF, the best single camera of each run, CPF on pictures sent as JPEG."""

_NODES: Mapping[Track, tuple[Kind, str]] = {
    "dcpf": ("cameras", "dcpf"),
    "cpf": ("central", "cpf"),
    "single": ("cameras", "single"),
    "coded": ("coded", "cpf"),
}


@dataclass(frozen=True, slots=True, eq=False)
class GroupFindings:
    """What the runs of a group have found.

    Attributes:
        group: The group.
        results: Each run's parts, as `sim.experiments.computing.work.compute` returns them.
    """

    group: Group
    results: Sequence[Mapping[Kind, Mapping[str, Any]]]

    @property
    def unit(self) -> str:
        """The unit of positions and errors: m, or px in the image plane."""
        return self.group.scenario_run.target.unit

    @property
    def settings(self) -> dict[str, str]:
        """The swept keys and their values."""
        return dict(self.group.settings)

    def has(self, track: Track) -> bool:
        """Whether the runs have such estimates, and a truth to hold them against."""
        kind, estimator = _NODES[track]
        result = self.results[0].get(kind, {})
        names = result.get("tracks", {})
        return result.get("truth") is not None and any(name.startswith(f"{estimator}/") for name in names)

    def summaries(self) -> list[dict[str, Any]]:
        """Each run's summary, as `summary.json` has it, without what depends on the machine."""
        return [joined({kind: result["summary"] for kind, result in run.items()}) for run in self.results]

    def truth(self) -> Float[np.ndarray, "R T A"]:
        """The true positions of each run, from frame 0 on."""
        return np.array([next(iter(run.values()))["truth"] for run in self.results], dtype=float)

    def positions(self, track: Track) -> Float[np.ndarray, "R C T A"]:
        """The estimated positions of each run and node, from frame 0 on; NaN where there is none."""
        return np.array(self._each(track, "positions"), dtype=float)

    def nees(self, track: Track) -> Float[np.ndarray, "R C T"]:
        """The normalised estimation error squared of each run, node and frame; NaN where it is none."""
        return np.array(self._each(track, "nees"), dtype=float)

    def node_errors(self, track: Track) -> Float[np.ndarray, "R C T"]:
        """The position error of each run and node, from frame 1 on."""
        return np.linalg.norm(self.positions(track) - self.truth()[:, None], axis=3)[:, :, 1:]

    def node_rmse(self, track: Track) -> Float[np.ndarray, "R C"]:
        """The RMSE of each run and node; NaN where a node has no estimate at all."""
        return np.array([[rmse(errors) for errors in run] for run in self.node_errors(track)])

    def best(self, track: Track) -> Int[np.ndarray, "R C"]:
        """The nodes of each run that stand for the estimator: all, but of single cameras the best only."""
        rmse_m = self.node_rmse(track)
        if track == "single":
            return np.nan_to_num(rmse_m, nan=np.inf).argmin(axis=1)[:, None]
        return np.tile(np.arange(rmse_m.shape[1]), (len(rmse_m), 1))

    def errors(self, track: Track) -> Float[np.ndarray, "R C T"]:
        """The position error of each run and node that stands for the estimator, from frame 1 on."""
        return np.take_along_axis(self.node_errors(track), self.best(track)[:, :, None], axis=1)

    def scored(self, track: Track) -> list[Float[np.ndarray, "C T"]]:
        """The same without the frames whose truth nobody knows: NaN is a missing estimate there."""
        there = np.isfinite(self.truth()[:, 1:]).all(axis=2)
        return [errors[:, known] for errors, known in zip(self.errors(track), there, strict=True)]

    def rmse(self, track: Track) -> Float[np.ndarray, " R"]:
        """The RMSE of each run: over the nodes of DCPF, of the best single camera."""
        return np.array([rmse(run) for run in self.errors(track)])

    def paths(self, track: Track) -> Float[np.ndarray, "R T A"]:
        """Where each run's estimates were: the mean of DCPF's nodes, the best single camera's."""
        best = self.best(track)[:, :, None, None]
        return np.take_along_axis(self.positions(track), best, axis=1).mean(axis=1)

    def cpu_ms(self, kind: Kind) -> Float[np.ndarray, " R"]:
        """Processor time a frame of all nodes of a part together, in each run; depends on the machine."""
        return np.array([run[kind]["cpu_ms_per_frame"] for run in self.results])

    def bytes_per_frame(self) -> dict[str, float]:
        """Bytes sent in a frame, in the mean of the runs, by what is sent: `dcpf`, `cpf`, `jpeg`, `bins`."""
        sent: dict[str, list[float]] = {}
        for run, summary in zip(self.results, self.summaries(), strict=True):
            coded = run.get("coded", {}).get("bytes_per_frame", {})
            for name, octets in {**summary["network"]["bytes_per_frame"], **coded}.items():
                sent.setdefault(name, []).append(octets)
        return {name: float(np.mean(each)) for name, each in sent.items()}

    def _each(self, track: Track, what: str) -> list[list[Any]]:
        kind, estimator = _NODES[track]
        return [
            [found[what] for name, found in run[kind]["tracks"].items() if name.startswith(f"{estimator}/")]
            for run in self.results
        ]


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """What an experiment has found.

    Attributes:
        options: The experiment.
        groups: What each group of runs has found, study by study.
        missing: How many runs of each study are not there: it was interrupted, or they failed.
    """

    options: ExperimentOptions
    groups: tuple[GroupFindings, ...]
    missing: Mapping[str, int]

    def study(self, name: str, label: str | None = None) -> list[GroupFindings]:
        """The groups of a study, of one scenario and preset if a label is given."""
        return [
            each for each in self.groups if each.group.study == name and label in (None, each.group.label)
        ]

    def labels(self, name: str) -> list[str]:
        """The scenarios and presets of a study, in their order."""
        return list(dict.fromkeys(each.group.label for each in self.study(name)))
