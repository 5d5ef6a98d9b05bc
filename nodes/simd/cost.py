"""What programs cost: counted instructions, and the one table of cycles that turns them into time."""

from collections import Counter
from dataclasses import dataclass, field
from types import MappingProxyType

CYCLES = MappingProxyType({"load": 1, "operate": 1, "multiply": 1, "store": 1, "readout": 1})
"""Cycles of each class of instruction; the README argues them from the architecture.

`load`: a word of the own line memory, of a neighbour's or an immediate one to the accumulator; `operate`: the
arithmetic unit on accumulator and operand; `multiply`: its multiplier; `store`: the accumulator, under a flag
or not, to the line memory; `readout`: one element of a line past the global control processor, for which the
array waits. The control processor's loops and the digital input and output processors run beside the array.
"""


@dataclass(slots=True)
class Cost:
    """What was counted.

    Attributes:
        instructions: Of the array, by class.
        external_reads: Elements read from the external memory.
        external_writes: Elements written to it.
    """

    instructions: Counter[str] = field(default_factory=Counter)
    external_reads: int = 0
    external_writes: int = 0

    @property
    def cycles(self) -> int:
        """Cycles for which the array is busy."""
        return sum(CYCLES[kind] * n for kind, n in self.instructions.items())

    def microseconds(self, clock_mhz: float) -> float:
        """The time of these cycles."""
        return self.cycles / clock_mhz

    def add(self, other: "Cost", times: int = 1) -> None:
        """Adds what was counted elsewhere, a number of times."""
        for kind, n in other.instructions.items():
            self.instructions[kind] += times * n
        self.external_reads += times * other.external_reads
        self.external_writes += times * other.external_writes
