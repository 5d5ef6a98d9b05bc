"""Pictures a second of the live page in headless Chromium: a recording of scene 1, played fast.

Needs selenium, Chromium and its driver (Debian: chromium, chromium-driver).
"""

import argparse
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from selenium import webdriver

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("scenario", nargs="?", default="scenarios/scene1.yaml")
parser.add_argument("--speed", type=float, default=3.0, help="times the run's own frame rate")
parser.add_argument("--seconds", type=int, default=10)
parser.add_argument("--router", default="tcp/127.0.0.1:17447", help="endpoint that is free here")
parser.add_argument("--port", default="17448", help="port that is free here")
given = parser.parse_args()

options = webdriver.ChromeOptions()
options.binary_location = shutil.which("chromium")
with tempfile.TemporaryDirectory() as folder:
    for switch in ("headless=new", "no-sandbox", "disable-gpu", f"user-data-dir={folder}/browser"):
        options.add_argument(f"--{switch}")
    dcpf = [sys.executable, "-m", "sim"]
    record = ["run", given.scenario, "--in-process", "--record", "--out", f"{folder}/run"]
    subprocess.run([*dcpf, *record], check=True, capture_output=True)
    replay = ["replay", f"{folder}/run", "--live", "--loop", "--speed", str(given.speed)]
    with subprocess.Popen(
        [*dcpf, *replay, "--listen", given.router, "--port", given.port],
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        while "live at" not in process.stderr.readline():
            pass
        driver = webdriver.Chrome(
            options=options, service=webdriver.ChromeService(shutil.which("chromedriver"))
        )
        driver.get(f"http://127.0.0.1:{given.port}/")
        time.sleep(4)
        shown = []
        for _ in range(given.seconds):
            time.sleep(1)
            shown.append(float(driver.execute_script("return document.body.dataset.picturesPerSecond || 0")))
        cameras = driver.execute_script("return document.querySelectorAll('figure').length")
        driver.quit()
        process.send_signal(signal.SIGINT)
    size = Path(folder, "run", "run.mcap").stat().st_size
print(
    f"{statistics.median(shown):.1f} pictures/s of each of {cameras} cameras, {min(shown):.1f} at the least"
)
print(f"recording: {size / 1e6:.1f} MB")
