"""The host of a run's processes: starts the nodes, then becomes the run's router, and is the last to leave.

It imports what a node needs once and forks each node from there, which starts a run faster than so
many interpreters and lets them share their memory. The forks come first: no thread and no session of Zenoh
exists yet, neither of which would survive one.

Everybody leaves when the one before does, however it ends: the host when its stdin closes, the nodes when the
host's pipe does. The host also owns the folder of the run's sockets.
"""

import json
import logging
import math
import os
import select
import shutil
import signal
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import cv2
import zenoh

from network.errors import NetworkError
from network.links import sessions
from nodes.imaging.sources import SourceError
from sim.assembly import Assembly
from sim.faults.schedule import absences
from sim.running.endpoints import Endpoints, run_endpoints
from sim.running.node import run_node, stop_on_signals
from sim.scenario.loading import load_scenario
from sim.scenario.parsing import ScenarioError

LEAVE_S = 3.0
"""How long a node has to leave by itself before it is ended."""
POLL_S = 0.02
ROUTER_AWAY_S = 0.5
"""How long a router that is restarted is away."""

_log = logging.getLogger(__name__)


def main() -> int:
    """The launcher's child: takes its order at stdin, tells on stdout who has started and who has ended."""
    # The launcher says when to leave; Ctrl-C in a terminal reaches everybody.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    said = b""
    while not said.endswith(b"\n"):
        more = os.read(0, 1 << 16)
        if not more:
            return 0  # nothing was to be run
        said += more
    order = json.loads(said)
    log = os.open(Path(order["logs"]) / "host.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    os.dup2(log, 2)
    # No thread survives a fork: OpenCV must not start its own for what all nodes share.
    cv2.setNumThreads(1)
    assembly = Assembly(load_scenario(Path(order["scenario"])))
    assembly.prepare()
    endpoints = run_endpoints(assembly.scenario, Path(order["sockets"]), order["by_hand"])
    nodes = Nodes(assembly, endpoints, Path(order["logs"]))
    for name in endpoints.nodes:
        if name not in order["by_hand"]:
            nodes.fork(name)
    for absence in absences(assembly.scenario.faults):
        if absence.forgets and absence.end is not None and absence.node not in order["by_hand"]:
            nodes.fork_spare(absence.node)
    router = Router([endpoints.router, assembly.scenario.network.router])
    try:
        router.open()
    except NetworkError as error:
        print(error, file=sys.stderr)  # noqa: T201 - the launcher reads it there
        nodes.end()
        return 2
    try:
        _tell(started=nodes.running)
        _watch(nodes, router)
        nodes.end()
    finally:
        router.close()
        shutil.rmtree(order["sockets"], ignore_errors=True)
    return 0


class Router:
    """The run's router."""

    def __init__(self, listen: Sequence[str]) -> None:
        """A router that is not there yet; `listen` is where it will be found."""
        self._listen = listen
        self._session: zenoh.Session | None = None

    def open(self) -> None:
        """Starts it.

        Raises:
            NetworkError: An endpoint cannot be had.
        """
        self._session = sessions.open_router(self._listen)

    def close(self) -> None:
        """Ends it."""
        if self._session is not None:
            sessions.close(self._session)
            self._session = None


class Nodes:
    """The forked nodes."""

    def __init__(self, assembly: Assembly, endpoints: Endpoints, logs: Path) -> None:
        """No node yet.

        Args:
            assembly: The run.
            endpoints: Where they find each other.
            logs: Folder of their logs.
        """
        self.running: dict[str, int] = {}
        self._spares: dict[str, list[tuple[int, int]]] = {}  # process, and the pipe that wakes it
        self._assembly, self._endpoints, self._logs = assembly, endpoints, logs
        self._there, self._here = os.pipe()

    def fork(self, name: str) -> None:
        """Starts a node."""
        (self._logs / f"{name}.log").write_bytes(b"")
        pid = os.fork()
        if pid:
            self.running[name] = pid
            return
        os.close(self._here)
        self._live(name)

    def fork_spare(self, name: str) -> None:
        """Forks a process now that will be a node later, when it is too late for a fork."""
        there, here = os.pipe()
        pid = os.fork()
        if pid:
            os.close(there)
            self._spares.setdefault(name, []).append((pid, here))
            return
        # nobody but the host may hold a pipe whose end tells of the host's
        for pipe in (self._here, here, *(pipe for spares in self._spares.values() for _, pipe in spares)):
            os.close(pipe)
        if not os.read(there, 1):
            os._exit(0)  # the host has ended
        self._live(name)

    def start_spare(self, name: str) -> None:
        """A spare process becomes the node."""
        pid, pipe = self._spares[name].pop(0)
        os.write(pipe, b"!")
        os.close(pipe)
        self.running[name] = pid

    def wake(self, name: str) -> None:
        """A node that is stopped goes on."""
        if name in self.running:
            os.kill(self.running[name], signal.SIGCONT)

    def _live(self, name: str) -> None:
        """From here on, this is the node's process."""
        code = 1
        try:
            code = _be_node(name, self._assembly, self._endpoints, self._logs / f"{name}.log", self._there)
        except Exception:  # noqa: BLE001 - whatever it was, this process ends here and must say why
            _log.exception("node %s failed", name)
        finally:
            logging.shutdown()
            os._exit(code)

    def reap(self) -> list[tuple[str, int]]:
        """The nodes that have ended since the last look, with their exit codes."""
        ended = []
        for name, pid in list(self.running.items()):
            found, status = os.waitpid(pid, os.WNOHANG)
            if found:
                del self.running[name]
                ended.append((name, os.waitstatus_to_exitcode(status)))
        return ended

    def end(self) -> None:
        """Ends them all: by closing their pipe, then by asking, then by force."""
        os.close(self._here)
        for pid, pipe in [spare for spares in self._spares.values() for spare in spares]:
            os.close(pipe)
            os.waitpid(pid, 0)
        for number in (signal.SIGTERM, signal.SIGKILL):
            limit = time.monotonic() + LEAVE_S
            while self.running and time.monotonic() < limit:
                self.reap()
                time.sleep(POLL_S)
            for pid in self.running.values():
                os.kill(pid, number)


def _be_node(name: str, assembly: Assembly, endpoints: Endpoints, log: Path, host: int) -> int:
    """The life of a forked node; returns its exit code."""
    os.setsid()
    file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(file, 1)
    os.dup2(file, 2)
    logging.basicConfig(
        level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s", force=True
    )
    stopped = threading.Event()
    stop_on_signals(stopped)
    threading.Thread(target=_stop_with_host, args=[host, stopped], name="host", daemon=True).start()
    try:
        run_node(assembly, name, [endpoints.nodes[name]], endpoints.connects(name, assembly), stopped)
    except (NetworkError, ScenarioError, SourceError) as error:
        print(error, file=sys.stderr, flush=True)  # noqa: T201 - the launcher reads it in the log
        return 2
    return 0


def _stop_with_host(host: int, stopped: threading.Event) -> None:
    """Leaves when the host does: its end of the pipe closes however it ends."""
    while os.read(host, 1):
        pass
    if not stopped.is_set():
        _log.warning("told to leave before the end")
    stopped.set()
    threading.Timer(LEAVE_S, os._exit, args=[1]).start()


def _watch(nodes: Nodes, router: Router) -> None:
    """Tells who ends and does what it is told, until the launcher hangs up."""
    said, router_due = b"", math.inf
    while True:
        readable, _, _ = select.select([0], [], [], POLL_S)
        if readable:
            more = os.read(0, 1024)
            if not more:
                return
            *lines, said = (said + more).split(b"\n")
            for line in lines:
                match json.loads(line):
                    case {"wake": name}:
                        nodes.wake(name)
                    case {"start": name}:
                        nodes.start_spare(name)
                    case {"restart": "router"}:
                        router.close()
                        router_due = time.monotonic() + ROUTER_AWAY_S
        if time.monotonic() >= router_due:
            router.open()
            router_due = math.inf
        for name, code in nodes.reap():
            _tell(ended=name, code=code)


def _tell(**facts: object) -> None:
    print(json.dumps(facts), flush=True)  # noqa: T201 - the launcher reads it


if __name__ == "__main__":
    sys.exit(main())
