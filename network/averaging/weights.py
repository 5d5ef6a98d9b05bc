"""The averaging algorithms that a scenario can choose in ``network.consensus``."""

from typing import Annotated

from pydantic import Field

from network.averaging.best_constant import BestConstant
from network.averaging.chebyshev import Chebyshev
from network.averaging.constant import ConstantWeights
from network.averaging.event_triggered import EventTriggered
from network.averaging.finite_time import FiniteTime
from network.averaging.metropolis import MetropolisWeights
from network.averaging.ratio import Ratio

ConsensusOptions = Annotated[
    ConstantWeights | MetropolisWeights | BestConstant | Chebyshev | FiniteTime | Ratio | EventTriggered,
    Field(discriminator="algorithm"),
]
"""The choice of the algorithm in a scenario."""
