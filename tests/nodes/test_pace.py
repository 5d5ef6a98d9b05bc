"""Deadlines of rounds: absolute, rising, and at the end of the budget for the last."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.shell.pace import Pace, lag_for


@given(st.sampled_from(["lockstep", "realtime"]), st.floats(0.5, 120), st.integers(1, 50), st.integers(0, 20))
def test_rounds_share_the_budget(kind, rate_hz, iterations, lag):
    pace = Pace(kind, rate_hz, 5.0, iterations, lag if kind == "realtime" else 0)
    deadlines = np.array([pace.round_deadline_s(round_) for round_ in range(1, iterations + 1)])
    assert deadlines[-1] == pytest.approx(pace.budget_s)
    shares = np.diff(deadlines, prepend=0.0)
    np.testing.assert_allclose(shares[1:], shares[-1])
    # who is late to begin with may take half a frame longer
    assert shares[0] - shares[-1] == pytest.approx(
        0 if iterations == 1 else 0.5 * pace.budget_s / (1 + pace.lag_frames)
    )


def test_a_frame_s_lane_is_free_when_the_next_one_needs_it():
    pace = Pace("realtime", 10.0, 5.0, 12, lag_frames=3)
    for frame in range(1, 20):
        assert pace.begin_s(frame) + pace.budget_s == pytest.approx(pace.begin_s(frame + 1 + pace.lag_frames))
    assert pace.budget_s == pytest.approx(pace.begin_s(1))  # frame 0 is over before


@given(st.integers(2, 50), st.floats(0, 0.5), st.floats(0.5, 60))
def test_the_least_lag_leaves_each_round_the_time_of_a_message(iterations, message_s, rate_hz):
    def share_s(lag):
        pace = Pace("realtime", rate_hz, 5.0, iterations, lag)
        return pace.round_deadline_s(2) - pace.round_deadline_s(1)

    lag = lag_for(iterations, message_s, rate_hz)
    assert share_s(lag) >= message_s * (1 - 1e-9) - 1e-12
    assert lag == 0 or share_s(lag - 1) < message_s


def test_in_lockstep_a_frame_has_its_deadline():
    assert Pace("lockstep", 10.0, 5.0, 12).budget_s == 5.0
