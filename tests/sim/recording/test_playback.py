"""The clock of a playback: any order of play, pause, seek and speed, against a sum by hand."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.replay.playback import Playback

steps = st.lists(
    st.tuples(st.sampled_from(["play", "pause", "wait", "slow", "fast"]), st.integers(0, 40)), max_size=15
)


def test_it_waits_for_the_order_to_play():
    playback = Playback(frames=10, rate_hz=5.0)
    assert playback.frame(100.0) == 0
    playing = playback.play(100.0)
    assert [playing.frame(100.0 + dt) for dt in (0.0, 0.19, 0.21, 1.01, 1.81, 9.0)] == [0, 0, 1, 5, 9, 9]
    assert not playing.ended(101.9)
    assert playing.ended(102.0)


@given(steps, st.booleans())
def test_positions_are_the_sum_of_all_that_was_played(steps, loop):
    # eighths of a second, which floats hold exactly
    playback, now, position, speed, paused = Playback(20, 8.0, loop=loop), 0.0, 0.0, 1.0, True
    for what, eighths in steps:
        now += eighths / 8
        position += 0 if paused else eighths * speed
        position = position % 20 if loop else min(position, 20.0)
        if what == "play":
            position = 0.0 if not loop and position >= 20 else position
            playback, paused = playback.play(now), False
        elif what == "pause":
            playback, paused = playback.pause(now), True
        elif what in ("slow", "fast"):
            speed = {"slow": 0.5, "fast": 4.0}[what]
            playback = playback.at_speed(speed, now)
        assert playback.position(now) == position
        assert 0 <= playback.frame(now) < 20


@given(st.integers(-5, 30), st.booleans())
def test_seeking_goes_to_the_nearest_frame_and_keeps_going(frame, playing):
    playback = Playback(20, 10.0)
    playback = playback.play(0.0) if playing else playback
    found = playback.seek(frame, 1.0)
    expected = min(max(frame, 0), 19)
    assert found.frame(1.0) == expected
    assert found.frame(1.31) == (min(expected + 3, 19) if playing else expected)


def test_at_the_end_it_plays_from_the_beginning():
    ended = Playback(20, 10.0).play(0.0)
    assert ended.ended(5.0)
    assert ended.play(5.0).frame(5.15) == 1
    assert ended.seek(3, 5.0).frame(9.0) == 3


@pytest.mark.parametrize("speed", [0.0, -1.0, 1001.0, float("inf"), float("nan")])
def test_speeds_are_positive(speed):
    with pytest.raises(ValueError, match="above 0"):
        Playback(20, 10.0).at_speed(speed, 0.0)
