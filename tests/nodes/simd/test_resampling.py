"""Resampling against replication counts computed otherwise, and replication against NumPy's repeat."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.filtering.particles import systematic_indices
from nodes.simd.array import ProcessorArray
from nodes.simd.options import SimdOptions
from nodes.simd.programs.normalizing import Group, add_up, scale_factor
from nodes.simd.programs.resampling import replicate, replication_bounds

GROUP, P = Group(5, 24), 32
RULES = pytest.mark.parametrize("rule", ["simplified", "residual", "systematic"])
ARITHMETICS = pytest.mark.parametrize("arithmetic", ["float", "fixed10", "fixed20"])


def resampled(values, rule, arithmetic, *, batching=True, seed=0, group=GROUP):
    """The children of each particle, and the particles in their elements afterwards."""
    options = SimdOptions(processing_elements=P, arithmetic=arithmetic, resampling=rule)
    array = ProcessorArray(options, batching=batching)
    weight, place = array.number(), array.word()
    lanes = np.zeros(P, values.dtype)
    lanes[group.elements] = values
    array.input(weight, lanes)
    array.input(place, np.full(P, 1022))
    place.value[group.elements] = np.arange(group.n)
    total = array.number(n_words=options.number_words + 1)
    add_up(array, total, weight, group)
    start, end, state, other = array.word(), array.word(), array.number(n_words=1), array.number(n_words=1)
    array.input(state, np.arange(P) + 100)
    array.input(other, 3 * np.arange(P))
    with array.step("resampling") as cost:
        factor = scale_factor(array, total, group)
        rng = np.random.default_rng(seed)
        replication_bounds(array, (start, end), weight, factor, place, group, rng)
        replicate(array, (state, other), (start, end), place, group)
    outside = np.delete(np.arange(P), np.arange(P)[group.elements])
    np.testing.assert_array_equal(state.value[outside], outside + 100)
    np.testing.assert_array_equal(other.value, 3 * (state.value - 100))
    children = (end.value.astype(int) - start.value)[group.elements]
    return children, state.value[group.elements] - 100 - group.first, cost


def weights(seed, arithmetic, n=GROUP.n):
    rng = np.random.default_rng(seed)
    values = rng.random(n) ** rng.integers(1, 12)
    full = {"float": 1, "fixed10": 2**10 - 1, "fixed20": 2**20 - 1}[arithmetic]
    return values if arithmetic == "float" else (values * full).astype(int)


@RULES
@ARITHMETICS
@given(seed=st.integers(0, 2**32 - 1))
def test_every_element_gets_a_particle_as_often_as_it_is_replicated(rule, arithmetic, seed):
    values = weights(seed, arithmetic)
    values[seed % GROUP.n] += 1  # one at least is not zero
    children, ancestors, _ = resampled(values, rule, arithmetic, seed=seed)
    assert children.min() >= 0
    assert children.sum() == GROUP.n
    np.testing.assert_array_equal(ancestors, np.repeat(np.arange(GROUP.n), children))


@RULES
@pytest.mark.parametrize("arithmetic", ["float", "fixed10"])
def test_all_at_once_is_as_one_by_one(rule, arithmetic):
    values = weights(4, arithmetic)
    children, ancestors, cost = resampled(values, rule, arithmetic)
    expected = resampled(values, rule, arithmetic, batching=False)
    np.testing.assert_array_equal(children, expected[0])
    np.testing.assert_array_equal(ancestors, expected[1])
    assert cost == expected[2]


@given(st.integers(0, 2**32 - 1))
def test_the_simplified_rule_gives_the_best_what_rounding_leaves(seed):
    values = weights(seed, "float")
    children, _, _ = resampled(values, "simplified", "float")
    expected = np.floor(GROUP.n * values / values.sum()).astype(int)
    expected[values.argmax()] += GROUP.n - expected.sum()
    np.testing.assert_array_equal(children, expected)


@given(st.integers(0, 2**32 - 1))
def test_the_systematic_rule_is_the_networks_own(seed):
    values = weights(seed, "float")
    children, _, _ = resampled(values, "systematic", "float", seed=seed)
    offset = np.random.default_rng(seed).random()
    # ⌊M Σ w + u⌋ counts the strata at k + 1 - u
    ancestors = systematic_indices(values / values.sum(), 1 - offset)
    np.testing.assert_array_equal(children, np.bincount(ancestors, minlength=GROUP.n))


@pytest.mark.parametrize("rule", ["residual", "systematic"])
@pytest.mark.parametrize("arithmetic", ["float", "fixed10"])
def test_the_expected_number_of_children_is_the_weight(rule, arithmetic):
    values = weights(7, arithmetic)
    runs = np.array([resampled(values, rule, arithmetic, seed=seed)[0] for seed in range(150)])
    expected = GROUP.n * values / values.sum()
    # at most all M - Σ⌊M w⌋ draws fall to a particle by chance
    deviation = np.sqrt(np.maximum(expected, 0.05) / len(runs))
    assert (np.abs(runs.mean(axis=0) - expected) < 5 * deviation + 0.02).all()
    assert (runs >= np.floor(expected * (1 - 1e-2)) - 1).all()


@pytest.mark.parametrize("arithmetic", ["fixed10", "fixed20"])
def test_fixed_point_factors_are_the_exact_ones_or_one_less(arithmetic):
    for seed in range(40):
        values = weights(seed, arithmetic) + 1
        children, _, _ = resampled(values, "simplified", arithmetic)
        exact = np.floor(GROUP.n * values / values.sum())
        others = np.arange(GROUP.n) != values.argmax()
        assert set((exact - children)[others]) <= {0, 1}
        assert (exact != children)[others].sum() <= 2


def test_equal_weights_change_nothing():
    children, ancestors, _ = resampled(np.full(GROUP.n, 0.25), "systematic", "float")
    assert children.tolist() == [1] * GROUP.n
    np.testing.assert_array_equal(ancestors, np.arange(GROUP.n))
