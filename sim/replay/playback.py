"""Where a recording's playback stands: a clock that can be stopped, turned faster and set anew.

Pure: the time is an argument, seconds of any clock that does not go back.
"""

from dataclasses import dataclass, replace

MAX_SPEED = 1000.0
"""Times the run's own time: as fast as it goes, with any recording."""


@dataclass(frozen=True, slots=True)
class Playback:
    """A playback at one moment.

    Attributes:
        frames: Frames of the recording, at least 1.
        rate_hz: Frames a second at speed 1.
        loop: Whether it begins again at its end.
        speed: How many times faster than the run's own time.
        paused: Whether it stands.
        anchor: The frame, and part of it, where it stood at `anchor_s`.
        anchor_s: When that was.
    """

    frames: int
    rate_hz: float
    loop: bool = False
    speed: float = 1.0
    paused: bool = True
    anchor: float = 0.0
    anchor_s: float = 0.0

    def position(self, now_s: float) -> float:
        """Frames played, up to the number of frames where it does not loop."""
        gone = 0.0 if self.paused else (now_s - self.anchor_s) * self.rate_hz * self.speed
        position = self.anchor + gone
        return position % self.frames if self.loop else min(position, float(self.frames))

    def frame(self, now_s: float) -> int:
        """The frame that is shown."""
        return min(int(self.position(now_s)), self.frames - 1)

    def ended(self, now_s: float) -> bool:
        """Whether the last frame has had its time."""
        return not self.loop and self.position(now_s) >= self.frames

    def play(self, now_s: float) -> "Playback":
        """Goes on; from the beginning where the end was reached."""
        start = 0.0 if self.ended(now_s) else self.position(now_s)
        return replace(self, paused=False, anchor=start, anchor_s=now_s)

    def pause(self, now_s: float) -> "Playback":
        """Stands still."""
        return replace(self, paused=True, anchor=self.position(now_s), anchor_s=now_s)

    def at_speed(self, speed: float, now_s: float) -> "Playback":
        """Goes on, or will, so many times faster than the run's own time.

        Raises:
            ValueError: The speed is not above 0, or above `MAX_SPEED`.
        """
        if not 0 < speed <= MAX_SPEED:
            raise ValueError(f"a speed of {speed}: it has to be above 0, at most {MAX_SPEED:g}")
        return replace(self, speed=speed, anchor=self.position(now_s), anchor_s=now_s)

    def seek(self, frame: int, now_s: float) -> "Playback":
        """Goes to another frame, the nearest that there is; where the end was reached, it stands there."""
        anchor = float(min(max(frame, 0), self.frames - 1))
        return replace(self, paused=self.paused or self.ended(now_s), anchor=anchor, anchor_s=now_s)
