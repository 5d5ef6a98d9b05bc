"""The state model against Eq. 18 and against its own noise, drawn by hand."""

import numpy as np
import pytest

from nodes.filtering.motion import (
    DynamicsOptions,
    autoregression,
    constant_velocity,
    motion_model,
    predict,
    transition,
)


def test_the_matrix_is_that_of_the_paper_in_its_units():
    # Eq. 18: centimetres and frames, so that an interval is 1
    model = constant_velocity(2, 1.0, DynamicsOptions(position_variance=10.0, velocity_variance=1.0))
    np.testing.assert_array_equal(model.F, [[1, 0, 1, 0], [0, 1, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]])
    np.testing.assert_array_equal(model.variances, [10, 10, 1, 1])


def test_the_defaults_are_the_papers_noise_in_metres_and_seconds():
    options = DynamicsOptions()
    assert options.position_variance == pytest.approx(10 * 0.01**2)  # 10 cm²
    assert options.velocity_variance == pytest.approx((0.01 * 10) ** 2)  # 1 (cm/frame)² at 10 Hz


@pytest.mark.parametrize("n_axes", [2, 3])
def test_a_state_moves_by_its_velocity_times_the_interval(n_axes):
    model = constant_velocity(n_axes, 0.25, DynamicsOptions())
    states = np.random.default_rng(0).normal(size=(7, 2 * n_axes))
    moved = transition(states, model)
    np.testing.assert_allclose(moved[:, :n_axes], states[:, :n_axes] + 0.25 * states[:, n_axes:])
    np.testing.assert_array_equal(moved[:, n_axes:], states[:, n_axes:])
    assert model.n_axes == n_axes


def test_the_noise_has_the_models_covariance():
    n = 100_000
    model = constant_velocity(2, 0.1, DynamicsOptions(position_variance=0.04, velocity_variance=0.25))
    states = np.tile([1.0, -2.0, 0.5, 3.0], (n, 1))
    noise = predict(states, model, np.random.default_rng(1)) - transition(states, model)
    scale = np.sqrt(model.variances)
    # means within 4 σ/√n; covariances within 4 √(2/n) of their scale
    assert np.abs(noise.mean(axis=0) / scale).max() < 4 / np.sqrt(n)
    deviation = np.cov(noise.T) / np.outer(scale, scale) - np.eye(4)
    assert np.abs(deviation).max() < 4 * np.sqrt(2 / n)


def test_the_same_stream_gives_the_same_draws():
    model = constant_velocity(3, 0.1, DynamicsOptions())
    states = np.zeros((5, 6))
    one, other = (predict(states, model, np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("A", "B"), [(1.5, -0.5), (((1.2, 0.1), (-0.3, 0.9)), -0.4), (1.0, ((0.1, 0.0), (0.2, 0.3)))]
)
def test_an_autoregression_is_eq_2_of_medeiros(A, B):
    model = autoregression(2, DynamicsOptions(model="autoregressive", A=A, B=B, position_variance=9.0))
    positions = np.random.default_rng(0).normal(size=(2, 2))
    now, last = positions
    state = np.concatenate([now, last])[None]
    a, b = (np.array(each) if isinstance(each, tuple) else each * np.eye(2) for each in (A, B))
    np.testing.assert_allclose(transition(state, model)[0], np.concatenate([a @ now + b @ last, now]))
    # only the new position is noisy; the old one is remembered to the last bit
    drawn = predict(np.repeat(state, 20_000, axis=0), model, np.random.default_rng(1))
    np.testing.assert_array_equal(drawn[:, 2:], np.repeat(state[:, :2], 20_000, axis=0))
    np.testing.assert_allclose(drawn[:, :2].std(axis=0), 3.0, rtol=0.03)


def test_a_2_and_b_minus_1_keep_the_velocity():
    options = DynamicsOptions(model="autoregressive", A=2.0, B=-1.0)
    remembering, moving = (motion_model(2, 0.1, each) for each in (options, DynamicsOptions()))
    position, velocity = np.array([3.0, -1.0]), np.array([2.0, 0.5])
    states = [np.r_[position, position - 0.1 * velocity][None], np.r_[position, velocity][None]]
    for _ in range(5):
        states = [
            transition(state, model) for state, model in zip(states, (remembering, moving), strict=True)
        ]
        np.testing.assert_allclose(states[0][0, :2], states[1][0, :2])


@pytest.mark.parametrize(("n_axes", "options"), [(2, {}), (3, {"A": 1.9, "B": -0.9})])
def test_what_stands_still_stays_where_it_is(n_axes, options):
    model = motion_model(n_axes, 0.1, DynamicsOptions(model="autoregressive", **options))
    still = np.tile(np.arange(n_axes) + 100.0, 2)[None]
    np.testing.assert_allclose(transition(still, model), still)
    assert model.n_axes == n_axes
