"""Where parts are computed: in this process, in processes of this machine, or on a cluster engine."""

from collections.abc import Generator, Sequence
from typing import Any

import joblib
from joblib.externals.loky import get_reusable_executor

from sim.experiments.computing.errors import EngineError
from sim.experiments.computing.parts import Part, code_version
from sim.experiments.computing.work import compute

Result = tuple[Part, dict[str, Any]]

_CONNECT_S = 10


def compute_here(parts: Sequence[Part], n_jobs: int) -> Generator[Result, None, None]:
    """Computes parts on this machine, and yields each when it is done.

    Args:
        parts: What to compute.
        n_jobs: Processes to spread it over; with one, this process does it.
    """
    if n_jobs == 1:
        yield from (_with_part(part, code_version()) for part in parts)
        return
    try:
        parallel = joblib.Parallel(n_jobs=n_jobs, return_as="generator_unordered", batch_size=1)
        yield from parallel(joblib.delayed(_with_part)(part, code_version()) for part in parts)
    finally:
        # The workers would stay for a while, in case there is more to do.
        get_reusable_executor().shutdown(wait=True)


def compute_on_cluster(parts: Sequence[Part], address: str) -> Generator[Result, None, None]:
    """Computes parts on a Dask cluster, and yields each when it is done.

    Args:
        parts: What to compute.
        address: Of its scheduler, such as `tcp://10.0.0.1:8786`.

    Raises:
        EngineError: Nobody answers there, Dask is not installed here, or the workers run
            another version of the program.
    """
    try:
        from distributed import Client, as_completed  # noqa: PLC0415 - an extra
    except ImportError:
        raise EngineError('--cluster needs Dask: pip install "dcpf[cluster]"') from None
    try:
        client = Client(address, timeout=_CONNECT_S)  # type: ignore[no-untyped-call]  # distributed has no types
    except (OSError, ValueError) as error:
        raise EngineError(
            f"--cluster {address}: no Dask scheduler answers there: start one, or name another address"
        ) from error
    with client:
        futures = client.map(_with_part, parts, code=code_version(), pure=False)
        try:
            yield from (result for _, result in as_completed(futures, with_results=True))  # type: ignore[no-untyped-call]  # distributed has no types
        finally:
            client.cancel(futures)  # type: ignore[no-untyped-call]  # distributed has no types


def _with_part(part: Part, code: str) -> Result:
    return part, compute(part, code)
