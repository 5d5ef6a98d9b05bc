"""Runs an experiment: what is on disk is read, the rest is computed and kept."""

from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import replace
from typing import Any

from sim.experiments.computing.engine import Result
from sim.experiments.computing.parts import Part
from sim.experiments.computing.store import Store
from sim.experiments.found.findings import Findings, GroupFindings
from sim.experiments.plan import Plan

Engine = Callable[[list[Part]], Generator[Result, None, None]]
ProgressBar = Callable[[int], AbstractContextManager[Callable[[int], None]]]


@contextmanager
def _without_progress(_total: int) -> Iterator[Callable[[int], None]]:
    yield lambda _done: None


def compute_missing(
    plan: Plan,
    store: Store,
    engine: Engine,
    results: dict[str, Mapping[str, Any]],
    progress: ProgressBar = _without_progress,
) -> None:
    """Reads what is on disk and computes the rest; however it ends, what is finished is in the results.

    Args:
        plan: The experiment.
        store: Where finished parts are kept.
        engine: Computes parts, in any order.
        results: Takes each part's result, by its key.
        progress: Makes a bar for so many parts; it is told how many are done.

    Raises:
        RecordingError: The disk is full.
    """
    missing: list[Part] = []
    for part in plan.parts():
        found = store.read(part.key)
        if found is None:
            missing.append(part)
        else:
            results[part.key] = found
    if missing:
        with progress(len(missing)) as bar, closing(engine(missing)) as done:
            for count, (part, result) in enumerate(done, 1):
                store.write(part.key, result)
                results[part.key] = result
                bar(count)


def findings_of(plan: Plan, results: Mapping[str, Mapping[str, Any]]) -> Findings:
    """What the runs have found of which every part is there."""
    groups: list[GroupFindings] = []
    missing: dict[str, int] = {}
    for group in plan.groups:
        runs = [
            (seed, parts)
            for seed, parts in zip(group.seeds, group.parts, strict=True)
            if all(part.key in results for part in parts.values())
        ]
        missing[group.study] = missing.get(group.study, 0) + len(group.parts) - len(runs)
        if runs:
            seeds, parts = zip(*runs, strict=True)
            each = [{kind: results[part.key] for kind, part in run.items()} for run in parts]
            groups.append(GroupFindings(replace(group, seeds=seeds, parts=parts), each))
    return Findings(plan.options, tuple(groups), missing)
