"""Claims against findings made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from sim.experiments.found.claims import judge
from sim.experiments.found.findings import Findings, GroupFindings
from sim.experiments.options import ExperimentOptions
from sim.experiments.plan import make_plan

N_FRAMES = 4


def track(error):
    """A track that is always so far from the origin."""
    return {"positions": [[error, 0.0]] * N_FRAMES, "nees": [1.0] * N_FRAMES}


def found(small, claim, errors):
    """Findings of one study: `errors(t, n, seed)` gives those of DCPF, CPF and two single cameras."""
    study = {
        "sweep": {"network.iterations": ["1", "12"], "filter.n_particles": ["300", "500"]},
        "claims": [claim],
    }
    options = ExperimentOptions.model_validate(
        {"name": "e", "runs": 3, "scenarios": [str(small)], "studies": {"a": study}}
    )
    plan = make_plan(options, small.parent, [], lambda *_: "here")
    groups = []
    for group in plan.groups:
        t, n = (float(value) for _, value in group.settings)
        results = []
        for seed in group.seeds:
            dcpf, cpf, first, second = errors(t, n, seed)
            results.append(
                {
                    "cameras": {
                        "tracks": {
                            "dcpf/A": track(dcpf),
                            "single/A": track(first),
                            "single/B": track(second),
                        },
                        "truth": [[0.0, 0.0]] * N_FRAMES,
                    },
                    "central": {"tracks": {"cpf/c": track(cpf)}, "truth": [[0.0, 0.0]] * N_FRAMES},
                }
            )
        groups.append(GroupFindings(replace(group), results))
    return Findings(options, tuple(groups), dict.fromkeys(options.studies, 0))


def verdict(small, claim, errors):
    (only,) = judge(found(small, claim, errors))
    return only


def test_groups_have_the_errors_of_their_tracks(small):
    groups = found(small, {"kind": "flat"}, lambda _t, _n, seed: (0.1 + seed, 0.2, 0.5, 0.4)).groups

    assert groups[0].rmse("dcpf") == pytest.approx([0.1, 1.1, 2.1])
    assert groups[0].rmse("cpf") == pytest.approx([0.2] * 3)
    assert groups[0].rmse("single") == pytest.approx([0.4] * 3)
    np.testing.assert_allclose(groups[0].node_rmse("single"), [[0.5, 0.4]] * 3)
    np.testing.assert_allclose(groups[0].paths("single"), np.tile([0.4, 0.0], (3, N_FRAMES, 1)))
    assert not groups[0].has("coded")


@pytest.mark.parametrize(("step", "holds"), [(0.0, True), (0.02, True), (0.03, False)])
def test_flat_is_a_quarter_of_what_single_cameras_change(small, step, holds):
    # Over t, the single cameras change by 0.1 m.
    def errors(t, _n, _seed):
        late = t > 1
        return 0.1 + step * late, 0.1, 0.5 + 0.1 * late, 0.7 - 0.1 * late

    assert verdict(small, {"kind": "flat"}, errors).holds is holds


@pytest.mark.parametrize(("factor", "holds"), [(1.0, True), (1.049, True), (1.06, False)])
def test_within_looks_from_a_value_on(small, factor, holds):
    found = verdict(
        small,
        {"kind": "within", "percent": 5.0, "from_value": 12.0, "otherwise": "because  of\n this"},
        lambda t, _n, seed: ((9.0 if t == 1 else factor) * (1 + seed), 1.0 + seed, 1.0, 1.0),
    )

    assert found.holds is holds
    assert found.text.endswith("Why: because of this") is not holds
    assert f"at most {factor:.2f} times CPF's" in found.text


@pytest.mark.parametrize(("few", "many", "holds"), [(0.2, 0.1, True), (0.1, 0.2, False)])
def test_noisier_compares_deviations_over_the_runs(small, few, many, holds):
    found = verdict(
        small,
        {"kind": "noisier"},
        lambda _t, n, seed: (1 + seed * (few if n == 300 else many), 1.0, 1.0, 1.0),
    )

    assert found.holds is holds
    assert f"{few:.4f} m with filter.n_particles = 300, by {many:.4f} m with 500" in found.text
