"""The pages in a real browser: nothing is cut off, no text lies on another, on a desk and on a telephone."""

import sys
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.processes,
    pytest.mark.skipif(sys.platform != "linux", reason="Chromium is looked for as Linux has it"),
]

# text that sticks out of its drawing, and pairs of texts that lie on each other
MISPLACED = """
    const found = [];
    for (const svg of document.querySelectorAll("svg")) {
        const box = svg.getBoundingClientRect();
        const texts = [...svg.querySelectorAll("text")]
            .map((text) => [text.textContent.trim(), text.getBoundingClientRect()])
            .filter(([words]) => words);
        texts.forEach(([words, at], i) => {
            if (at.left < box.left - 1 || at.right > box.right + 1
                || at.top < box.top - 1 || at.bottom > box.bottom + 1) found.push(`${words} sticks out`);
            for (const [others, there] of texts.slice(i + 1)) {
                const width = Math.min(at.right, there.right) - Math.max(at.left, there.left);
                const height = Math.min(at.bottom, there.bottom) - Math.max(at.top, there.top);
                if (width > 2 && height > 3) found.push(`${words} lies on ${others}`);
            }
        });
    }
    return found;
"""
COLORS = "const style = getComputedStyle(document.body); return [style.color, style.backgroundColor];"


@pytest.fixture
def pages(dcpf, ran, small):
    """The page of a run, and of an experiment."""
    folder = ran(small)
    assert dcpf("report", folder).exit_code == 0
    sweep = ["--sweep", "network.iterations=1:3", "--frames", 3, "--runs", 2, "--jobs", 1]
    assert dcpf("compare", small, *sweep, "--out", "out").exit_code == 0
    return [folder / "report.html", Path("out/report.html").absolute()]


def resize(browser, width, *, dark):
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})


def test_nothing_is_cut_off_and_no_text_lies_on_another(browser, pages):
    for page in pages:
        browser.get(page.as_uri())
        for width in (1280, 390, 320):
            resize(browser, width, dark=False)
            assert not browser.execute_script("return document.documentElement.scrollWidth > innerWidth")
            if width == 1280:
                assert browser.execute_script(MISPLACED) == []
        light = browser.execute_script(COLORS)
        resize(browser, 1280, dark=True)
        assert browser.execute_script(COLORS) != light
        assert browser.execute_script("return [...document.images].every((image) => image.naturalWidth > 0)")
        assert not browser.get_log("browser")
