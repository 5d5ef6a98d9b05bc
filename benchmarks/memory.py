"""Private memory of each process of a run, in the middle of it: what it alone keeps in RAM (Linux)."""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("scenario", nargs="?", default="scenarios/scene1.yaml")
parser.add_argument("--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE")
parser.add_argument("--router", default="tcp/127.0.0.1:17447", help="endpoint that is free here")
given = parser.parse_args()


def private_mb(pid: int) -> float:
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="utf-8").splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("Private_")) / 1024


def children(pid: int) -> list[int]:
    listed = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="utf-8")
    below = [int(each) for each in listed.split()]
    return [*below, *(each for child in below for each in children(child))]


overrides = [f"--set={each}" for each in (f"network.router={given.router}", *given.overrides)]
with tempfile.TemporaryDirectory() as folder:
    command = [sys.executable, "-m", "sim", "run", given.scenario, "--json", "--out", folder, *overrides]
    with subprocess.Popen(
        [*command, "--pace", "realtime"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        samples: dict[int, list[float]] = {}
        while process.poll() is None:
            try:
                for pid in children(process.pid):
                    samples.setdefault(pid, []).append(private_mb(pid))
            except (FileNotFoundError, ProcessLookupError):
                pass  # one has just ended
            time.sleep(0.1)
        printed, _ = process.communicate()
print(f"{given.scenario}, {json.loads(printed)['frames']} frames: private memory, MB")
for number, values in enumerate(samples.values()):
    who = f"node {number}" if number else "host, then router"
    print(f"  {who:20s} median {statistics.median(values):5.1f}, most {max(values):5.1f}")
