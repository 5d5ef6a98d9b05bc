"""Runs an experiment: what is on disk is read, the rest is computed and kept."""

from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager
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


def run_experiment(
    plan: Plan, store: Store, engine: Engine, progress: ProgressBar = _without_progress
) -> Findings:
    """Runs an experiment.

    Args:
        plan: The experiment.
        store: Where finished parts are kept.
        engine: Computes parts, in any order.
        progress: Makes a bar for so many parts; it is told how many are done.

    Returns:
        What was found; it does not depend on the engine, nor on what was on disk already.

    Raises:
        RecordingError: The disk is full.
    """
    results: dict[str, Mapping[str, Any]] = {}
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
    groups = [
        GroupFindings(group, [{kind: results[part.key] for kind, part in run.items()} for run in group.parts])
        for group in plan.groups
    ]
    return Findings(plan.options, tuple(groups))
