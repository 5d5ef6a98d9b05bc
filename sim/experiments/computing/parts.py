"""What an experiment computes: parts of runs, each known by a key of everything that it depends on.

A run falls into the cameras' part (DCPF, single cameras) and the central node's (CPF), which share the
pictures and nothing else. So CPF is not run again for every graph, and what has been computed is found again.
"""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np

import sim
from network.averaging.metropolis import MetropolisWeights
from sim.scenario.model import BaselineOptions, Scenario

Kind = Literal["cameras", "central", "coded"]
"""The cameras with their network; the central node on raw pictures; the same on pictures sent as JPEG."""

_PACKAGES = ("network", "nodes", "sim")
_NO_NUMBERS = ("sim/commands", "sim/pictures", "sim/report", "sim/experiments")


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a run.

    Attributes:
        kind: Which part.
        scenario: The resolved scenario as JSON, with what the part does not depend on at its default.
        jpeg_quality: Of the pictures that are sent coded.
        key: What its result is known by.
    """

    kind: Kind
    scenario: str
    jpeg_quality: int | None
    key: str

    @property
    def pictures(self) -> str:
        """What the pictures depend on; parts with the same pictures are computed one after the other."""
        told = json.loads(self.scenario)
        return json.dumps([told[key] for key in ("world", "footage", "cameras", "rate_hz", "seed", "frames")])


def cameras_part(scenario: Scenario, *, with_single: bool) -> Part:
    """The smart cameras of a run with their network, and each camera's own filter beside if wanted."""
    return _part("cameras", scenario, BaselineOptions(cpf=False, single=with_single))


def central_part(scenario: Scenario, jpeg_quality: int | None = None) -> Part:
    """The central node of a run, on raw pictures or on pictures that were sent as JPEG."""
    default = type(scenario.network).model_fields
    # Neither who talks to whom, over what links, nor how they fuse concerns it.
    unused = {key: default[key].get_default() for key in ("graph", "iterations", "payload", "conditions")}
    network = scenario.network.model_copy(update={**unused, "consensus": MetropolisWeights()})
    scenario = scenario.model_copy(
        update={"network": network, "fusion": type(scenario).model_fields["fusion"].get_default()}
    )
    kind: Kind = "central" if jpeg_quality is None else "coded"
    return _part(kind, scenario, BaselineOptions(cpf=True, single=False), jpeg_quality)


@cache
def code_version() -> str:
    """A hash of everything that numbers come from: this program's source, and what it calculates with."""
    return _hash_of(
        (path, name)
        for path, name in _files(".py", ".c")
        if not name.startswith(_NO_NUMBERS) or name.startswith("sim/experiments/computing")
    )


@cache
def program_version() -> str:
    """A hash of the whole program, with what it draws by."""
    return _hash_of(_files(".py", ".c", ".html", ".css"))


def _files(*endings: str) -> list[tuple[Path, str]]:
    """The program's files with their names from its root, sorted."""
    root = Path(sim.__file__).parents[1]
    paths = (path for package in _PACKAGES for path in (root / package).rglob("*.*"))
    return sorted((path, path.relative_to(root).as_posix()) for path in paths if path.suffix in endings)


def _hash_of(files: Iterable[tuple[Path, str]]) -> str:
    digest = hashlib.sha256()
    for path, name in files:
        digest.update(f"{name}\0".encode() + path.read_bytes())
    digest.update(f"numpy {np.__version__}, opencv {cv2.__version__}".encode())
    return digest.hexdigest()


def _part(
    kind: Kind, scenario: Scenario, baselines: BaselineOptions, jpeg_quality: int | None = None
) -> Part:
    told: dict[str, Any] = scenario.model_copy(update={"baselines": baselines}).model_dump(mode="json")
    text = json.dumps(told, sort_keys=True)
    key = hashlib.sha256(json.dumps([kind, text, jpeg_quality, code_version()]).encode()).hexdigest()
    return Part(kind, text, jpeg_quality, key[:32])
