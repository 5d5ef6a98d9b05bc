"""For the tests of experiments: the command in an empty folder with the small scenario."""

import json

import pytest
from typer.testing import CliRunner

from sim.commands.app import app

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
                {"kind": "within", "percent": 5.0, "from_value": 2, "otherwise": "few particles"},
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
