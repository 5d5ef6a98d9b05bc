"""Which nodes are away in which frame, by a scenario's faults: the same for processes and for one thread."""

from collections.abc import Sequence
from dataclasses import dataclass

from sim.faults.options import FaultOptions, HangOptions, KillOptions, RestartOptions, SlowOptions


@dataclass(frozen=True, slots=True)
class Absence:
    """A node's time away.

    Attributes:
        node: The node.
        begin: The first frame that it misses.
        end: The frame in which it comes back, None where it never does.
        forgets: Whether it comes back as a new process, which knows nothing.
    """

    node: str
    begin: int
    end: int | None
    forgets: bool


def absences(faults: Sequence[FaultOptions]) -> tuple[Absence, ...]:
    """The times away of all nodes, in the order in which they begin."""
    found = []
    for fault in faults:
        match fault:
            case KillOptions():
                found.append(Absence(fault.node, fault.frame, None, forgets=True))
            case RestartOptions():
                found.append(Absence(fault.node, fault.frame, fault.frame + fault.frames, forgets=True))
            case HangOptions():
                found.append(Absence(fault.node, fault.frame, fault.frame + fault.frames, forgets=False))
    return tuple(sorted(found, key=lambda absence: absence.begin))


def slowness_s(faults: Sequence[FaultOptions], node: str, frame: int) -> float:
    """How much longer a node takes for a frame, s."""
    longer = [
        fault.seconds
        for fault in faults
        if isinstance(fault, SlowOptions)
        and fault.node == node
        and fault.frame <= frame
        and (fault.frames is None or frame < fault.frame + fault.frames)
    ]
    return sum(longer, 0.0)
