import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from sim.world.curves import curve, wander

centimetres = st.integers(-1000, 1000).map(lambda n: n / 100)
keyframes = st.lists(st.tuples(st.floats(0.1, 5), centimetres, centimetres), min_size=2, max_size=8).map(
    lambda rows: (np.cumsum([row[0] for row in rows]), np.array([row[1:] for row in rows]))
)


@given(keyframes)
def test_a_curve_and_its_derivative_are_scipys_monotone_cubic(keys):
    times, values = keys
    reference = PchipInterpolator(times, values)
    ours = curve(times.tolist(), values.tolist())
    for time_s in np.linspace(times[0], times[-1], 41).tolist():
        np.testing.assert_allclose(ours.at(time_s), reference(time_s), atol=1e-8)
        np.testing.assert_allclose(ours.derivative_at(time_s), reference(time_s, 1), atol=1e-6)


def test_a_curve_holds_its_ends_and_waits_between_equal_keyframes():
    ours = curve([1.0, 2.0, 4.0, 5.0], [[0.0], [3.0], [3.0], [1.0]])
    assert ours.at(-9.0) == 0.0
    assert ours.at(9.0) == pytest.approx(1.0)
    assert ours.derivative_at(-9.0) == ours.derivative_at(9.0) == 0.0
    waiting = [ours.at(time_s)[0] for time_s in np.linspace(2, 4, 21).tolist()]
    np.testing.assert_allclose(waiting, 3.0)


def test_one_keyframe_makes_a_constant():
    still = curve([2.0], [[4.0, 5.0]])
    for time_s in (-1.0, 2.0, 2.5, 7.0):
        np.testing.assert_array_equal(still.at(time_s), [4.0, 5.0])
        np.testing.assert_array_equal(still.derivative_at(time_s), [0.0, 0.0])


def test_wandering_has_the_size_asked_for_and_a_consistent_velocity():
    times = np.arange(0.0, 200.0, 0.5).tolist()
    squares = []
    for seed in range(20):
        deviation = wander(0.05, np.random.default_rng(seed))
        squares += [deviation.at(time_s) ** 2 for time_s in times]
        numeric = (deviation.at(3.001) - deviation.at(2.999)) / 0.002
        np.testing.assert_allclose(deviation.derivative_at(3.0), numeric, atol=1e-6)
    assert np.sqrt(np.mean(squares)) == pytest.approx(0.05, rel=0.03)
