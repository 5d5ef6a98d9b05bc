"""Threads against one: the steps of the filter, and a whole clip (Truong & Kim 2017, Fig. 4 to 7).

Their names for the steps: *shuffling* moves the particles, *likelihood* compares their boxes with the target,
and *resampling* draws the new ones. The shuffle has one thread here: its draws come from one stream, one
after the other.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from threadpoolctl import threadpool_limits

from nodes.filtering.motion import predict
from nodes.filtering.particles import LEAST_OUTPUTS, Particles, resample, reweight
from nodes.filtering.sir import View, sir_step
from nodes.threads import in_shares, n_shares
from nodes.vision.observation import LEAST_BOXES, ObservationModel
from sim.assembly import Assembly
from sim.benchmarks.settings import SETTINGS, Setting, setting
from sim.benchmarks.timing import times_in_turn
from sim.scenario.loading import load_scenario

PAPERS = 300
"""Particles of the paper."""
PARTICLES = (PAPERS, 1000, 3000, 10_000, 30_000, 100_000, 300_000)
"""How many are measured; the last is what the summary's ratios of the steps are for."""
CLIP_PARTICLES = (PAPERS, 100_000)
"""How many follow the target through the whole clip; the last is for the summary's frames per second."""
ROUNDS = 9


@dataclass(frozen=True, slots=True)
class Times:
    """What a step took by one thread and by several, in ms."""

    sequential_ms: float
    parallel_ms: float

    @property
    def ratio(self) -> float:
        """How many times faster several threads are."""
        return self.sequential_ms / self.parallel_ms


def bench_parallel(
    folder: Path, n_threads: int, done: Callable[[], object] = lambda: None, n_frames: int | None = None
) -> dict[str, Any]:
    """Measures all numbers of particles, and the whole clip with the fewest and the most.

    Args:
        folder: Where the scenario is.
        n_threads: Threads to compare with one.
        done: Called after each number of particles, and each clip.
        n_frames: Frames of the clip; all by default.

    Raises:
        ScenarioError: The scenario is not there.
    """
    # As in the nodes' processes: the threads are the filter's, not OpenCV's.
    cv2.setNumThreads(1)
    threadpool_limits(1)
    rows: list[dict[str, Any]] = []
    for n in PARTICLES:
        steps = _steps(setting("B", folder, [("filter.n_particles", str(n))]), n_threads)
        used = {
            "likelihood": n_shares(n, n_threads, LEAST_BOXES),
            "resampling": n_shares(n, n_threads, LEAST_OUTPUTS),
        }
        times = {
            name: {"sequential": t.sequential_ms, "parallel": t.parallel_ms} for name, t in steps.items()
        }
        rows.append({"particles": n, "threads_used": used, "ms": times})
        done()
    clips: dict[int, dict[str, float]] = {}
    for n in CLIP_PARTICLES:
        clips[n] = _clip(folder, n, n_threads, n_frames)
        done()
    rates = clips[CLIP_PARTICLES[-1]]
    return {
        "threads": n_threads,
        "particles": PARTICLES[-1],
        **{name: steps[name].ratio for name in ("likelihood", "resampling", "shuffle")},
        "clip_particles": CLIP_PARTICLES[-1],
        "clip": rates["parallel"] / rates["sequential"],
        "frames_per_s": rates,
        "frames_per_s_by_particles": clips,
        "steps": rows,
    }


def _steps(chosen: Setting, n_threads: int) -> dict[str, Times]:
    """Each step by one thread and by so many, whether they pay or not."""
    model, rng = chosen.models["fast"], chosen.setup.stream("benchmark", "shuffle")
    moved = predict(chosen.particles.states, chosen.setup.motion, rng)
    predicted = Particles(moved, chosen.particles.log_weights)
    boxes = chosen.boxes

    distances = np.empty(len(boxes))

    def measure(share: slice) -> None:
        distances[share] = model.box_distances(chosen.picture, boxes[share], chosen.appearance)

    log_likelihoods = model.log_likelihoods(chosen.picture, predicted.positions, chosen.appearance)
    weighted = reweight(predicted, log_likelihoods)

    def both(run: Callable[[int], object]) -> Times:
        variants = {str(k): lambda k=k: run(k) for k in (1, n_threads)}
        took = times_in_turn(variants, time.perf_counter, ROUNDS)
        return Times(1e3 * took["1"], 1e3 * took[str(n_threads)])

    shuffle = both(lambda _: predict(chosen.particles.states, chosen.setup.motion, rng))
    return {
        "likelihood": both(lambda k: in_shares(measure, len(moved), k, 1)),
        "resampling": both(lambda k: resample(weighted, 0.5, k, 1)),
        "shuffle": Times(shuffle.sequential_ms, shuffle.sequential_ms),
    }


def _clip(folder: Path, n: int, n_threads: int, n_frames: int | None) -> dict[str, float]:
    """Frames a second of the tracker on ready pictures, as the program would run it.

    Both run side by side, frame after frame, so that a disturbance meets both, and the median frame counts;
    they must agree to the last bit.
    """
    overrides = [("filter.n_particles", str(n)), *([("frames", str(n_frames))] if n_frames else [])]
    assembly = Assembly(load_scenario(folder / f"{SETTINGS['B']}.yaml", overrides))
    setup, camera = assembly.setup, next(iter(assembly.cameras))
    model, source = assembly.model(camera), assembly.source(camera)
    first = model.look(source.read(0))
    appearance = model.first_appearance(first, setup.start.mean[: setup.target.n_axes])
    runs = []
    for k in (1, n_threads):
        rng = setup.stream("benchmark", "clip")
        runs.append(_Run(_threaded(model, k), k, rng, setup.first_particles(rng)))
    took = np.zeros((assembly.scenario.frames - 1, len(runs)))
    for frame in range(1, assembly.scenario.frames):
        image = source.read(frame)
        for number in (0, 1) if frame % 2 else (1, 0):
            run = runs[number]
            began = time.perf_counter()
            view = View(run.model, run.model.look(image), appearance)
            threshold = setup.filter.resampling.threshold
            run.particles, _ = sir_step(
                run.particles, [view], setup.motion, threshold, run.rng, run.n_threads
            )
            took[frame - 1, number] = time.perf_counter() - began
        if not np.array_equal(runs[0].particles.states, runs[1].particles.states):
            raise AssertionError(f"frame {frame}: {n_threads} threads found other particles than one")
    sequential, parallel = (1 / np.median(took, axis=0)).tolist()
    return {"sequential": sequential, "parallel": parallel}


@dataclass(slots=True)
class _Run:
    """A filter under way."""

    model: ObservationModel
    n_threads: int
    rng: np.random.Generator
    particles: Particles


def _threaded(model: ObservationModel, n_threads: int) -> ObservationModel:
    return replace(model, options=model.options.model_copy(update={"threads": n_threads}))
