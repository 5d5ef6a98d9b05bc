"""What being looked at costs a run: processor time a frame with nobody, with a viewer, and recorded.

The three are taken in turn, so that whatever else the machine does falls on all of them alike. The viewer is
in this process, whose own time is not counted.
"""

import argparse
import contextlib
import json
import resource
import statistics
import subprocess
import sys
import tempfile

from network.links import sessions
from network.wire import keys

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("scenario", nargs="?", default="scenarios/scene1.yaml")
parser.add_argument("--runs", type=int, default=5)
parser.add_argument("--router", default="tcp/127.0.0.1:17447", help="endpoint that is free here")
given = parser.parse_args()


def cpu_ms_a_frame(*options: str, looking: bool) -> float:
    """Of launcher, host and nodes together."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        arguments = [given.scenario, "--json", "--out", folder, "--set", f"network.router={given.router}"]
        process = subprocess.Popen(
            [sys.executable, "-m", "sim", "run", *arguments, *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        if looking:
            viewer = sessions.open_client(given.router, timeout_s=None)
            stack.callback(sessions.close, viewer)
            viewer.declare_subscriber(keys.preview(keys.ANY), lambda _: None)
        printed, _ = process.communicate()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return 1000 * spent / int(json.loads(printed)["frames"])


kinds: dict[str, tuple[tuple[str, ...], bool]] = {
    "nobody looks": ((), False),
    "a viewer": ((), True),
    "recorded": (("--record",), False),
}
spent: dict[str, list[float]] = {name: [] for name in kinds}
for _ in range(given.runs):
    for name, (options, looking) in kinds.items():
        spent[name].append(cpu_ms_a_frame(*options, looking=looking))
for name, values in spent.items():
    ratio = statistics.median(a / b for a, b in zip(values, spent["nobody looks"], strict=True))
    print(
        f"{name:14s} {statistics.median(values):6.1f} ms CPU a frame, start and end included   x {ratio:.3f}"
    )
