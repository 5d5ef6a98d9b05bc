"""For the tests of real processes: a `dcpf run`, found in all its processes, with nothing left behind."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

DCPF = [sys.executable, "-c", "from sim.commands import main; main()"]
LIMIT_S = 30.0


def free_port():
    """A port of the loopback interface that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Launched:
    """A run, from its command to its last process, and the processes beside it."""

    def __init__(self, folder, wait_until):
        self.wait_until = wait_until
        self.out = folder / "run"
        self.router = f"tcp/127.0.0.1:{free_port()}"
        # Sockets need a short path; a folder of their own shows whether any is left.
        self.sockets = Path(tempfile.mkdtemp(prefix="t", dir="/tmp"))
        self.through = ()  # a command that the run is started by
        self.process = None
        self.others = []
        self.seen = set()

    def run(self, scenario, *arguments):
        """Starts the run."""
        where = ["--out", self.out, "--set", f"network.router={self.router}"]
        self.process = self._start([*self.through, *DCPF, "run", scenario, *where, *arguments])

    def beside(self, *command):
        """Starts another process, whose output is read at its end."""
        self.others.append(self._start(command))
        return self.others[-1]

    def _start(self, command):
        return subprocess.Popen(
            [str(each) for each in command],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env=os.environ | {"TMPDIR": str(self.sockets)},
        )

    def processes(self):
        """The launcher's descendants that run, also those that have lost their parents meanwhile."""
        parents = {}
        for entry in Path("/proc").glob("[0-9]*/stat"):
            try:
                state, parent = entry.read_text().rpartition(")")[2].split()[:2]
            except OSError:
                continue  # it has just ended
            if state != "Z":
                parents[int(entry.parent.name)] = int(parent)
        family = {self.process.pid} | self.seen
        while found := {pid for pid, parent in parents.items() if parent in family} - family:
            family |= found
        self.seen = family - {self.process.pid}
        return self.seen & parents.keys()

    def node(self, name):
        """The process of a node: the one that writes its log."""
        for pid in self.processes():
            try:
                if Path(f"/proc/{pid}/fd/2").readlink().name == f"{name}.log":
                    return pid
            except OSError:
                continue
        raise AssertionError(f"there is no process of {name}")

    def lines(self, name):
        """What has been recorded."""
        path = self.out / f"{name}.jsonl"
        return path.read_text(encoding="utf-8").splitlines() if path.exists() else []

    def reaches(self, frame):
        """Waits until everything of a frame is recorded."""
        return self.wait_until(
            lambda: any(json.loads(each)["frame"] > frame for each in self.lines("estimates"))
        )

    def end(self, limit_s=LIMIT_S):
        """Waits for the end: exit code, stdout and stderr."""
        stdout, stderr = self.process.communicate(timeout=limit_s)
        return self.process.returncode, stdout, stderr

    def is_gone(self, limit_s=10.0):
        """Waits until no process and no socket is left."""
        return self.wait_until(lambda: not self.processes() and not list(self.sockets.iterdir()), limit_s)

    def close(self):
        """Ends what is left of it, by its ids."""
        if self.process is not None:
            for pid in self.processes():
                os.kill(pid, signal.SIGKILL)
            self.others.append(self.process)
        for process in self.others:
            process.kill()
            process.communicate()
        shutil.rmtree(self.sockets, ignore_errors=True)


@pytest.fixture
def launched(tmp_path, wait_until):
    """A run that can be started."""
    run = Launched(tmp_path, wait_until)
    yield run
    run.close()


@pytest.fixture
def dcpf():
    """The command, as whoever starts it beside a run needs it."""
    return DCPF
