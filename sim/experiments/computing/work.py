"""Computes one part of a run, here or on another host: from a resolved scenario to plain data."""

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from sim.assembly import Assembly
from sim.experiments.computing.errors import EngineError
from sim.experiments.computing.parts import Part, code_version
from sim.experiments.computing.pictures import CodedSource, KeptSource, kept_pictures
from sim.metrics.consistency import nees
from sim.results.results import Results, Track, summarize
from sim.running.in_process import run_in_process
from sim.scenario.model import Scenario

_DIGITS = 5
"""Of positions in metres: a hundredth of a millimetre."""


def compute(part: Part, code: str) -> dict[str, Any]:
    """The result of a part.

    Args:
        part: The part.
        code: The code version of the program that asks for it.

    Returns:
        `summary`, as `summary.json` has it; `tracks`: of each `estimator/node` the `positions` in m and the
        `nees` from frame 0 on, None where there is none; `truth`: the true positions; `cpu_ms_per_frame`:
        processor time of all nodes together, without the making of pictures; `bytes_per_frame` of coded ones.

    Raises:
        EngineError: This process runs another version of the program.
    """
    if code != code_version():
        raise EngineError(
            "the workers run another version of dcpf: install this one there and start them again"
        )
    scenario = Scenario.model_validate_json(part.scenario)
    assembly = Assembly(scenario)
    kept = kept_pictures(part.pictures)
    raw = {name: KeptSource(assembly, name, kept) for name in assembly.cameras}
    coded: dict[str, CodedSource] = {}
    if part.jpeg_quality is not None:
        color = scenario.filter.color
        coded = {name: CodedSource(source, part.jpeg_quality, color) for name, source in raw.items()}
    sources: Mapping[str, KeptSource | CodedSource] = coded or raw
    results = Results(scenario)
    began = time.process_time()
    for message in run_in_process(
        assembly, sources, with_cameras=part.kind == "cameras", with_visibility=False
    ):
        results.add(message)
    spent = time.process_time() - began - sum(source.spent_s for source in sources.values())
    return {
        "summary": summarize(results, processes=1),
        "tracks": {"/".join(track): _track(results, track) for track in sorted(results.tracks)},
        "truth": _positions(results.true_states()),
        "cpu_ms_per_frame": 1000 * spent / scenario.frames,
        "bytes_per_frame": {
            name: sum(getattr(source, f"{name}_bytes") for source in coded.values()) / scenario.frames
            for name in (("jpeg", "bins") if coded else ())
        },
    }


def _track(results: Results, track: Track) -> dict[str, Any]:
    means, truth = results.means(track), results.true_states()
    found = None if truth is None else nees(means, results.covariances(track), truth)
    return {"positions": _positions(means), "nees": None if found is None else as_plain(found, 4)}


def _positions(states: Float[np.ndarray, "T D"] | None) -> list[Any] | None:
    return None if states is None else as_plain(states[:, : states.shape[1] // 2], _DIGITS)


def as_plain(values: Float[np.ndarray, "..."], digits: int) -> list[Any]:
    """Numbers for JSON, rounded; None for what is not finite."""
    plain = np.round(values, digits).astype(object)
    plain[~np.isfinite(values)] = None
    return list(plain.tolist())
