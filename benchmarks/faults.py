"""What faults and bad links cost: RMSE against that of CPF with the cameras left, or over perfect links."""

import argparse
import json
import statistics
import sys
import time
from pathlib import Path

import joblib
import numpy as np

from sim.assembly import Assembly
from sim.faults.pictures import with_faults
from sim.metrics.errors import position_errors, rmse
from sim.results.results import Results
from sim.running.in_process import run_in_process
from sim.scenario.loading import load_scenario

PARTED, PARTED_FRAMES, PARTS = 20, 10, (("C1", "C2"), ("C3", "C4"))
SETTLED = 10  # frames after its return in which a node should agree with the others
WHOLE = slice(1, None)

REALTIME = [("pace", "realtime")]
LOSS = [("network.conditions.loss", "0.3")]
DELAY = [*REALTIME, ("network.conditions.delay_s", "0.1")]
FINITE = [("network.consensus", "{algorithm: finite_time}"), ("network.iterations", "2")]
RATIO = [("network.consensus", "{algorithm: ratio}"), ("network.iterations", "4")]
LINKS = {
    "30% loss": LOSS,
    "30% loss, metropolis": [*LOSS, ("network.consensus", "{algorithm: metropolis}")],
    "100 ms delay, 2 rounds finite_time": [*DELAY, *FINITE],
    "100 ms delay, 12 rounds metropolis": DELAY,
    "100 ms delay, 30% loss, 4 rounds ratio": [*DELAY, *LOSS, *RATIO],
}


def faults_of(seed, n_frames, names):
    """The faults of a run: the same camera and frame for all of them, by the seed."""
    rng = np.random.default_rng(seed)
    node, frame = str(rng.choice(names)), int(rng.integers(5, n_frames - 2 * SETTLED))
    one = {"node": node, "frame": frame}
    turned = {"kind": "miscalibrate", "yaw_deg": float(rng.choice([-3.0, 3.0]))}
    return frame, {
        "kill": one | {"kind": "kill"},
        "hang, 10 frames": one | {"kind": "hang", "frames": 10},
        "restart after 8 frames": one | {"kind": "restart", "frames": 8},
        "black pictures": one | {"kind": "black"},
        "frozen picture": one | {"kind": "freeze"},
        "knocked by 3 degrees": one | turned,
        "3 degrees off from the start": one | turned | {"frame": 0},
    }


class Pictures:
    """The pictures of a camera, rendered once for all runs of a seed."""

    def __init__(self, source, n_frames):
        self._pictures = [source.read(frame) for frame in range(n_frames)]

    def read(self, index):
        return self._pictures[index]

    def close(self):
        """Nothing is open."""


class Bench:
    """The runs of one scenario and seed."""

    def __init__(self, path, seed):
        self._path, self._seed, self._cpf = path, seed, {}
        plain = self._assembly([], cpf=False)
        self.scenario = plain.scenario
        self._pictures = {name: Pictures(plain.source(name), plain.scenario.frames) for name in plain.cameras}
        self.truth = plain.truth

    def dcpf(self, overrides=(), faults=()):
        """The errors of each camera's DCPF by frame, and what the run told."""
        assembly = self._assembly([*overrides, ("faults", json.dumps(faults))], cpf=False)
        results = self._run(assembly)
        return {name: self._errors(results, track) for name, track in results.of("dcpf").items()}, results

    def cpf(self, faults=()):
        """The errors of CPF by frame; those of the same faults are worked out once."""
        told = json.dumps(faults)
        if told not in self._cpf:
            results = self._run(self._assembly([("faults", told)], cpf=True), with_cameras=False)
            self._cpf[told] = self._errors(results, results.of("cpf")["central"])
        return self._cpf[told]

    def _assembly(self, overrides, *, cpf):
        alone = ("baselines", f"{{cpf: {str(cpf).lower()}, single: false}}")
        return Assembly(load_scenario(self._path, [*overrides, alone, ("seed", str(self._seed))]))

    def _run(self, assembly, *, with_cameras=True):
        faults = assembly.scenario.faults
        sources = {
            name: assembly.source(name)  # rendered anew from where it really is
            if any(fault.kind == "miscalibrate" and fault.node == name for fault in faults)
            else with_faults(self._pictures[name], camera, faults, render=None)
            for name, camera in assembly.cameras.items()
        }
        results = Results(assembly.scenario)
        for message in run_in_process(assembly, sources, with_cameras=with_cameras, with_visibility=False):
            results.add(message)
        return results

    def _errors(self, results, track):
        return position_errors(results.means(track), self.truth)


def over(errors, frames, but=()):
    """RMSE over some frames of all cameras but some."""
    return rmse(np.concatenate([each[frames] for name, each in errors.items() if name not in but]))


