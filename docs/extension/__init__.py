"""What this site needs beside Sphinx: references written from the program, and equations as MathML.

A page says `<!-- generated: NAME -->` where a reference shall stand, and `<!-- readme: PATH -->` where a
README of the repository shall; both become Markdown before the page is read.
"""

import re
from pathlib import Path

from sphinx.application import Sphinx

from extension.commands import command_reference
from extension.mathml import add_mathml
from extension.messages import binary_reference, key_reference, message_reference
from extension.options import experiment_reference, preset_reference, scenario_reference
from extension.readmes import MARKER, readme

GENERATED = {
    "scenario": scenario_reference,
    "presets": preset_reference,
    "experiment": experiment_reference,
    "commands": command_reference,
    "keys": key_reference,
    "messages": message_reference,
    "binary": binary_reference,
}
"""What a page can ask for."""


def fill(app: Sphinx, page: str, source: list[str]) -> None:
    """Puts Markdown in the place of the markers of a page."""
    depth = page.count("/")

    def filling(marker: re.Match[str]) -> str:
        kind, name = marker.groups()
        if kind == "generated":
            return GENERATED[name]()
        return readme(Path(app.srcdir).parent, name, depth)

    source[0] = MARKER.sub(filling, source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx' way to load an extension."""
    app.connect("source-read", fill)
    add_mathml(app)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
