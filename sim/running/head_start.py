"""A head start for the host of a run's processes: it imports what it needs while the launcher still does.

Both take about a second for that, and most machines have two cores: side by side, a run starts a second
earlier. Only the standard library is imported here.
"""

import os
import subprocess
import sys

from network.links.runtime import ROUTER_RUNTIME

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

_waiting: list[subprocess.Popen[bytes]] = []


def start_host() -> None:
    """Starts a host, which waits for its order at its stdin and leaves when that closes."""
    _waiting.append(
        subprocess.Popen(
            [sys.executable, "-m", "sim.running.host"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=os.environ | ROUTER_RUNTIME | ONE_THREAD,
            # Ctrl-C in the terminal is the launcher's business.
            start_new_session=True,
        )
    )


def take_host() -> subprocess.Popen[bytes]:
    """The host that was started, or one that is started now."""
    if not _waiting:
        start_host()
    return _waiting.pop()
