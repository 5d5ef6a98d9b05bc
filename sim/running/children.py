"""The launcher's side of a run's processes: it starts their host, hears of them, and ends them all."""

import json
import queue
import shutil
import subprocess
import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from network.errors import NetworkError
from sim.running.head_start import take_host

LEAVE_S = 8.0
"""How long the host has for ending everybody before it is ended itself."""
USERS_FAULT = 2
"""Exit code of a host that could not have its endpoint."""


class RunFailed(Exception):  # noqa: N818 - what it says is that the run failed
    """The run could not go on; the text says which node failed and how."""


class Children:
    """The processes of a run. None is left when it is closed."""

    def __init__(self, scenario: Path, logs: Path, sockets: Path, by_hand: Sequence[str]) -> None:
        """Starts them and waits until the router listens.

        Args:
            scenario: The resolved scenario.
            logs: Folder of their logs.
            sockets: Folder of their sockets.
            by_hand: Nodes that somebody else starts.

        Raises:
            NetworkError: The router's endpoint cannot be had.
            RunFailed: The host could not start.
        """
        self._logs, self._sockets = logs, sockets
        self._told: queue.SimpleQueue[tuple[str, int]] = queue.SimpleQueue()
        self._host = take_host()
        order = {
            "scenario": str(scenario),
            "logs": str(logs),
            "sockets": str(sockets),
            "by_hand": list(by_hand),
        }
        self._order(json.dumps(order).encode() + b"\n")
        try:
            self._await_start()
        except BaseException:
            self.close()
            raise
        threading.Thread(target=self._listen, name="host", daemon=True).start()

    def __enter__(self) -> "Children":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def ended(self) -> list[tuple[str, int]]:
        """The nodes that have ended since the last look, with their exit codes.

        Raises:
            RunFailed: The host itself has ended, and with it everybody.
        """
        found = [self._told.get() for _ in range(self._told.qsize())]
        if not found and self._host.poll() is not None:
            raise RunFailed(f"the host of the run's processes ended: {self.last_words('host')}")
        return found

    def do(self, what: str, whom: str) -> None:
        """Orders a fault's end, or that of the router.

        Args:
            what: `wake` a node that is stopped, `start` one anew, `restart` the `router`.
            whom: The node, or the router.
        """
        self._order(json.dumps({what: whom}).encode() + b"\n")

    def last_words(self, name: str) -> str:
        """The last line of a process's log."""
        path = self._logs / f"{name}.log"
        lines = path.read_text(errors="replace").strip().splitlines() if path.is_file() else []
        return lines[-1] if lines else "it said nothing"

    def close(self) -> None:
        """Ends them all: by hanging up, and if that does not help, by force."""
        if self._host.stdin is not None:
            with suppress(BrokenPipeError):
                self._host.stdin.close()
        try:
            self._host.wait(LEAVE_S)
        except subprocess.TimeoutExpired:
            # The nodes notice that their host is gone and leave by themselves.
            self._host.kill()
            self._host.wait()
        shutil.rmtree(self._sockets, ignore_errors=True)

    def _order(self, line: bytes) -> None:
        # A host that is gone already is found so by whoever waits for its answer.
        with suppress(BrokenPipeError):
            if self._host.stdin is not None:
                self._host.stdin.write(line)
                self._host.stdin.flush()

    def _await_start(self) -> None:
        if self._host.stdout is not None and self._host.stdout.readline():
            return
        if self._host.wait() == USERS_FAULT:
            port = "another endpoint: --set network.router=tcp/127.0.0.1:7500"
            raise NetworkError(f"{self.last_words('host')}; {port}")
        early = self._host.stderr.read().decode(errors="replace").strip() if self._host.stderr else ""
        words = early.splitlines()[-1] if early else self.last_words("host")
        raise RunFailed(f"the host of the run's processes could not start: {words}")

    def _listen(self) -> None:
        for line in self._host.stdout or ():
            said = json.loads(line)
            self._told.put((said["ended"], said["code"]))
