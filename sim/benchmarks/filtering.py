"""The filter against the loop that a user would write, in one run."""

from collections.abc import Callable
from pathlib import Path

import cv2
from threadpoolctl import threadpool_limits

from sim.benchmarks.settings import LOOP, SETTINGS, Setting, setting
from sim.benchmarks.timing import ROUNDS, times_in_turn

Ratios = dict[str, float]
"""By backend how many times faster than the loop, and `loop_ms`, what the loop takes."""


def bench_filter(
    folder: Path, done: Callable[[], object] = lambda: None, rounds: int = ROUNDS
) -> dict[str, dict[str, Ratios]]:
    """Measures the likelihood and the whole step in all settings.

    Args:
        folder: Where the settings' scenarios are.
        done: Called after each round; there are `n_rounds` of them.
        rounds: How often everything has its turn.

    Returns:
        `likelihood` and `step`, for each setting.

    Raises:
        ScenarioError: A scenario is not there.
    """
    # As in the nodes' processes.
    cv2.setNumThreads(1)
    threadpool_limits(1)
    report: dict[str, dict[str, Ratios]] = {"likelihood": {}, "step": {}}
    for letter in SETTINGS:
        chosen = setting(letter, folder)
        report["likelihood"][letter] = _ratios(chosen, chosen.likelihood, rounds, done)
        report["step"][letter] = _ratios(chosen, chosen.step, rounds, done)
    return report


def n_rounds(rounds: int = ROUNDS) -> int:
    """How often `bench_filter` calls `done`."""
    return 2 * len(SETTINGS) * rounds


def _ratios(
    chosen: Setting, what: Callable[[str], Callable[[], object]], rounds: int, done: Callable[[], object]
) -> Ratios:
    took = times_in_turn({name: what(name) for name in chosen.models}, rounds=rounds, done=done)
    loop = took.pop(LOOP)
    return {**{name: loop / time for name, time in took.items()}, "loop_ms": 1e3 * loop}
