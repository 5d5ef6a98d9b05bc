"""Faults that a node's process does to itself at the begin of a frame, when it would take its picture.

A source of pictures is where a frame begins: the node itself need not know that it can fail.
"""

import os
import signal
import time
from collections.abc import Sequence

import numpy as np
from jaxtyping import UInt8

from nodes.imaging.sources import FrameSource
from sim.faults.options import FaultOptions
from sim.faults.schedule import absences, slowness_s


class FailingProcess:
    """The pictures of a camera whose process fails on the way."""

    def __init__(self, source: FrameSource, node: str, faults: Sequence[FaultOptions]) -> None:
        """A process that has not failed yet.

        Args:
            source: The camera's pictures.
            node: Its name.
            faults: Those of the scenario.
        """
        self._source, self._node, self._faults = source, node, faults
        self._signals = {
            absence.begin: signal.SIGKILL if absence.forgets else signal.SIGSTOP
            for absence in absences(faults)
            if absence.node == node
        }

    def read(self, index: int) -> UInt8[np.ndarray, "H W 3"]:
        """The picture of a frame, BGR; whoever is killed here never returns."""
        if index in self._signals:
            os.kill(os.getpid(), self._signals[index])
        time.sleep(slowness_s(self._faults, self._node, index))
        return self._source.read(index)

    def close(self) -> None:
        """Closes what it reads from."""
        self._source.close()
