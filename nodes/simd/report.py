"""What a frame of the tracker costs, beside the figures of Medeiros et al. (2008), Tables 1 and 2."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from nodes.simd.array import ProcessorArray
from nodes.simd.cost import Cost
from nodes.simd.pipeline import Pipeline, pipeline


class Step:
    """The steps of a frame, as Table 1 names them."""

    BINNING = "Conversion to HSV"
    HISTOGRAMS = "Histogram computation"
    PREDICTION = "Particle prediction"
    DISTANCES = "Bhattacharyya distances"
    LIKELIHOODS = "Likelihoods"
    NORMALIZATION = "Weight normalization"
    MEAN = "Weighted average of the particles"
    RESAMPLING = "Resampling"


PAPER_US: Mapping[str, float] = MappingProxyType(
    {
        Step.BINNING: 256 * 12.4,
        Step.HISTOGRAMS: 225 * 2.4,
        Step.PREDICTION: 7.2,
        Step.DISTANCES: 79.6,
        Step.LIKELIHOODS: 3.6,
        Step.NORMALIZATION: 31.9,
        Step.MEAN: 2 * 40.9,
        Step.RESAMPLING: 102.0,
    }
)
"""Table 1 in microseconds."""
PAPER_TOTAL_US = 4000.0
"""Its last row."""
PAPER_WORDS: Mapping[str, int] = MappingProxyType(
    {
        "Target state (current and previous)": 4,
        "Particle weights": 1,
        "Histograms": 40,
        "Video line buffers": 3,
        "Temporary variables": 14,
    }
)
"""Table 2."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameReport:
    """The cost of a frame.

    Attributes:
        costs: What was counted, by step.
        clock_mhz: The array's clock.
        words: Words of line memory by what they are for, when most were in use.
        pipeline: How the frame fits into the line intervals.
    """

    costs: Mapping[str, Cost]
    clock_mhz: float
    words: Mapping[str, int]
    pipeline: Pipeline

    @classmethod
    def of(cls, array: ProcessorArray, lines: int, n_active: int) -> "FrameReport":
        """The report of what an array has counted in one frame."""
        clock_mhz = array.options.clock_mhz
        laid_out = pipeline(array.costs, Step.BINNING, Step.HISTOGRAMS, n_active, lines, clock_mhz)
        return cls(dict(array.costs), clock_mhz, array.line_memory.table, laid_out)

    @property
    def microseconds(self) -> dict[str, float]:
        """The time of each step."""
        return {name: cost.microseconds(self.clock_mhz) for name, cost in self.costs.items()}

    @property
    def total_us(self) -> float:
        """The array's time in a frame."""
        return sum(self.microseconds.values())

    @property
    def cycles(self) -> int:
        """The array's cycles in a frame."""
        return sum(cost.cycles for cost in self.costs.values())

    @property
    def figures(self) -> dict[str, int | float]:
        """The cost in a few numbers, for a node's status."""
        return {
            "cycles": self.cycles,
            "clock_mhz": self.clock_mhz,
            "frame_us": round(self.total_us, 1),
            "share_of_frame": round(self.pipeline.share_of_frame, 4),
            "line_memory_words": self.n_words,
            "rate_hz": round(self.pipeline.rate_hz, 2),
        }

    @property
    def n_words(self) -> int:
        """The most words of line memory in use at once."""
        return sum(self.words.values())
