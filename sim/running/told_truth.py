"""The truth of a run in processes: told to who looks on, and recorded, for the frames that are done."""

import zenoh

from network.links.publishers import publish
from sim.assembly import Assembly
from sim.results.recorder import Recorder
from sim.results.results import Results


class ToldTruth:
    """How far the truth has been told."""

    def __init__(self, assembly: Assembly, results: Results, recorder: Recorder) -> None:
        """Nothing is told yet.

        Args:
            assembly: The run.
            results: What is found in it.
            recorder: Where it is recorded.
        """
        self._assembly, self._results, self._recorder = assembly, results, recorder
        self._next = 0

    def tell(self, session: zenoh.Session, until: int) -> None:
        """Publishes and records the truth of frames that are done.

        Working out what each camera sees takes some time: in real time it is done when nothing else is, in
        lockstep, where every processor is busy to the end, after the frames, unless somebody looks on.
        """
        while self._next < until:
            message = self._assembly.truth_message(self._next)
            self._next += 1
            if message is not None:
                publish(session, self._assembly.scenario.name, message)
                self._results.add(message)
                self._recorder.add(message)

    def tell_one(self, session: zenoh.Session, until: int) -> None:
        """The same for one frame at most."""
        self.tell(session, min(self._next + 1, until))

    def record(self, until: int) -> None:
        """Records frames that are done and not told: those of an interrupted run, in short."""
        for frame in range(self._next, until):
            message = self._assembly.truth_message(frame, with_visibility=False)
            if message is not None:
                self._results.add(message)
                self._recorder.add(message)
