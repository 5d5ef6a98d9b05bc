"""Start and speed of a run in processes: command to first fused estimate, and frames a second."""

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
parser.add_argument("--runs", type=int, default=5)
parser.add_argument("--router", default="tcp/127.0.0.1:17447", help="endpoint that is free here")
given = parser.parse_args()

whole, first, rate = [], [], []
for _ in range(given.runs):
    with tempfile.TemporaryDirectory() as folder:
        began = time.monotonic()
        command = [
            str(Path(sys.executable).with_name("dcpf")),
            "run",
            given.scenario,
            "--json",
            "--out",
            folder,
        ]
        with subprocess.Popen(
            [*command, "--set", f"network.router={given.router}"],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        ) as process:
            estimates = Path(folder) / "estimates.jsonl"
            while process.poll() is None and not (
                estimates.is_file() and '"frame":1,' in estimates.read_text()
            ):
                time.sleep(0.01)
            first.append(time.monotonic() - began)
            printed, _ = process.communicate()
        whole.append(time.monotonic() - began)
    summary = json.loads(printed)
    rate.append(summary["timing"]["frames_per_s"])
for name, values in (("first estimate, s", first), ("frames/s", rate), ("whole command, s", whole)):
    print(f"{name:20s} median {statistics.median(values):6.2f}   {min(values):6.2f} to {max(values):6.2f}")