def measure(path, seed):
    """All cases of a seed.

    Returns:
        The seed; RMSE and the RMSE that it is held against; distance of a returned node from the mean of the
        others; RMSE of late estimates moved on to when they come: all in m, by case.
    """
    bench = Bench(path, seed)
    names = [camera.name for camera in bench.scenario.cameras]
    frame, faults = faults_of(seed, bench.scenario.frames, names)
    perfect, _ = bench.dcpf()
    found = {"no fault": (over(perfect, slice(frame, None)), rmse(bench.cpf()[frame:]))}
    apart = {}
    for case, fault in faults.items():
        found[case], distance = of_fault(bench, names, fault)
        if distance is not None:
            apart[case] = distance
    found |= in_parts(bench, names)
    # links: against the same run over perfect ones
    late = {}
    for case, overrides in LINKS.items():
        errors, results = bench.dcpf(overrides)
        found[case] = over(errors, WHOLE), over(perfect, WHOLE)
        if results.scenario.lag_frames:
            late[case] = by_then(results, bench.truth)
    return seed, found, apart, late


def by_then(results, truth):
    """RMSE of the estimates moved on, by their velocities, to the time at which they come."""
    scenario = results.scenario
    lag, n_axes = scenario.lag_frames, scenario.target.n_axes
    errors = []
    for track in results.of("dcpf").values():
        moved = results.means(track)
        moved[:, :n_axes] += lag / scenario.rate_hz * moved[:, n_axes:]
        errors.append(position_errors(moved[1 : len(moved) - lag], truth[1 + lag :]))
    return rmse(np.concatenate(errors))


def of_fault(bench, names, fault):
    """The survivors against CPF without the camera for as long, and how far off a returned node is."""
    node, begin = fault["node"], max(fault["frame"], 1)
    returns = fault["kind"] in ("hang", "restart")
    errors, results = bench.dcpf(faults=[fault])
    gone = [node] if returns or fault["kind"] == "kill" else []
    central = bench.cpf([fault if returns else {"kind": "kill", "node": node, "frame": begin}])
    pair = over(errors, slice(begin, None), gone), rmse(central[begin:])
    if not returns:
        return pair, None
    settled = begin + fault["frames"] + SETTLED
    means = {name: results.means(("dcpf", name))[settled, : bench.scenario.target.n_axes] for name in names}
    others = np.mean([mean for name, mean in means.items() if name != node], axis=0)
    return pair, float(np.linalg.norm(means[node] - others))


def in_parts(bench, names):
    """Each part of a network that has fallen apart, against CPF of its cameras."""
    groups = ", ".join(f"[{', '.join(part)}]" for part in PARTS)
    parted = f"[{{groups: [{groups}], first_frame: {PARTED}, frames: {PARTED_FRAMES}}}]"
    errors, _ = bench.dcpf([("network.conditions.partitions", parted)])
    while_parted = slice(PARTED, PARTED + PARTED_FRAMES)
    found = {}
    for part in PARTS:
        others = [name for name in names if name not in part]
        central = bench.cpf([{"kind": "kill", "node": name, "frame": PARTED} for name in others])
        case = f"partition, {' and '.join(part)}"
        found[case] = over(errors, while_parted, others), rmse(central[while_parted])
    return found


def table(rows):
    """Median, pooled and worst ratio of each case, and its seed."""
    print(f"  {'':40s} {'cm':>6s} {'against':>8s} {'median':>7s} {'pooled':>7s} {'worst':>7s}")
    for case in rows[0][1]:
        pairs = np.array([found[case] for _, found, _, _ in rows])
        ratios = pairs[:, 0] / pairs[:, 1]
        ours, theirs = np.sqrt(np.mean(pairs**2, axis=0))
        worst = int(np.argmax(ratios))
        print(
            f"  {case:40s} {100 * ours:6.2f} {100 * theirs:8.2f} {statistics.median(ratios):7.3f}"
            f" {ours / theirs:7.3f} {ratios[worst]:7.3f} by seed {rows[worst][0]}"
        )
    for case in rows[0][2]:
        apart = [found[case] for _, _, found, _ in rows]
        print(f"  {case}: {100 * max(apart):.1f} cm from the others {SETTLED} frames after, at worst")
    for case in rows[0][3]:
        late = statistics.median(found[case] for _, _, _, found in rows)
        print(f"  {case}: {100 * late:.1f} cm from where it is by then, median")
    sys.stdout.flush()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenarios", nargs="*", default=["scenarios/scene1.yaml", "scenarios/scene2.yaml"])
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    over_seeds = joblib.Parallel(n_jobs=given.jobs, return_as="generator_unordered")
    for path in map(Path, given.scenarios):
        rows, began = [], time.perf_counter()
        for row in over_seeds(joblib.delayed(measure)(path, seed) for seed in range(given.runs)):
            rows.append(row)
            print(
                f"{path.stem}: {len(rows)} of {given.runs}, {time.perf_counter() - began:.0f} s",
                file=sys.stderr,
            )
            if len(rows) in (4, given.runs):
                print(f"{path.stem}, {len(rows)} runs")
                table(sorted(rows, key=lambda each: each[0]))


if __name__ == "__main__":
    main()
