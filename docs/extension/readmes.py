"""READMEs of the repository as pages of the site, with their links put right."""

import posixpath
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

_LINK = re.compile(r"(?<=\]\()(?![a-z]+:|#)([^)#\s]+)")

MARKER = re.compile(r"^<!-- (generated|readme): (\S+) -->$", re.MULTILINE)
"""What stands in a page where something is put in."""


@cache
def pages(docs: Path) -> Mapping[str, str]:
    """The page of the site, relative to docs/, that holds each README."""
    return {
        name: page.relative_to(docs).as_posix()
        for page in sorted(docs.rglob("*.md"))
        for kind, name in MARKER.findall(page.read_text(encoding="utf-8"))
        if kind == "readme"
    } | {"README.md": "index.md"}


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
        return "../" * depth + pages(root / "docs").get(target, f"../{target}")

    return _LINK.sub(moved, text)
