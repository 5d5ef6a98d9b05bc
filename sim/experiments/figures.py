"""Many runs: each scenario with several seeds, paired between the estimators, over the cores."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import joblib

from sim.assembly import Assembly
from sim.running.in_process import run_in_process
from sim.running.results import Results, summarize
from sim.scenario.loading import load_scenario

Override = tuple[str, str]


def run_once(path: Path, overrides: Sequence[Override]) -> dict[str, Any]:
    """One run in this process, and its summary."""
    scenario = load_scenario(path, overrides)
    results = Results(scenario)
    for message in run_in_process(Assembly(scenario)):
        results.add(message)
    return summarize(results, processes=1)


def run_many(
    paths: Sequence[Path], overrides: Sequence[Override], seeds: Sequence[int], n_jobs: int
) -> Iterator[dict[str, Any]]:
    """Runs every scenario with every seed; the summaries come in this order, whatever the number of jobs.

    Args:
        paths: The scenario files.
        overrides: Keys and values set in all of them.
        seeds: Of the runs.
        n_jobs: Processes to spread them over.
    """
    cells = [(path, [*overrides, ("seed", str(seed))]) for path in paths for seed in seeds]
    if n_jobs == 1:
        yield from (run_once(*cell) for cell in cells)
        return
    parallel = joblib.Parallel(n_jobs=n_jobs, return_as="generator", batch_size=1)
    yield from parallel(joblib.delayed(run_once)(*cell) for cell in cells)


def compare(runs: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The figures of many runs of one scenario.

    Args:
        runs: Their summaries.

    Returns:
        Medians and worst values over the runs, in metres where they are lengths; None where there is no truth
        or no such baseline.
    """
    best = [_best_single(run) for run in runs]
    per_run = {
        "dcpf": [run["rmse_m"]["dcpf"] for run in runs],
        "cpf": [run["rmse_m"]["cpf"] for run in runs],
        "best_single": best,
    }
    ratios = [run["ratio_dcpf_cpf"] for run in runs]
    of_best = [d / s if d is not None and s else None for d, s in zip(per_run["dcpf"], best, strict=True)]
    return {
        "runs": len(runs),
        "rmse_m": {name: _spread(values) for name, values in per_run.items()},
        "ratio_dcpf_cpf": _spread(ratios),
        "ratio_dcpf_best_single": _spread(of_best),
        "lost_fraction": {
            name: sum(bool(run["lost"][name]) for run in runs) / len(runs) for name in ("dcpf", "cpf")
        },
        "disagreement_m": _spread([run["disagreement_m"] for run in runs]),
        "anees": {name: _spread([run["anees"][name] for run in runs]) for name in ("dcpf", "cpf")},
        "bytes_per_frame": runs[0]["network"]["bytes_per_frame"],
        "indefinite_local_fraction": _spread([run["fusion"]["indefinite_local_fraction"] for run in runs]),
    }


def _best_single(run: dict[str, Any]) -> float | None:
    return min((value for value in run["rmse_m"]["single"].values() if value is not None), default=None)


def _spread(values: Sequence[float | None]) -> dict[str, float] | None:
    known = [value for value in values if value is not None]
    return {"median": median(known), "min": min(known), "max": max(known)} if known else None
