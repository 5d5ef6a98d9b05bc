"""What a frame costs on one core: rendering a picture, and the likelihoods of all particles in it."""

import statistics
import time
from collections.abc import Callable
from pathlib import Path

import cv2
from threadpoolctl import threadpool_limits

from nodes.filtering.motion import predict
from sim.assembly import Assembly
from sim.scenario.loading import load_scenario

ROUNDS = 60


def median_ms(step: Callable[[int], object]) -> float:
    """Median of the thread's own time, which other processes lengthen least."""
    durations = []
    for index in range(ROUNDS):
        began = time.thread_time()
        step(index)
        durations.append(time.thread_time() - began)
    return 1e3 * statistics.median(durations)


def measure(preset: str) -> None:
    """The figures of camera C1 of scene 1."""
    overrides = [("preset", preset), ("frames", str(ROUNDS + 1))]
    assembly = Assembly(load_scenario(Path("scenarios/scene1.yaml"), overrides))
    source, setup = assembly.source("C1"), assembly.setup
    print(f"{preset}: render a 640x480 picture      {median_ms(source.read):6.2f} ms")
    image = source.read(0)
    model = assembly.model("C1").with_first(image)
    appearance = model.first_appearance(model.look(image), setup.start.moments.position().mean)
    states = setup.first_particles(setup.stream("benchmark")).states
    positions = predict(states, setup.motion, setup.stream("benchmark", "motion"))[:, :2]
    cost = median_ms(lambda _: model.log_likelihoods(model.look(image), positions, appearance))
    print(f"{preset}: likelihoods of {len(positions)} particles {cost:6.2f} ms")


cv2.setNumThreads(1)
threadpool_limits(1)
measure("robust")
measure("paper")
