"""What the launcher of a run orders on account of its faults, and whom it takes for dead no sooner."""

import signal
from collections.abc import Sequence

from sim.faults.options import FaultOptions, RestartRouterOptions
from sim.faults.schedule import Absence, absences

Order = tuple[str, str]
"""What to do, and to whom: `wake` or `start` a node, `restart` the `router`."""


class Orders:
    """The faults of a run that are not over yet."""

    def __init__(self, faults: Sequence[FaultOptions]) -> None:
        """All faults of a scenario, before its first frame."""
        self._away = list(absences(faults))
        self._ended: set[str] = set()
        self._routers = [fault.frame for fault in faults if isinstance(fault, RestartRouterOptions)]

    def excuses(self, node: str) -> bool:
        """Whether a node's silence is no surprise: one of its faults is not over."""
        return any(absence.node == node for absence in self._away)

    def killed(self, node: str, code: int) -> Absence | None:
        """The fault by which a node's process has ended, None where it ended otherwise.

        Args:
            node: The node.
            code: The exit code of its process.
        """
        if code != -signal.SIGKILL:
            return None
        found = next((each for each in self._away if each.node == node and each.forgets), None)
        if found is not None and found.end is None:
            self._away.remove(found)
        elif found is not None:
            self._ended.add(node)
        return found

    def due(self, frames_done: int) -> list[Order]:
        """What is to be done by now; each order is given once.

        Args:
            frames_done: Frames that somebody has done.
        """
        orders = [("restart", "router") for frame in self._routers if frame < frames_done]
        self._routers = [frame for frame in self._routers if frame >= frames_done]
        for absence in list(self._away):
            if absence.end is None or absence.end > frames_done:
                continue
            if not absence.forgets:
                orders.append(("wake", absence.node))
            elif absence.node in self._ended:
                self._ended.discard(absence.node)
                orders.append(("start", absence.node))
            else:
                continue  # it has not ended yet
            self._away.remove(absence)
        return orders

    def close(self) -> list[Order]:
        """The others are done: who is stopped goes on, who is not there is not started any more."""
        orders = [("wake", absence.node) for absence in self._away if not absence.forgets]
        self._away.clear()
        return orders
