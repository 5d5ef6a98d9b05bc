"""Work over many particles in shares, one a thread: everything about threads inside a node lives here.

Source: Truong & Kim (2017), Algorithms 1 and 2. NumPy, OpenCV and the compiled kernel let other threads run
while they work on arrays, so that threads of one process share its cores.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache


@lru_cache(maxsize=1)
def n_cores() -> int:
    """Cores that this process may use."""
    # not every system can tell which; joblib, which can, would cost every node its import
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def n_shares(n: int, n_threads: int, least: int) -> int:
    """Threads that n particles keep busy: no more than `n_threads` or cores, each with `least` or more."""
    return max(1, min(n_threads, n_cores(), n // least))


def in_shares(work: Callable[[slice], object], n: int, n_threads: int, least: int) -> None:
    """Does work on n particles, in equal shares at the same time.

    Args:
        work: Works on a share, and puts what it finds where it belongs.
        n: How many there are.
        n_threads: Threads, this one included.
        least: Particles of a share below which another thread costs more than it saves.
    """
    k = n_shares(n, n_threads, least)
    own, *others = (slice(n * i // k, n * (i + 1) // k) for i in range(k))
    running = [_pool(n_threads - 1, os.getpid()).submit(work, share) for share in others]
    try:
        work(own)
    finally:
        for each in running:
            each.result()


@lru_cache(maxsize=1)
def _pool(n_threads: int, _process: int) -> ThreadPoolExecutor:
    """Threads that stay; a forked process has none of its parent's."""
    return ThreadPoolExecutor(n_threads, thread_name_prefix="particles")
