"""For the tests of recordings: a small run, recorded in this process, with pictures and without."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

from sim.assembly import Assembly
from sim.recording.film import McapFilm
from sim.results.recorder import FILM, Recorder
from sim.running.in_process import run_in_process
from sim.scenario.loading import load_scenario


@dataclass
class Recorded:
    """A run that is done, and all that it told."""

    folder: Path
    assembly: Assembly
    told: list

    @property
    def film(self):
        return self.folder / FILM

    def lines(self, name):
        return (self.folder / f"{name}.jsonl").read_bytes().splitlines()


@pytest.fixture
def recorded(small, tmp_path):
    """Records a run; its nodes are seen at the start, and B is lost at its end."""

    def record(*overrides, pictures=True):
        assembly = Assembly(load_scenario(small, overrides))
        film = partial(McapFilm, assembly=assembly) if pictures else None
        told = []
        with Recorder(tmp_path / "recorded", assembly.scenario, film) as recorder:
            for node in ("A", "B", "C", "D", "central"):
                recorder.event("seen", node, frame=0)
            for message in run_in_process(assembly, watched=pictures):
                recorder.add(message)
                told.append(message)
            recorder.event("lost", "B", frame=assembly.scenario.frames - 1)
        return Recorded(tmp_path / "recorded", assembly, told)

    return record
