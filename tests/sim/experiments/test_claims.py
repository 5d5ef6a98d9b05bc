"""Claims against findings made by hand."""

import numpy as np
import pytest

from sim.experiments.found.claims import judge

from .conftest import N_FRAMES, found


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


def test_flat_follows_single_cameras_and_needs_them_to_stay(small):
    told = verdict(small, {"kind": "flat"}, lambda t, _n, _s: (0.1, 0.1, 0.5, *[0.4] * (t == 1)))

    assert told.holds is None
    assert "the cameras are not the same ones" in told.text


@pytest.mark.parametrize(("factor", "holds"), [(1.0, True), (1.049, True), (1.06, False)])
def test_within_looks_from_a_value_on(small, factor, holds):
    told = verdict(
        small,
        {"kind": "within", "percent": 5.0, "from_value": 12.0},
        lambda t, _n, seed: ((9.0 if t == 1 else factor) * (1 + seed), 1.0 + seed, 1.0, 1.0),
    )

    assert told.holds is holds
    assert ("Why: " in told.text) is not holds
    assert f"at most {factor:.2f} times CPF's" in told.text


@pytest.mark.parametrize(("few", "many", "holds"), [(0.2, 0.1, True), (0.1, 0.2, False)])
def test_noisier_compares_deviations_over_the_runs(small, few, many, holds):
    told = verdict(
        small,
        {"kind": "noisier"},
        lambda _t, n, seed: (1 + seed * (few if n == 300 else many), 1.0, 1.0, 1.0),
    )

    assert told.holds is holds
    assert f"{few:.4f} m with filter.n_particles = 300, by {many:.4f} m with 500" in told.text


@pytest.mark.parametrize(
    ("claim", "runs", "sentence"),
    [
        ({"kind": "noisier"}, 1, "one run has no deviation"),
        ({"kind": "within", "from_value": 20}, 3, "has no value from 20 on"),
    ],
)
def test_what_the_runs_cannot_say_is_not_judged(small, claim, runs, sentence):
    (told,) = judge(found(small, claim, lambda *_: (0.1, 0.1, 0.1, 0.1), runs=runs))

    assert told.holds is None
    assert told.in_words == "cannot be judged"
    assert sentence in told.text
