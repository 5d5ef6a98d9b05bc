"""What a node has timed and counted, as the status that it tells everybody."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from network.links.transport import Traffic
from network.wire.messages import StatusMessage

State = Literal["ready", "running", "done", "failed"]
Counters = Mapping[str, int | Mapping[str, int | float]]
"""What a node has counted, by name; groups by name and reason."""


@dataclass(slots=True)
class Telemetry:
    """The durations of a node's steps, in seconds, and what it has counted.

    Attributes:
        local_filter_s: Each frame's work from the picture to the first message.
        consensus_round_s: Each frame's mean duration of a round.
        late: Frames whose rounds were cut, or that were left out, for want of time.
    """

    local_filter_s: list[float] = field(default_factory=list)
    consensus_round_s: list[float] = field(default_factory=list)
    late: int = 0

    def status(
        self, node: str, state: State, frame: int, traffic: Traffic, counters: Counters
    ) -> StatusMessage:
        """The status after a frame.

        Args:
            node: The node.
            state: Where it is in its life.
            frame: The last frame that it has finished.
            traffic: What it has sent and refused.
            counters: What the node itself has counted.
        """
        timing = {
            "local_filter_ms": _percentiles_ms(self.local_filter_s),
            "consensus_round_ms": _percentiles_ms(self.consensus_round_s),
        }
        return StatusMessage(
            node=node,
            state=state,
            frame=frame,
            counters={
                "late": self.late,
                **{name: dict(n) if isinstance(n, Mapping) else n for name, n in counters.items()},
                "messages": dict(traffic.messages),
                "bytes": dict(traffic.bytes),
                "refused": dict(traffic.refused),
                "sent": dict(traffic.sent),
                "received": dict(traffic.received),
            },
            timing={name: value for name, value in timing.items() if value},
        )


def _percentiles_ms(durations_s: Sequence[float]) -> dict[str, int | float]:
    if not durations_s:
        return {}
    p50, p99 = np.percentile(durations_s, [50, 99])
    return {"p50": round(1e3 * float(p50), 3), "p99": round(1e3 * float(p99), 3)}
