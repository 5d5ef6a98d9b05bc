"""For the tests of experiments: the command in an empty folder with the small scenario, made-up findings."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from sim.commands.app import app
from sim.experiments.found.findings import Findings, GroupFindings
from sim.experiments.options import ExperimentOptions
from sim.experiments.plan import make_plan

N_FRAMES = 10

BRIEF = ["--frames", "3", "--set", "filter.n_particles=10"]
EXPERIMENT = {
    "name": "tiny",
    "runs": 2,
    "scenarios": ["small.yaml"],
    "page": ["rounds"],
    "studies": {
        "rounds": {
            "sweep": {"network.iterations": "1:3", "filter.n_particles": [10, 20]},
            "claims": [
                {"kind": "flat"},
                {"kind": "within", "percent": 5.0, "from_value": 2},
                {"kind": "noisier"},
            ],
        },
        "graphs": {
            "sweep": {"network.graph": ["ring", "path"]},
            "estimators": ["dcpf", "cpf"],
            "presets": ["paper", "robust"],
        },
        "ways": {"plot": "paths", "set": {"filter.n_particles": 10}},
        "frames": {"plot": "frames", "set": {"filter.n_particles": 10}},
        "bytes": {"plot": "bytes", "sweep": {"network.iterations": [1, 2]}, "jpeg_quality": 90},
        "time": {"plot": "time", "sweep": {"filter.n_particles": [10, 20]}},
        "strips": {"plot": "strips", "set": {"filter.n_particles": 10}},
    },
}


@pytest.fixture
def compare(tmp_path, monkeypatch):
    """Runs `dcpf compare` in the folder that holds `small.yaml`, without footage."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        result = CliRunner().invoke(app, ["compare", *map(str, arguments)])
        assert isinstance(result.exception, SystemExit | None)
        return result

    return run


@pytest.fixture
def tiny(small):
    """An experiment with a study of every kind of plot, beside `small.yaml`."""
    path = small.parent / "tiny.yaml"
    path.write_text(json.dumps(EXPERIMENT), encoding="utf-8")
    return path


def track(error):
    """A track that is so far from the origin, always or frame by frame."""
    away = np.broadcast_to(error, N_FRAMES)
    return {"positions": [[float(x), 0.0] for x in away], "nees": [1.0] * N_FRAMES}


def found(small, claim, errors, *, runs=3, disagreement=0.0, indefinite=0.0):
    """Findings of one study over t and n.

    `errors(t, n, seed)` gives those of DCPF, CPF and one or two single cameras, always or frame by frame.
    """
    study = {
        "sweep": {"network.iterations": ["1", "12"], "filter.n_particles": ["300", "500"]},
        "claims": [claim],
    }
    options = ExperimentOptions.model_validate(
        {"name": "e", "runs": runs, "scenarios": [str(small)], "studies": {"a": study}}
    )
    plan = make_plan(options, small.parent, [], lambda *_: "here")
    truth = [[0.0, 0.0]] * N_FRAMES
    summary = {"disagreement_m": disagreement, "fusion": {"indefinite_local_fraction": indefinite}}
    groups = []
    for group in plan.groups:
        t, n = (float(value) for _, value in group.settings)
        results = []
        for seed in group.seeds:
            dcpf, cpf, *singles = errors(t, n, seed)
            tracks = {"dcpf/A": track(dcpf)}
            tracks |= {f"single/{name}": track(each) for name, each in zip("AB", singles, strict=False)}
            cameras = {"tracks": tracks, "truth": truth, "summary": summary}
            results.append({"cameras": cameras, "central": {"tracks": {"cpf/c": track(cpf)}, "truth": truth}})
        groups.append(GroupFindings(group, results))
    return Findings(options, tuple(groups), dict.fromkeys(options.studies, 0))
