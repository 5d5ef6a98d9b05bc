"""Figures inside a page: nobody else's names, the page's colours, the text as it was."""

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from sim.pictures.plots import cleaned
from sim.pictures.theme import COLORS, SEEN
from sim.report.svg import inline


def figure(title=""):
    drawn = Figure(figsize=(3, 2))
    axes = cleaned(drawn.add_subplot())
    axes.plot([0.001, 0.002], [0.0, 0.12345], "o-", color=COLORS["dcpf"])
    axes.contourf(np.arange(9).reshape(3, 3), colors=list(SEEN))
    axes.set_yticks([0.0, 0.125], ["0", "0.125"])
    axes.set_title(title)
    return drawn


def test_two_figures_of_a_page_share_no_names():
    one, two = (inline(figure(), name, "a line") for name in ("one", "two"))
    ids = [set(re.findall(r' id="([^"]*)"', drawing)) for drawing in (one, two)]
    assert ids[0]
    assert not ids[0] & ids[1]
    for drawing, own in zip((one, two), ids, strict=True):
        assert set(re.findall(r'(?:url\(#|href="#)([^)"]+)', drawing)) == own
    assert one == inline(figure(), "one", "a line")


def test_colours_are_the_pages_and_numbers_in_text_stay():
    drawing = inline(figure(), "plot", "a line")
    assert "var(--dcpf)" in drawing
    assert "var(--seen-1)" in drawing
    assert COLORS["dcpf"].lower() not in drawing
    assert ">0.125</text>" in drawing
    places = re.findall(r' (?:d|x|y)="([^"]*)"', drawing)
    assert places
    assert not re.search(r"\.\d{3}", " ".join(places))


@pytest.mark.parametrize("words", ["<script>alert(1)</script>", 'a "quoted" & an <b>'])
def test_what_is_written_in_a_figure_is_text(words):
    drawing = inline(figure(words), "plot", words)
    assert "<script" not in drawing
    assert "<b>" not in drawing
    assert "&lt;" in drawing
