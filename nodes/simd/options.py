"""What can be chosen about the processor; the defaults are the IC3D's (Medeiros et al. 2008, section 4)."""

from typing import Literal

from pydantic import Field, PositiveInt

from network.options import Options


class SimdOptions(Options):
    """A linear processor array and how it computes."""

    processing_elements: PositiveInt = 320
    """P, the processing elements in lockstep."""
    words: PositiveInt = 64
    """Words of line memory that each element has."""
    bits: int = Field(default=10, ge=8, le=12)
    """Bits of a word."""
    clock_mhz: float = Field(default=80.0, gt=0)
    """Clock of the array."""
    arithmetic: Literal["float", "fixed10", "fixed20"] = "fixed10"
    """How weights and distances are held: in one word (`fixed10`), in two (`fixed20`), or as real numbers,
    which the chip could not (`float`)."""
    resampling: Literal["simplified", "residual", "systematic"] = "simplified"
    """`simplified`: the best particle takes all that rounding leaves (Medeiros et al., section 4);
    `residual`: the rest is drawn (Liu & Chen); `systematic`: one draw in each of M strata."""

    @property
    def number_words(self) -> int:
        """Words of a weight or a distance."""
        return 2 if self.arithmetic == "fixed20" else 1

    @property
    def number_bits(self) -> int:
        """Bits of a weight or a distance."""
        return self.bits * self.number_words
