"""The processes of a run: started, watched, and all ended whatever happens.

Each child holds the reading end of a pipe whose other end is the launcher's: when that closes, however the
launcher ends, the child leaves by itself.
"""

import os
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Self

from network.errors import NetworkError
from network.sessions import RUNTIME_ENVIRONMENT

LEAVE_S = 3.0
"""How long a process has to leave by itself before it is ended."""
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


class RunFailed(Exception):  # noqa: N818 - what it says is that the run failed
    """The run could not go on; the text says which node failed and how."""


class Children:
    """The child processes of a launcher."""

    def __init__(self, logs: Path) -> None:
        """No child yet.

        Args:
            logs: Folder of the children's logs.
        """
        self._logs = logs
        self._router: subprocess.Popen[bytes] | None = None
        self._nodes: dict[str, subprocess.Popen[bytes]] = {}
        self._ended: set[str] = set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Ends them all: first by asking, then by force; the router goes last."""
        for process in self._nodes.values():
            _hang_up(process)
        _end(self._nodes.values())
        if self._router is not None:
            _hang_up(self._router)
            _end([self._router])

    def start_router(self, listen: Sequence[str], folder: Path) -> None:
        """Starts the router and waits until it listens.

        Args:
            listen: Its endpoints.
            folder: Of the sockets; the router removes it at the end.

        Raises:
            NetworkError: An endpoint cannot be had.
        """
        options = [option for endpoint in listen for option in ("--listen", endpoint)]
        command = [sys.executable, "-m", "sim.running.router", *options, "--sockets", str(folder)]
        with (self._logs / "router.log").open("wb") as log:
            self._router = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, start_new_session=True
            )
        said = self._router.stdout
        if said is None or not said.readline():
            raise NetworkError(self.last_words("router"))

    def start(self, name: str, command: Sequence[str]) -> None:
        """Starts a node."""
        with (self._logs / f"{name}.log").open("wb") as log:
            self._nodes[name] = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=log,
                env=os.environ | RUNTIME_ENVIRONMENT | ONE_THREAD,
                start_new_session=True,
            )

    def ended(self) -> Iterator[tuple[str, int]]:
        """The nodes that have ended, with their exit codes."""
        for name, process in self._nodes.items():
            code = process.poll()
            if code is not None:
                yield name, code

    def pid(self, name: str) -> int:
        """The process of a node."""
        return self._nodes[name].pid

    def last_words(self, name: str) -> str:
        """The last line of a child's log."""
        lines = (self._logs / f"{name}.log").read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else "it said nothing"


def _hang_up(process: subprocess.Popen[bytes]) -> None:
    """Closes the pipe that tells a child that its launcher is there."""
    if process.stdin is not None:
        process.stdin.close()


def _end(processes: Iterable[subprocess.Popen[bytes]]) -> None:
    limit = time.monotonic() + LEAVE_S
    waiting = list(processes)
    for end in (subprocess.Popen.terminate, subprocess.Popen.kill):
        for process in waiting:
            try:
                process.wait(max(0.0, limit - time.monotonic()))
            except subprocess.TimeoutExpired:
                end(process)
        limit = time.monotonic() + 1.0
        waiting = [process for process in waiting if process.poll() is None]
    for process in waiting:
        process.wait()
