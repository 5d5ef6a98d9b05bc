"""What bad links cost: RMSE against the same runs over perfect links, and in parts against CPF."""

import argparse
import statistics
from pathlib import Path

import joblib
import numpy as np

from network.messages import EstimateMessage, PixelsMessage
from sim.assembly import Assembly
from sim.metrics.errors import position_errors, rmse
from sim.running.in_process import run_in_process
from sim.running.results import Results
from sim.scenario.loading import load_scenario

REALTIME = [("pace", "realtime")]
LOSS = [("network.conditions.loss", "0.3")]
DELAY = [*REALTIME, ("network.conditions.delay_s", "0.1")]
FINITE = [("network.consensus", "{algorithm: finite_time}"), ("network.iterations", "2")]
RATIO = [("network.consensus", "{algorithm: ratio}"), ("network.iterations", "4")]
METROPOLIS = [("network.consensus", "{algorithm: metropolis}")]
CASES = {
    "30% loss": LOSS,
    "30% loss, metropolis": [*LOSS, *METROPOLIS],
    "100 ms delay": DELAY,
    "100 ms delay, 2 rounds finite_time": [*DELAY, *FINITE],
    "100 ms delay, 30% loss, 4 rounds ratio": [*DELAY, *LOSS, *RATIO],
}
FIRST, FRAMES = 20, 10
PARTS = (("C1", "C2"), ("C3", "C4"))


def run(path, overrides, seed):
    """The results of a run without baselines."""
    alone = ("baselines", "{cpf: false, single: false}")
    scenario = load_scenario(path, [*overrides, alone, ("seed", str(seed))])
    results = Results(scenario)
    for message in run_in_process(Assembly(scenario)):
        results.add(message)
    return results


def figures(path, overrides, seed):
    """RMSE over the frames, and of the estimates moved on to the time at which they come."""
    results = run(path, overrides, seed)
    scenario, truth = results.scenario, results.true_states()
    lag, n_axes = scenario.lag_frames, scenario.target.n_axes
    errors, now = [], []
    for track in results.of("dcpf").values():
        means = results.means(track)
        errors.append(position_errors(means, truth)[1:])
        moved = means.copy()
        moved[:, :n_axes] += lag / scenario.rate_hz * means[:, n_axes:]
        now.append(position_errors(moved[1 : len(moved) - lag], truth[1 + lag :]))
    return rmse(np.concatenate(errors)), rmse(np.concatenate(now))


def in_parts(path, seed):
    """RMSE of each part while the network is parted, and that of a CPF of its cameras from then on."""
    groups = ", ".join(f"[{', '.join(part)}]" for part in PARTS)
    parted = f"[{{groups: [{groups}], first_frame: {FIRST}, frames: {FRAMES}}}]"
    results = run(path, [("network.conditions.partitions", parted)], seed)
    truth = results.true_states()
    while_parted = slice(FIRST, FIRST + FRAMES)
    found = []
    for part in PARTS:
        errors = [position_errors(results.means(("dcpf", name)), truth)[while_parted] for name in part]
        central = position_errors(cpf_of(results.scenario, part), truth)[while_parted]
        found.append((rmse(np.concatenate(errors)), rmse(central)))
    return found


def cpf_of(scenario, part):
    """The estimates of a CPF that loses all cameras but a part's at the first frame of the partition."""
    assembly = Assembly(scenario)
    central, sources = assembly.central(), {name: assembly.source(name) for name in assembly.cameras}
    means = []
    for frame in range(FIRST + FRAMES):
        told = []
        for name in sources:
            if frame == FIRST and name not in part:
                told += central.on_lost(name)
        for name in sorted(central.cameras):
            told += central.on_message(PixelsMessage(name, frame, sources[name].read(frame)))
        means += [message.mean for message in told if isinstance(message, EstimateMessage)]
    missing = np.full((scenario.frames - len(means), len(means[0])), np.nan)
    return np.vstack([means, missing])


def spread(values):
    return f"{statistics.median(values):6.3f} (worst {max(values):.3f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenarios", nargs="*", default=["scenarios/scene1.yaml", "scenarios/scene2.yaml"])
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    over = joblib.Parallel(n_jobs=given.jobs)
    for path in map(Path, given.scenarios):
        seeds = range(given.runs)
        perfect = over(joblib.delayed(figures)(path, [], seed) for seed in seeds)
        print(f"{path.stem}: {given.runs} runs; over perfect links {spread([each for each, _ in perfect])} m")
        for name, overrides in CASES.items():
            found = over(joblib.delayed(figures)(path, overrides, seed) for seed in seeds)
            ratios = [bad / good for (bad, _), (good, _) in zip(found, perfect, strict=True)]
            pooled = np.sqrt(
                np.mean([bad**2 for bad, _ in found]) / np.mean([good**2 for good, _ in perfect])
            )
            now = spread([now for _, now in found])
            print(f"  {name:40s} x {spread(ratios)}, all runs {pooled:.3f}; where it is by then {now} m")
        parts = over(joblib.delayed(in_parts)(path, seed) for seed in seeds)
        for i, part in enumerate(PARTS):
            ratios = [run_[i][0] / run_[i][1] for run_ in parts]
            pooled = np.sqrt(np.mean([r[i][0] ** 2 for r in parts]) / np.mean([r[i][1] ** 2 for r in parts]))
            print(
                f"  {' and '.join(part)} on their own, over CPF   x {spread(ratios)}, all runs {pooled:.3f}"
            )


if __name__ == "__main__":
    main()
