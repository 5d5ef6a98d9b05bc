"""What can be chosen about the tracker; the defaults are those of Medeiros et al. (2008), section 4."""

from typing import Annotated, Literal

from pydantic import Field, PositiveInt

from network.options import Options
from nodes.simd.options import SimdOptions
from nodes.simd.programs.binning import BinningOptions


class TrackerOptions(Options):
    """The tracker."""

    simd: SimdOptions = SimdOptions()
    binning: BinningOptions = BinningOptions()
    n_particles: tuple[Annotated[int, Field(ge=2)], ...] = Field(default=(240,), min_length=1)
    """Particles of each target; their sum must not exceed the processing elements."""
    region_px: tuple[PositiveInt, PositiveInt] = (15, 15)
    """Width and height of the region around a particle."""
    shape: Literal["rectangle", "ellipse"] = "rectangle"
    """Which pixels of it count."""
    kernel: Literal["uniform", "epanechnikov"] = "uniform"
    """Whether pixels near its border count less."""
    histogram_words: PositiveInt | None = None
    """Line memory for histograms; with fewer words than bins, the samples are read once for each part of the
    histogram and the distance adds up. By default as many as there are, at most one a bin."""
    process: tuple[float, float] = (1.0, 0.0)
    """A and B of x(t+1) = A x(t) + B x(t-1) + n (Eq. 2), the same along both axes, in sixteenths."""
    noise_px: float = Field(default=4.0, gt=0)
    """Standard deviation of n, to the nearest unit of the coordinates: with words of ten bits, a quarter of a
    pixel where the picture has up to 256."""
    sigma: float = Field(default=0.2, ge=1e-3)
    """σ of the likelihood exp(-d² / 2σ²)."""
