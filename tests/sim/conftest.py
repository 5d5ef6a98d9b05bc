"""For the tests of whole runs: a small hall, quick to render, its scenario as a file, and a browser."""

import shutil
import textwrap

import pytest

from sim.assembly import Assembly
from sim.results.results import Results, summarize
from sim.running.in_process import run_in_process
from sim.scenario.loading import load_scenario

SMALL = """
    name: small
    frames: 6
    rate_hz: 10
    target:
      person: ann
      start: {velocity: [0.0, 1.5]}
    cameras:
      - {name: A, position: [-5, -2, 2.9], look_at: [0, 3, 0.8], focal_px: 120, size_px: [160, 120]}
      - {name: B, position: [5, -2, 2.9], look_at: [0, 3, 0.8], focal_px: 120, size_px: [160, 120]}
      - {name: C, position: [5, 8, 2.9], look_at: [0, 3, 0.8], focal_px: 120, size_px: [160, 120]}
      - {name: D, position: [-5, 8, 2.9], look_at: [0, 3, 0.8], focal_px: 120, size_px: [160, 120]}
    network:
      iterations: 3
    filter:
      n_particles: 40
    world:
      people:
        - name: ann
          upper: "#233ca5"
          lower: "#3c3737"
          path:
            - {time_s: 0.0, position: [0.0, 0.0]}
            - {time_s: 6.0, position: [0.0, 6.0]}
      room: {center: [0.0, 4.5], size: [20.0, 20.0], height: 5.0}
    """

QUIET = (
    *("headless=new", "no-sandbox", "disable-gpu", "disable-quic", "no-first-run", "disable-sync"),
    *("disable-background-networking", "disable-component-update"),
)
"""How Chromium is started: without a window, and without a word to anybody."""


@pytest.fixture
def browser(tmp_path):
    """A browser without a window, where Chromium is installed."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    chromedriver = shutil.which("chromedriver")
    if not (chromium and chromedriver):
        pytest.skip("needs Chromium: apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for switch in (*QUIET, f"user-data-dir={tmp_path / 'browser'}"):
        options.add_argument(f"--{switch}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(chromedriver))
    yield driver
    driver.quit()


@pytest.fixture
def small(tmp_path):
    """The file of a scenario of four small cameras on a ring."""
    path = tmp_path / "small.yaml"
    path.write_text(textwrap.dedent(SMALL), encoding="utf-8")
    return path


@pytest.fixture
def told():
    """Runs a scenario file in process and returns all that it tells."""

    def run(path, *overrides):
        return list(run_in_process(Assembly(load_scenario(path, overrides))))

    return run


@pytest.fixture
def summary_of(told):
    """Runs a scenario file in process and returns its summary."""

    def run(path, *overrides):
        results = Results(load_scenario(path, overrides))
        for message in told(path, *overrides):
            results.add(message)
        return summarize(results, processes=1)

    return run
