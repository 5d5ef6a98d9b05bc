"""Work over many particles in shares, one a thread: everything about threads inside a node lives here.

Source: Truong & Kim (2017), Algorithms 1 and 2. NumPy, OpenCV and the compiled kernel let other threads run
while they work on arrays, so that threads of one process share its cores.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache

import numpy as np
from jaxtyping import Shaped


def n_shares(n: int, n_threads: int, least: int) -> int:
    """Threads that n particles keep busy: no more than `n_threads`, each with `least` or more."""
    return max(1, min(n_threads, n // least))


def in_shares(
    work: Callable[[slice], Shaped[np.ndarray, " m"]], n: int, n_threads: int, least: int
) -> Shaped[np.ndarray, " n"]:
    """Does work on n particles, in equal shares at the same time.

    Args:
        work: From a share to its results, a number for each particle.
        n: How many there are.
        n_threads: Threads, this one included.
        least: Particles of a share below which another thread costs more than it saves.

    Returns:
        The results of all shares, one after the other.
    """
    k = n_shares(n, n_threads, least)
    if k == 1:
        return work(slice(0, n))
    own, *others = (slice(n * i // k, n * (i + 1) // k) for i in range(k))
    running = [_pool(n_threads - 1, os.getpid()).submit(work, share) for share in others]
    try:
        first = work(own)
    finally:
        rest = [each.result() for each in running]
    return np.concatenate([first, *rest])


@lru_cache(maxsize=1)
def _pool(n_threads: int, _process: int) -> ThreadPoolExecutor:
    """Threads that stay; a forked process has none of its parent's."""
    return ThreadPoolExecutor(n_threads, thread_name_prefix="particles")
