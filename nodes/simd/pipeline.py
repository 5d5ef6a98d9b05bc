"""The frame pipeline: in odd line intervals a picture is stored, in even ones the one before is worked on.

Source: Medeiros et al. (2008), sections 3.5 and 4. Does a program hold the frame rate, and how much of each
line interval is used? The estimate of a picture is ready one frame after it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

from nodes.simd.cost import Cost

SENSOR_HZ = 30.0
"""Frames a second of the VGA sensor."""
LINE_INTERVAL_US = 69.5
"""A line of it, as the paper has it."""
VGA_LINES = 480
"""Line intervals of a frame, in which something can be moved and computed."""
ELEMENTS_PER_LINE = 640
"""What can be moved to or from the external memory in one."""


@dataclass(frozen=True, slots=True)
class Pipeline:
    """How a frame fits into the line intervals.

    Attributes:
        storing_lines: Line intervals in which the picture is binned and stored.
        storing_us: The array's work in such an interval.
        reading_lines: Line intervals in which samples are read and counted.
        reading_us: The array's work in such an interval.
        elements: What such an interval reads.
        rest_lines: Line intervals for everything else, after the last sample.
        rest_us: The array's work in all of them.
    """

    storing_lines: int
    storing_us: float
    reading_lines: int
    reading_us: float
    elements: int
    rest_lines: int
    rest_us: float

    @property
    def lines(self) -> int:
        """Line intervals that a frame takes."""
        return self.storing_lines + self.reading_lines + self.rest_lines

    @property
    def rate_hz(self) -> float:
        """Frames a second that the program holds, the sensor's at most."""
        busiest = max(self.storing_us, self.reading_us) / LINE_INTERVAL_US
        return SENSOR_HZ * min(VGA_LINES / self.lines, 1.0) / max(busiest, 1.0)

    @property
    def holds(self) -> bool:
        """Whether it holds the sensor's 30 frames/s."""
        return self.rate_hz >= SENSOR_HZ

    @property
    def busy_us(self) -> float:
        """The array's work in a frame."""
        return self.storing_lines * self.storing_us + self.reading_lines * self.reading_us + self.rest_us

    @property
    def share_of_frame(self) -> float:
        """The part of a frame interval in which the array is busy."""
        return self.busy_us * 1e-6 * SENSOR_HZ


def pipeline(
    costs: Mapping[str, Cost], storing: str, reading: str, n_active: int, lines: int, clock_mhz: float
) -> Pipeline:
    """Lays a frame's counted work out over the line intervals.

    A line interval reads one sample of each active element, as the paper's program does; more, up to what the
    external memory can give, only where that would not hold the frame rate.

    Args:
        costs: Of a frame, by step.
        storing: The step that bins and stores.
        reading: The step that reads samples and counts.
        n_active: Elements that ask for samples at once.
        lines: Lines of the picture.
        clock_mhz: Of the array.
    """
    microseconds = {name: cost.microseconds(clock_mhz) for name, cost in costs.items()}
    storing_lines = max(lines, ceil(costs[storing].external_writes / ELEMENTS_PER_LINE))
    rest_us = sum(us for name, us in microseconds.items() if name not in {storing, reading})
    rest_lines = ceil(rest_us / LINE_INTERVAL_US)
    reads = costs[reading].external_reads
    free_lines = max(VGA_LINES - storing_lines - rest_lines, 1)
    elements = min(max(n_active, ceil(reads / free_lines)), ELEMENTS_PER_LINE)
    reading_lines = ceil(reads / elements)
    return Pipeline(
        storing_lines=storing_lines,
        storing_us=microseconds[storing] / storing_lines,
        reading_lines=reading_lines,
        reading_us=microseconds[reading] / reading_lines,
        elements=elements,
        rest_lines=rest_lines,
        rest_us=rest_us,
    )
