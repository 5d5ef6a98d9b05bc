"""Weights: symmetric, bounded, and right about when they converge."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from network.averaging.weights import ConsensusOptions, ConstantWeights, MetropolisWeights

degrees = st.integers(1, 50)


@settings(deadline=None)
@given(degrees, degrees)
def test_weights_are_symmetric(own, other):
    for weights in (ConstantWeights(epsilon=0.01), MetropolisWeights()):
        assert weights.weight(own, other) == weights.weight(other, own) > 0


@settings(deadline=None)
@given(degrees)
def test_metropolis_leaves_something_of_the_own_value(degree):
    assert degree * MetropolisWeights().weight(degree, 1) < 1


def test_constant_weights_state_their_bound():
    ConstantWeights(epsilon=0.325).require_convergence(2)  # the ring of four: 0.325 < 1/2
    with pytest.raises(ValueError, match=r"epsilon = 0.325 .* 4 neighbours: take it below 1/4 = 0.25"):
        ConstantWeights(epsilon=0.325).require_convergence(4)
    ConstantWeights(epsilon=3).require_convergence(0)


def test_metropolis_always_converges():
    MetropolisWeights().require_convergence(1000)


@pytest.mark.parametrize("epsilon", [0, -0.1, float("nan"), float("inf")])
def test_epsilon_is_positive_and_finite(epsilon):
    with pytest.raises(ValidationError):
        ConstantWeights(epsilon=epsilon)


def test_scenarios_choose_by_name():
    adapter = TypeAdapter(ConsensusOptions)
    assert adapter.validate_python({"algorithm": "constant", "epsilon": 0.3}) == ConstantWeights(epsilon=0.3)
    assert adapter.validate_python({"algorithm": "metropolis"}) == MetropolisWeights()
    with pytest.raises(ValidationError, match="'constant', 'metropolis'"):
        adapter.validate_python({"algorithm": "gossip"})
