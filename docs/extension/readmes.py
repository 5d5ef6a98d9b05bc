"""READMEs of the repository as pages of the site, with their links put right."""

import posixpath
import re
from pathlib import Path

_LINK = re.compile(r"(?<=\]\()(?![a-z]+:|#)([^)#\s]+)")

PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "decisions/contributing.md",
    "CHANGELOG.md": "changelog.md",
    "benchmarks/README.md": "decisions/benchmarks.md",
    "network/README.md": "decisions/network.md",
    "nodes/README.md": "decisions/nodes.md",
    "nodes/simd/README.md": "decisions/simd.md",
    "sim/README.md": "decisions/sim.md",
    "sim/pictures/README.md": "decisions/pictures.md",
    "sim/world/README.md": "decisions/world.md",
}
"""The page of the site that holds a file of the repository."""


def readme(root: Path, path: str, depth: int) -> str:
    """A README with its relative links as the page needs them: to pages, or to files that the site holds.

    Args:
        root: Of the repository.
        path: The file in it.
        depth: Folders between docs/ and the page.
    """
    text = (root / path).read_text(encoding="utf-8")

    def moved(link: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(posixpath.dirname(path), link[1]))
        if (root / target).is_dir():
            target = posixpath.join(target, "README.md")
        return "../" * depth + PAGES.get(target, f"../{target}")

    return _LINK.sub(moved, text)
