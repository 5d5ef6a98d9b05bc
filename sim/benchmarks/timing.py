"""Timing on a machine that others use, too: everything in turn, several times over, and medians."""

import time
from collections.abc import Callable, Mapping
from statistics import median

ROUNDS = 15
TURN_S = 0.02
"""Least time that one turn of a variant lasts, so that the clock and cold caches do not count."""


def times_in_turn(
    variants: Mapping[str, Callable[[], object]],
    clock: Callable[[], float] = time.thread_time,
    rounds: int = ROUNDS,
    turn_s: float = TURN_S,
    done: Callable[[], object] = lambda: None,
) -> dict[str, float]:
    """Runs variants one after the other, again and again, so that a disturbance meets them all.

    Args:
        variants: What to run, by name.
        clock: Seconds; by default those of this thread on a processor, which other processes lengthen least.
            What uses several threads needs `time.perf_counter`.
        rounds: How often each has its turn.
        turn_s: How long a turn lasts at least, in s.
        done: Called after each round.

    Returns:
        The median time of one call of each, in s.
    """
    repeats = {name: _repeats(run, turn_s) for name, run in variants.items()}
    times: dict[str, list[float]] = {name: [] for name in variants}
    for _ in range(rounds):
        for name, run in variants.items():
            run()
            began = clock()
            for _ in range(repeats[name]):
                run()
            times[name].append((clock() - began) / repeats[name])
        done()
    return {name: median(each) for name, each in times.items()}


def _repeats(run: Callable[[], object], turn_s: float) -> int:
    run()  # makes ready whatever is made once
    began = time.perf_counter()
    run()
    return max(1, round(turn_s / max(time.perf_counter() - began, 1e-9)))
