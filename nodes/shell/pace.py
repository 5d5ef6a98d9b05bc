"""When frames and their rounds begin and end: one rule for real clocks and for virtual time.

A frame has one budget, and every round a deadline in it that depends on the frame's begin alone: whoever is
late holds up the others until the round's deadline, and the frame ends in time whatever is late. Half a
frame's time may be spent on waiting for one who is late to begin with; the rest is divided among the rounds.
"""

import math
from dataclasses import dataclass
from typing import Literal

_WAIT = 0.5
"""Part of a frame's time that may be spent on waiting for one who is late to begin with."""

PaceKind = Literal["lockstep", "realtime"]


@dataclass(frozen=True, slots=True)
class Pace:
    """When frames begin and end.

    Attributes:
        kind: `lockstep`: a frame begins when the one before is done; `realtime`: at its time.
        rate_hz: Frames a second.
        deadline_s: In lockstep, how long a frame waits for messages.
        iterations: Rounds in each frame.
        lag_frames: In real time, how many frames more than one the rounds of a frame may take.
    """

    kind: PaceKind
    rate_hz: float
    deadline_s: float
    iterations: int
    lag_frames: int = 0

    @property
    def budget_s(self) -> float:
        """How long a frame's rounds may take, from its begin."""
        return self.deadline_s if self.kind == "lockstep" else (1 + self.lag_frames) / self.rate_hz

    def begin_s(self, frame: int) -> float:
        """When a frame begins in real time, from the begin of frame 0; that one is done before the others."""
        return (frame + (self.lag_frames if frame else 0)) / self.rate_hz

    def round_deadline_s(self, round_: int) -> float:
        """When a round, from 1, is done with what has come, from the frame's begin."""
        wait_s = _WAIT * self.budget_s / (1 + self.lag_frames)
        return wait_s + (self.budget_s - wait_s) * round_ / max(self.iterations, 1)


def lag_for(iterations: int, message_s: float, rate_hz: float) -> int:
    """The least lag, in frames, with which a round's share of the budget is as long as a message's way.

    Args:
        iterations: Rounds in each frame.
        message_s: How long a message is on its way, in s.
        rate_hz: Frames a second.
    """
    # (1 + lag - wait) / (rate iterations) should be the message's time at least
    return max(0, math.ceil(iterations * message_s * rate_hz - (1 - _WAIT)))
