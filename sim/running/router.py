"""The run's router as a process of its own: the one place where the outside connects.

It also owns the folder of the run's sockets, since it is the last to leave, however the others end.
"""

import argparse
import shutil
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

from network import sessions
from network.errors import NetworkError

LINGER_S = 0.5
"""The router stays this long after its launcher, so that the nodes still find it when they say goodbye."""


def main(arguments: Sequence[str] | None = None) -> int:
    """The launcher's child: says `ready` on stdout, leaves when its stdin closes."""
    parser = argparse.ArgumentParser(prog="python -m sim.running.router")
    parser.add_argument("--listen", action="append", required=True)
    parser.add_argument("--sockets", type=Path, required=True)
    parsed = parser.parse_args(arguments)
    # The launcher says when to leave; Ctrl-C reaches everybody in the terminal.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        session = sessions.open_router(parsed.listen)
    except NetworkError as error:
        print(error, file=sys.stderr)  # noqa: T201 - the launcher reads it there
        return 2
    print("ready", flush=True)  # noqa: T201 - the launcher waits for it
    sys.stdin.buffer.read()
    threading.Event().wait(LINGER_S)
    sessions.close(session)
    shutil.rmtree(parsed.sockets, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
