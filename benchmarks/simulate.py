"""What a camera costs in dcpf simulate, from a hundred to ten thousand of them, in turn."""

import resource
import time
from itertools import pairwise
from pathlib import Path
from statistics import median

from sim.assembly import Assembly
from sim.scenario.loading import load_scenario
from sim.simulation.simulation import frames_per_block, simulate
from sim.simulation.summary import Simulated

HALL = Path(__file__).parents[1] / "scenarios" / "hall.yaml"
SIZES = (100, 300, 1000, 3000, 10_000)
TURNS, BLOCKS_A_TURN = 12, 2


def main() -> None:
    running = {}
    for n in SIZES:
        n_frames = 1 + (1 + TURNS) * BLOCKS_A_TURN * frames_per_block(n)
        given = [("cameras.count", str(n)), ("frames", str(n_frames))]
        scenario = load_scenario(HALL, given, rendered=False)
        running[n] = (simulate(Assembly(scenario)), Simulated(scenario), [])
        running[n][1].add(next(running[n][0]))
    for _ in range(1 + TURNS):
        for n, (blocks, found, times) in running.items():
            began = time.process_time()
            for _ in range(BLOCKS_A_TURN):
                found.add(next(blocks))
            times.append((time.process_time() - began) / BLOCKS_A_TURN / frames_per_block(n))
    cost = {n: median(times[1:]) for n, (_, _, times) in running.items()}
    print("cameras    ms a frame    µs a camera    µs a camera more")
    more = [None, *((cost[b] - cost[a]) / (b - a) for a, b in pairwise(SIZES))]
    for (n, each), slope in zip(cost.items(), more, strict=True):
        extra = "" if slope is None else f"{1e6 * slope:8.1f}"
        print(f"{n:7,}    {1e3 * each:10.2f}    {1e6 * each / n:11.1f}    {extra:>16}")
    print(f"a camera of {SIZES[0]} over one of {SIZES[-1]:,}: {each_of(cost, 0) / each_of(cost, -1):.2f}")
    print(f"peak memory of all together: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:,.0f} MB")


def each_of(cost: dict[int, float], index: int) -> float:
    """Of a camera of the network that has this place in SIZES."""
    return cost[SIZES[index]] / SIZES[index]


if __name__ == "__main__":
    main()
