"""Whether a page shows what an experiment has found: drawing it again takes longer than all the reading."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sim.experiments.computing.parts import program_version

_HEAD = 4096
"""Characters of a page in which its fingerprint stands."""


def fingerprint(found: Mapping[str, Any]) -> str:
    """What a page is known by: the figures that it shows, and the program that has drawn it."""
    told = json.dumps(found, sort_keys=True) + program_version()
    return hashlib.sha256(told.encode()).hexdigest()[:32]


def is_shown(page: Path, mark: str) -> bool:
    """Whether a page is there and bears this fingerprint; it is written after all other files."""
    try:
        with page.open(encoding="utf-8") as file:
            return mark in file.read(_HEAD)
    except (OSError, ValueError):
        return False
