"""The figures of many runs of one scenario with one setting."""

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

import numpy as np

from sim.metrics.consistency import anees_band
from sim.metrics.intervals import mean_interval
from sim.results.results import in_unit, length

_ESTIMATORS = ("dcpf", "cpf", "best_single")


def compare(runs: Sequence[Mapping[str, Any]], n_axes: int) -> dict[str, Any]:
    """The figures of many runs of one scenario.

    Args:
        runs: Their summaries.
        n_axes: Axes of the target's position.

    Returns:
        Medians and worst values over the runs, lengths in metres or, in the image plane, in pixels; of the
        RMSE the mean with its standard deviation and 95% confidence interval (bootstrap over the runs); None
        where there is no truth or no such baseline. `anees_band95` is where the mean of the runs' ANEES lies
        if the filter knows its error and a run's errors are all one: the widest that the band can be.
    """
    best = [_best_single(run) for run in runs]
    per_run = {
        "dcpf": [length(run, "rmse")["dcpf"] for run in runs],
        "cpf": [length(run, "rmse")["cpf"] for run in runs],
        "best_single": best,
    }
    ratios = [run["ratio_dcpf_cpf"] for run in runs]
    of_best = [d / s if d is not None and s else None for d, s in zip(per_run["dcpf"], best, strict=True)]
    unit = runs[0].get("unit", "m")
    lengths = {
        "rmse": {name: _spread(values) for name, values in per_run.items()},
        "mean_rmse": {name: _mean(values) for name, values in per_run.items()},
        "disagreement": _spread([length(run, "disagreement") for run in runs]),
    }
    return {
        "runs": len(runs),
        "unit": unit,
        **in_unit(lengths, unit),
        "ratio_dcpf_cpf": _spread(ratios),
        "ratio_dcpf_best_single": _spread(of_best),
        "lost_fraction": {name: _share([run["lost"][name] for run in runs]) for name in ("dcpf", "cpf")},
        "anees": {name: _spread([run["anees"][name] for run in runs]) for name in ("dcpf", "cpf")},
        "anees_band95": anees_band(len(runs), n_axes),
        "tracking": {name: _tracking([run["tracking"][name] for run in runs]) for name in ("dcpf", "cpf")},
        "bytes_per_frame": runs[0]["network"]["bytes_per_frame"],
        "indefinite_local_fraction": _spread([run["fusion"]["indefinite_local_fraction"] for run in runs]),
    }


def _best_single(run: Mapping[str, Any]) -> float | None:
    return min((value for value in length(run, "rmse")["single"].values() if value is not None), default=None)


def _spread(values: Sequence[float | None]) -> dict[str, float] | None:
    known = [value for value in values if value is not None]
    return {"median": median(known), "min": min(known), "max": max(known)} if known else None


def _share(facts: Sequence[bool | None]) -> float | None:
    known = [fact for fact in facts if fact is not None]
    return sum(known) / len(known) if known else None


def _mean(values: Sequence[float | None]) -> dict[str, float] | None:
    known = np.array([value for value in values if value is not None])
    if not len(known):
        return None
    found = mean_interval(known)
    deviation = float(known.std(ddof=1)) if len(known) > 1 else 0.0
    return {"mean": found.value, "low95": found.low, "high95": found.high, "deviation": deviation}


def _tracking(runs: Sequence[Mapping[str, Any] | None]) -> dict[str, Any] | None:
    known = [run for run in runs if run is not None]
    if not known:
        return None
    return {key: _spread([run[key] for run in known]) for key in known[0]}
