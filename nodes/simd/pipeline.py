"""The frame pipeline: odd lines are binned and stored, in the even ones the picture before is worked on.

Source: Medeiros et al. (2008), sections 3.5 and 4. Does a program hold the frame rate, and how much of each
line interval is used? The estimate of a picture is ready one frame after it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

from nodes.simd.cost import Cost

FRAME_INTERVAL_US = 1e6 / 30
"""A frame of the VGA sensor."""
LINE_INTERVAL_US = 69.5
"""A line of it, as the paper has it."""
VGA_LINES = 480
"""Half of them, the odd ones, bring a line of the picture to store."""
ELEMENTS_PER_LINE = 640
"""What can be moved to or from the external memory in a line interval."""


@dataclass(frozen=True, slots=True)
class Pipeline:
    """How a frame fits into the line intervals.

    Attributes:
        odd_line_us: The array's work in an odd line interval, binning one line.
        even_line_us: Its work in an even one that brings samples: the histograms' update.
        even_lines: Even line intervals that bring samples.
        elements: Elements that such an interval moves.
        rest_us: The work after the last sample.
        rest_lines: Even line intervals that this takes.
        lines: Lines of the picture.
        busy_us: The array's work in a frame.
    """

    odd_line_us: float
    even_line_us: float
    even_lines: int
    elements: int
    rest_us: float
    rest_lines: int
    lines: int
    busy_us: float

    @property
    def holds(self) -> bool:
        """Whether the program holds 30 frames/s."""
        return (
            self.odd_line_us <= LINE_INTERVAL_US
            and self.even_line_us <= LINE_INTERVAL_US
            and max(self.lines, self.even_lines + self.rest_lines) <= VGA_LINES // 2
        )

    @property
    def share_of_frame(self) -> float:
        """The part of a frame interval for which the array is busy."""
        return self.busy_us / FRAME_INTERVAL_US


def pipeline(
    costs: Mapping[str, Cost], storing: str, sampling: str, n_active: int, lines: int, clock_mhz: float
) -> Pipeline:
    """Lays a frame's counted work out over the line intervals.

    One sample of each active element comes in a line interval, unless that would take more even lines than
    there are: then as many as the external memory can give.

    Args:
        costs: Of a frame, by step.
        storing: The step of the odd lines.
        sampling: The step that reads samples from the external memory.
        n_active: Elements that ask for samples.
        lines: Lines of the picture.
        clock_mhz: Of the array.
    """
    microseconds = {name: cost.microseconds(clock_mhz) for name, cost in costs.items()}
    rest_us = sum(us for name, us in microseconds.items() if name not in {storing, sampling})
    rest_lines = ceil(rest_us / LINE_INTERVAL_US)
    samples = ceil(costs[sampling].external_reads / n_active)
    free_lines = max(VGA_LINES // 2 - rest_lines, 1)
    most = max(ELEMENTS_PER_LINE / n_active, 1e-9)
    per_line = min(max(samples / free_lines, 1.0), most)
    even_lines = ceil(samples / per_line)
    return Pipeline(
        odd_line_us=microseconds[storing] / lines,
        even_line_us=microseconds[sampling] / even_lines,
        even_lines=even_lines,
        elements=ceil(per_line * n_active),
        rest_us=rest_us,
        rest_lines=rest_lines,
        lines=lines,
        busy_us=sum(microseconds.values()),
    )
