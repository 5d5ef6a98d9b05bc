"""What a camera costs in dcpf simulate, from a hundred to ten thousand of them, in turn."""

import resource
import time
from itertools import pairwise
from pathlib import Path
from statistics import median

from sim.assembly import Assembly
from sim.scenario.loading import load_scenario
from sim.simulation.simulation import simulate
from sim.simulation.summary import Simulated

HALL = Path(__file__).parents[1] / "scenarios" / "hall.yaml"
SIZES = (100, 300, 1000, 3000, 10_000)
TURNS, FRAMES_A_TURN = 8, 6


def main() -> None:
    running = {}
    for n in SIZES:
        given = [("cameras.count", str(n)), ("frames", str(1 + (1 + TURNS) * FRAMES_A_TURN))]
        scenario = load_scenario(HALL, given, rendered=False)
        running[n] = (simulate(Assembly(scenario)), Simulated(scenario), [])
    for _ in range(1 + TURNS):
        for frames, found, times in running.values():
            began = time.process_time()
            for _ in range(FRAMES_A_TURN):
                found.add(next(frames))
            times.append((time.process_time() - began) / FRAMES_A_TURN)
    cost = {n: median(times[1:]) for n, (_, _, times) in running.items()}
    print("cameras    ms a frame    µs a camera    µs a camera more")
    more = [None, *((cost[b] - cost[a]) / (b - a) for a, b in pairwise(SIZES))]
    for (n, each), slope in zip(cost.items(), more, strict=True):
        extra = "" if slope is None else f"{1e6 * slope:8.1f}"
        print(f"{n:7,}    {1e3 * each:10.2f}    {1e6 * each / n:11.1f}    {extra:>16}")
    print(f"peak memory of all together: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:,.0f} MB")


if __name__ == "__main__":
    main()
