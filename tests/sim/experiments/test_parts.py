"""Runs in parts: together they are the whole run, and each depends on what it must and on nothing else."""

import json

import numpy as np
import pytest

from sim.assembly import Assembly
from sim.experiments.computing.parts import cameras_part, central_part, code_version
from sim.experiments.computing.pictures import CodedSource, KeptSource, kept_pictures
from sim.experiments.computing.work import compute
from sim.experiments.found.joining import joined
from sim.scenario.loading import load_scenario

SHORT = [("frames", "4"), ("filter.n_particles", "20")]


@pytest.mark.parametrize("preset", ["paper", "robust"])
def test_the_parts_of_a_run_make_its_summary(small, summary_of, preset):
    overrides = [*SHORT, ("preset", preset)]
    scenario = load_scenario(small, overrides)
    parts = {"cameras": cameras_part(scenario, with_single=True), "central": central_part(scenario)}

    found = {kind: compute(part, code_version())["summary"] for kind, part in parts.items()}

    whole = summary_of(small, *overrides)
    whole.pop("timing")
    assert joined(found) == whole


def test_what_was_found_holds_the_errors_of_the_summary(small):
    scenario = load_scenario(small, SHORT)

    found = compute(central_part(scenario), code_version())

    positions = np.array(found["tracks"]["cpf/central"]["positions"])
    errors = np.linalg.norm(positions - found["truth"], axis=1)[1:]
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(found["summary"]["rmse_m"]["cpf"], abs=1e-5)
    nees = np.array(found["tracks"]["cpf/central"]["nees"])[1:]
    assert nees.mean() / 2 == pytest.approx(found["summary"]["anees"]["cpf"], abs=1e-4)
    assert json.loads(json.dumps(found)) == found


@pytest.mark.parametrize(
    ("override", "for_cameras", "for_central"),
    [
        (("network.iterations", "7"), True, False),
        (("network.graph", "path"), True, False),
        (("network.consensus", "{algorithm: constant, epsilon: 0.2}"), True, False),
        (("network.conditions.loss", "0.3"), True, False),
        (("fusion.rule", "eq17"), True, False),
        (("filter.n_particles", "33"), True, True),
        (("seed", "1"), True, True),
        (("world.noise", "5"), True, True),
        (("baselines.cpf", "false"), False, False),
    ],
)
def test_a_part_is_known_by_what_it_depends_on(small, override, for_cameras, for_central):
    without, with_it = load_scenario(small, SHORT), load_scenario(small, [*SHORT, override])

    keys = [(cameras_part(s, with_single=False).key, central_part(s).key) for s in (without, with_it)]

    assert (keys[0][0] != keys[1][0]) == for_cameras
    assert (keys[0][1] != keys[1][1]) == for_central


@pytest.mark.parametrize(
    "override",
    [
        ("network.iterations", "7"),
        ("network.graph", "path"),
        ("network.conditions.loss", "0.3"),
        ("fusion.rule", "eq17"),
    ],
)
def test_cpf_does_not_depend_on_what_its_key_leaves_out(small, summary_of, override):
    one, other = (summary_of(small, *overrides) for overrides in (SHORT, [*SHORT, override]))

    assert one["rmse_m"]["cpf"] == other["rmse_m"]["cpf"]


def test_kept_pictures_are_the_rendered_ones_and_cannot_be_changed(small):
    assembly = Assembly(load_scenario(small, SHORT))
    kept = kept_pictures("a key of this test")
    fresh, source = assembly.source("A"), KeptSource(assembly, "A", kept)

    for frame in range(3):
        picture = fresh.read(frame)
        np.testing.assert_array_equal(source.read(frame), picture)
        again = KeptSource(assembly, "A", kept).read(frame)
        np.testing.assert_array_equal(again, picture)
        with pytest.raises(ValueError, match="read-only"):
            again[0, 0, 0] = 1
    assert kept_pictures("a key of this test") is kept
    assert not kept_pictures("another")


def test_coded_pictures_are_counted_and_near_the_raw_ones(small):
    scenario = load_scenario(small, SHORT)
    assembly = Assembly(scenario)
    raw, bytes_of = assembly.source("A").read(0), {}

    for quality in (50, 95):
        source = CodedSource(KeptSource(assembly, "A", {}), quality, scenario.filter.color)
        decoded = source.read(0)
        assert np.abs(decoded.astype(float) - raw).mean() < 8
        bytes_of[quality] = source.jpeg_bytes
        assert 0 < source.bins_bytes < raw.size

    assert bytes_of[50] < bytes_of[95] < raw.size
