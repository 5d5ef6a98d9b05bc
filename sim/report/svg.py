"""Figures as SVG inside a page: in the page's colours and font, and with names that no other figure has.

Imports matplotlib: what only runs scenarios does not import this module.
"""

import io
import re
from collections.abc import Callable

import matplotlib as mpl
from markupsafe import Markup, escape
from matplotlib.figure import Figure

from sim.pictures.theme import COLORS, FAINT, INK, MUTED, PAPER, SEEN

VARIABLES = {
    **{color.lower(): f"var(--{name})" for name, color in COLORS.items()},
    **{shade.lower(): f"var(--seen-{number})" for number, shade in enumerate(SEEN)},
    INK.lower(): "var(--ink)",
    MUTED.lower(): "var(--muted)",
    FAINT.lower(): "var(--faint)",
    PAPER.lower(): "var(--paper)",
}
"""The theme's colours, and what the page calls them: it has them for light and for dark."""

_PX_PER_POINT = 4 / 3
_FONT = re.compile(r"'DejaVu Sans'[^;\"]*")
_PLACES = re.compile(r' (?:d|x|y|width|height|transform|points)="[^"]*"')
_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_STYLE = re.compile(r'style="[^"]*"')
_COLOR = re.compile(r"#[0-9a-f]{6}\b")


def inline(figure: Figure, name: str, label: str) -> Markup:
    """A figure as an SVG element.

    Args:
        figure: The figure.
        name: Begins all its ids; another one for each figure of a page.
        label: What it shows, for those who cannot see it.

    Returns:
        Markup; the same figure gives the same.
    """
    file = io.StringIO()
    # Text stays text, to be read, found and set in the page's font.
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        figure.savefig(file, format="svg", facecolor="none", metadata={"Date": None})
    drawing = file.getvalue()
    drawing = drawing[drawing.index("<svg") :]
    drawing = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->", "", drawing, flags=re.DOTALL)
    drawing = re.sub(r"<defs>\s*</defs>", "", drawing).replace("xlink:href", "href")
    drawing = _within(_PLACES, drawing, _LONG_NUMBER, lambda number: f"{float(number):.2f}")
    drawing = _within(_STYLE, drawing, _COLOR, lambda color: VARIABLES.get(color, color))
    drawing = _own_ids(_FONT.sub("var(--font)", drawing), name)
    width, height = (size * 72 * _PX_PER_POINT for size in figure.get_size_inches())
    box = re.search(r'viewBox="[^"]*"', drawing)
    if box is None:
        raise ValueError("the figure has no viewBox: give one that matplotlib draws as SVG")
    head = f'<svg {box[0]} width="{width:.0f}" height="{height:.0f}" role="img" aria-label="{escape(label)}">'
    body = drawing[drawing.index(">") + 1 :]
    return Markup(head + re.sub(r"\s*\n\s*", "\n", body))  # noqa: S704 - matplotlib's, text escaped by it


def _within(
    attribute: re.Pattern[str], drawing: str, what: re.Pattern[str], change: Callable[[str], str]
) -> str:
    """Changes what is found in attributes of some kind, and no text."""
    return attribute.sub(
        lambda found: what.sub(lambda inner: change(inner[0]), found[0]),
        drawing,
    )


def _own_ids(drawing: str, name: str) -> str:
    """Ids that something refers to begin with the figure's name; the others go."""
    used = set(re.findall(r'(?:url\(#|href="#)([^)"]+)', drawing))
    drawing = re.sub(
        r' id="([^"]*)"', lambda found: f' id="{name}-{found[1]}"' if found[1] in used else "", drawing
    )
    return re.sub(r'(url\(#|href="#)(?=[^)"]+)', rf"\g<1>{name}-", drawing)
