"""The live page in a real browser: a run, a node that dies, a recording that is turned back."""

import os
import signal
import socket
import sys

import pytest

from sim.results.recorder import FILM

pytestmark = [
    pytest.mark.processes,
    pytest.mark.timeout(120),
    pytest.mark.skipif(sys.platform != "linux", reason="finds the processes of a run in /proc"),
]

VERMILLION = "rgb(213, 94, 0)"
# how many different colours a canvas shows, and whether one of them is there
COLORS_OF = """
    const canvas = document.querySelector(arguments[0]);
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const found = new Set();
    for (let i = 0; i < data.length; i += 4) found.add(`rgb(${data[i]}, ${data[i + 1]}, ${data[i + 2]})`);
    return [found.size, found.has(arguments[1])];
"""


class Page:
    """The page in a browser."""

    def __init__(self, driver, url, wait_until):
        self.driver, self.url, self._wait_until = driver, url, wait_until

    def opens(self):
        """Waits until the page is served, and opens it."""

        def tried():
            try:
                self.driver.get(self.url)
            except Exception:  # noqa: BLE001 - nobody listens yet
                return False
            return True

        return self._wait_until(tried)

    def says(self, selector, words):
        """Waits until an element says something."""
        return self._wait_until(lambda: words in (self.text(selector) or ""))

    def shows(self, script):
        """Waits until an expression is true."""
        return self._wait_until(lambda: self.run(f"return {script}"))

    def text(self, selector):
        return self.run("return document.querySelector(arguments[0])?.textContent", selector)

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def resize(self, width, *, dark=False):
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})

    def is_cut_off(self):
        """Whether anything reaches beyond the width of the screen."""
        return self.run("return document.documentElement.scrollWidth > innerWidth")

    def complaints(self):
        """What the browser has to say about the page's scripts."""
        return [each["message"] for each in self.driver.get_log("browser") if "ERR_" not in each["message"]]


@pytest.fixture
def page(browser, wait_until):
    """A page that is not open yet, at a free port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    return Page(browser, f"http://127.0.0.1:{port}/", wait_until)


def port_of(page):
    return page.url.rstrip("/").rpartition(":")[2]


def test_a_run_is_seen_and_the_death_of_a_node(launched, small, page):
    launched.run(small, "--frames", 2000, "--live", "--port", port_of(page))
    assert page.opens()

    # the text, the pictures, the map
    assert page.says("#run", "small, robust preset")
    assert page.says("#node-B", "● running")
    assert page.shows("Number(document.body.dataset.frame) > 5")
    assert page.shows("document.querySelectorAll('figure[data-pictures]').length === 4")
    n_colors, with_box = page.run(COLORS_OF, "#camera-A", VERMILLION)
    assert n_colors > 500
    assert with_box
    assert page.run(COLORS_OF, "#map", VERMILLION)[1]
    assert page.shows("document.querySelector('#errors').width > 0")
    assert page.run(COLORS_OF, "#errors", VERMILLION)[1]
    assert page.shows("Number(document.body.dataset.picturesPerSecond) > 0")
    assert page.shows("document.querySelector('#dcpf-rate').textContent !== '–'")

    # nothing is cut off, on a desk and on a phone, light and dark
    for width in (1280, 390, 320):
        for dark in (False, True):
            page.resize(width, dark=dark)
            assert not page.is_cut_off()
    page.resize(1280)

    os.kill(launched.node("B"), signal.SIGKILL)

    assert page.says("#node-B", "✕ lost at")
    state = "getComputedStyle(document.querySelector('#node-B .chip')).backgroundColor"
    assert page.run(f"return {state}") == VERMILLION
    assert page.says("#node-A", "● running")
    assert page.shows("document.querySelector('figure.lost #camera-B') !== null")

    launched.process.send_signal(signal.SIGINT)
    code, _, stderr = launched.end()
    assert code == 130
    assert "Traceback" not in stderr
    assert launched.is_gone()
    assert page.says("#connection", "the run has ended")
    assert page.complaints() == []


def test_a_recording_is_turned_back_and_forth(launched, small, page, dcpf):
    launched.run(small, "--in-process", "--record")
    assert launched.end()[0] == 0
    assert (launched.out / FILM).is_file()
    listen = ("--listen", launched.router)
    replay = launched.beside(*dcpf, "replay", launched.out, "--live", "--port", port_of(page), *listen)
    assert page.opens()

    assert page.says("#frame", "5 of 5")
    assert page.says("#play", "Play")
    page.run(
        "seek.value = 2; seek.dispatchEvent(new Event('input')); seek.dispatchEvent(new Event('change'))"
    )
    assert page.says("#frame", "2 of 5")
    assert page.says("#cameras", "frame 2")
    assert page.shows("document.querySelector('#camera-C').width === 160")
    assert page.run(COLORS_OF, "#camera-C", VERMILLION)[1]
    page.run("speed.value = '8'; speed.dispatchEvent(new Event('change')); play.click()")
    assert page.says("#frame", "5 of 5")
    assert page.complaints() == []

    replay.send_signal(signal.SIGTERM)
    stdout, stderr = replay.communicate(timeout=10)
    assert (replay.returncode, stdout) == (130, "")
    assert "Traceback" not in stderr
    assert page.says("#connection", "the run has ended")
