"""For the tests of the pages: a folder as a reader has it, and terminals to type their commands in."""

import os
import shutil
import signal
import socket
import stat
import subprocess
import sys
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LIMIT_S = 60.0
CAMERAS = ("C1", "C2", "C3", "C4")

SHORT = """#!{python}
# dcpf with short settings, and addresses that nobody else here uses.
import os, sys
from pathlib import Path

command = sys.argv[1]
router, *nodes = os.environ["DOCS_ENDPOINTS"].split()
addresses = ["--set", "network.router=" + router]
for name, endpoint in zip({cameras!r} + ("central",), nodes):
    addresses += ["--set", f"network.endpoints.{{name}}={{endpoint}}"]
sys.argv += {{
    "run": ["--frames", "5", *addresses],
    "node": ["--frames", "5", *addresses],
    "compare": ["--frames", "4", "--runs", "1", "--jobs", "1"],
    "simulate": ["--frames", "5"],
    "watch": ["--connect", router],
}}.get(command, [])
if command in ("watch", "node"):
    import sim.running.listener  # the network's library takes its time to import

    Path(os.environ["DOCS_READY"]).touch()
from sim.commands import main

main()
"""


def free_ports(n):
    """Ports of the loopback interface that nobody listens on."""
    with ExitStack() as stack:
        probes = [stack.enter_context(socket.socket()) for _ in range(n)]
        for probe in probes:
            probe.bind(("127.0.0.1", 0))
        return [probe.getsockname()[1] for probe in probes]


class Terminals:
    """A folder as a reader has it, and the terminals in it."""

    def __init__(self, folder, wait_until):
        self.folder, self.wait_until, self.others = folder, wait_until, []
        shutil.copytree(ROOT / "scenarios", folder / "scenarios")
        short = folder / "bin" / "dcpf"
        short.parent.mkdir()
        short.write_text(SHORT.format(python=sys.executable, cameras=CAMERAS), encoding="utf-8")
        short.chmod(short.stat().st_mode | stat.S_IXUSR)
        self.ready = folder / "ready"
        endpoints = " ".join(f"tcp/127.0.0.1:{port}" for port in free_ports(len(CAMERAS) + 2))
        path = os.pathsep.join((str(short.parent), str(Path(sys.executable).parent), os.environ["PATH"]))
        where = {"PYTHONPATH": str(ROOT), "DOCS_ENDPOINTS": endpoints, "DOCS_READY": str(self.ready)}
        self.environment = os.environ | where | {"PATH": path, "COLUMNS": "120"}

    def start(self, text):
        """Types some lines; they end at the first that fails."""
        return subprocess.Popen(
            ["bash", "-euc", text],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def run(self, text):
        """Types some lines and waits: the exit code, and what was printed."""
        process = self.start(text)
        try:
            stdout, stderr = process.communicate(timeout=LIMIT_S)
        finally:
            end(process, signal.SIGKILL)
        return process.returncode, stdout + stderr

    def beside(self, text):
        """Types some lines in another terminal, and waits until they listen."""
        self.ready.unlink(missing_ok=True)
        self.others.append((text, self.start(text)))
        assert self.wait_until(self.ready.exists)

    def close(self):
        """Interrupts the other terminals: of each what was typed, its exit code, and what was printed."""
        for text, process in self.others:
            try:
                stdout, stderr = process.communicate(timeout=1)
            except subprocess.TimeoutExpired:
                end(process, signal.SIGTERM)
                stdout, stderr = process.communicate(timeout=LIMIT_S)
            yield text, process.returncode, stdout, stderr


def end(process, number):
    """Signals a terminal's processes, if there are any left."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, number)


@pytest.fixture
def terminals(tmp_path, wait_until):
    """A reader's folder."""
    there = Terminals(tmp_path, wait_until)
    yield there
    for _, process in there.others:
        end(process, signal.SIGKILL)
        process.communicate()
