"""Launches a run: one process a node, one for the router; listens as anybody could; ends them all."""

import logging
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import zenoh

from network.links import sessions
from network.links.publishers import publish
from network.wire.messages import ControlMessage, EstimateMessage, StatusMessage
from sim.assembly import Assembly
from sim.faults.orders import Orders
from sim.results.recorder import Recorder, expected_tracks
from sim.results.results import Results
from sim.running.children import Children, RunFailed
from sim.running.endpoints import run_endpoints
from sim.running.hearing import Heard, Hearing, Token
from sim.running.told_truth import ToldTruth

_log = logging.getLogger(__name__)
START_LIMIT_S = 60.0
"""How long the nodes of the launcher have for getting ready."""
STUCK_DEADLINES = 4
"""When nothing at all is heard for so many deadlines, those that have not finished are given up."""
LEAD_S = 0.2
"""In real time, frame 0 begins this long after the order to start."""

Progress = Callable[[int], None]
"""Told the number of frames that are done."""


class Launch:
    """A run in processes, from the first to the last. Everything that the launcher does is in here."""

    def __init__(
        self,
        assembly: Assembly,
        recorder: Recorder,
        progress: Progress,
        by_hand: Sequence[str],
        began: float,
        *,
        audience: Callable[[], None] | None = None,
    ) -> None:
        """A run that has not begun.

        Args:
            assembly: What to run.
            recorder: Where it is recorded.
            progress: Told how far it is.
            by_hand: Nodes that somebody else starts.
            began: When the user's command began, on the monotonic clock.
            audience: Waits for those who look on, if there are any; the frames start when it is back.
        """
        self._began = began
        self._audience = audience
        self._watched = audience is not None or recorder.filming
        self.results = Results(assembly.scenario)
        self.dead: list[str] = []
        self._assembly, self._recorder, self._progress, self._by_hand = assembly, recorder, progress, by_hand
        self._nodes = {node for _, node in expected_tracks(assembly.scenario)}
        self._hearing = Hearing(
            assembly.scenario.name,
            self._nodes,
            lambda node, reason: recorder.event("refused", node, reason=reason),
        )
        self._truth = ToldTruth(assembly, self.results, recorder)
        self._absent_since: dict[str, float] = {}
        self._frames_done = 0
        self._orders = Orders(assembly.scenario.faults)
        self._killed: set[str] = set()  # by the scenario's faults, and not started again

    def run(self) -> Results:
        """Runs it all.

        Returns:
            What was found, also where nodes died on the way: their names are in `dead`.

        Raises:
            NetworkError: The router's endpoint cannot be had.
            RunFailed: A node could not start.
            RecordingError: The run cannot be recorded.
            KeyboardInterrupt: It was interrupted; every process has ended.
        """
        folder = Path(tempfile.mkdtemp(prefix="dcpf-"))
        recorded = self._recorder.folder
        # The truth is known without the processes: it is written when they have gone, however that was.
        with ExitStack() as ends, ExitStack() as stack:
            ends.callback(lambda: self._truth.record(self._frames_done))
            children = stack.enter_context(
                Children(recorded / "scenario.yaml", recorded / "logs", folder, self._by_hand)
            )
            endpoints = run_endpoints(self._assembly.scenario, folder, [])
            session = sessions.open_client(endpoints.router, timeout_s=None)
            stack.callback(sessions.close, session)
            # However it ends, nodes that somebody else has started shall know.
            stack.callback(publish, session, self._assembly.scenario.name, ControlMessage("stop"))
            self._hearing.listen(session, previews=self._recorder.filming)
            self._wait_until_ready(children)
            if self._audience is not None:
                waiting = time.monotonic()
                self._audience()
                self._began += time.monotonic() - waiting  # whose time it is not
            self._start(session)
            started = self._hearing.last_s = time.monotonic()
            for message in self._messages(children):
                self._take(message, session)
                for what, whom in self._orders.due(self._frames_done):
                    self._order(children, what, whom)
                first = isinstance(message, EstimateMessage) and message.frame == 1
                if first and "first_estimate_s" not in self.results.timing:
                    self.results.timing["first_estimate_s"] = round(time.monotonic() - self._began, 3)
            elapsed = time.monotonic() - started
            self.results.timing["frames_per_s"] = round(self._assembly.scenario.frames / elapsed, 2)
            self._truth.tell(session, self._frames_done)
        return self.results

    def _wait_until_ready(self, children: Children) -> None:
        """The start barrier: every node hears those that it has to."""
        limit = None if self._by_hand else time.monotonic() + START_LIMIT_S
        ready: set[str] = set()
        while not ready >= self._nodes:
            message = self._next()
            if isinstance(message, StatusMessage) and message.state == "ready":
                ready.add(message.node)
            for name, code in children.ended():
                raise RunFailed(
                    f"node {name} ended with code {code} before the start: {children.last_words(name)}"
                )
            if limit is not None and time.monotonic() > limit:
                missing = ", ".join(sorted(self._nodes - ready))
                raise RunFailed(f"{missing} did not get ready within {START_LIMIT_S:.0f} s: see the logs")

    def _start(self, session: zenoh.Session) -> None:
        realtime = self._assembly.scenario.pace == "realtime"
        start_time_s = time.time() + LEAD_S if realtime else None
        self._start_order = ControlMessage("start", start_time_s)
        publish(session, self._assembly.scenario.name, self._start_order)

    def _order(self, children: Children, what: str, whom: str) -> None:
        self._recorder.event(what, whom, frame=self._frames_done)
        self._absent_since.pop(whom, None)
        self._killed -= {whom}
        children.do(what, whom)

    def _messages(self, children: Children) -> Iterator[Heard | None]:
        """What the nodes tell, until all have told their last, have died, or are heard of no more."""
        working, ended = set(self._nodes), dict[str, int]()
        while working:
            message = self._next()
            yield message
            if isinstance(message, StatusMessage) and message.state in ("done", "failed"):
                # which it says more than once
                if message.state == "failed" and message.node in working:
                    self._bury(message.node, "left", "left before the end")
                working.discard(message.node)
            ended.update(children.ended())
            if self._hearing.is_behind:
                continue  # what they said before is heard first
            working -= self._settle(children, working, ended)
            for name in sorted((working - ended.keys()) & self._silent()):
                self._bury(name, "silent", "is heard of no more")
            for name in sorted((working - ended.keys() - self._silent()) & self._stuck(working)):
                self._bury(name, "stuck", "is there but tells nothing")
            working.difference_update(self.dead)

    def _settle(self, children: Children, working: set[str], ended: dict[str, int]) -> set[str]:
        """Tells of those whose processes have ended; returns who will not come back."""
        settled = set()
        for name in sorted(working & ended.keys()):
            absence = self._orders.killed(name, ended[name])
            if absence is None:
                code, last_words = ended[name], children.last_words(name)
                self._bury(name, "died", f"died (exit code {code}): {last_words}", exit_code=code)
                continue
            self._recorder.event("killed", name, frame=self._frames_done)
            self._killed.add(name)
            del ended[name]
            if absence.end is None:
                self._recorder.forget(name)
                settled.add(name)
        if not all(map(self._orders.excuses, working - settled)):
            return settled
        # the others are done: no fault's end is waited for
        for what, whom in self._orders.close():
            self._order(children, what, whom)
        return settled | self._killed

    def _stuck(self, working: set[str]) -> set[str]:
        """Nodes that are there but have told nothing since everybody was waited for: spinning, or hung."""
        limit = time.monotonic() - STUCK_DEADLINES * self._assembly.scenario.network.deadline_s
        return working if self._hearing.last_s < limit else set()

    def _silent(self) -> set[str]:
        """Nodes that have been away for longer than anybody waits for them: stopped, or dead elsewhere."""
        limit = time.monotonic() - self._assembly.scenario.network.deadline_s
        away = {name for name, since in self._absent_since.items() if since < limit}
        return {name for name in away if not self._orders.excuses(name)}

    def _bury(self, name: str, event: str, what: str, **details: int) -> None:
        self.dead.append(name)
        self._recorder.event(event, name, **details)
        self._recorder.forget(name)
        _log.error("node %s %s; the others go on", name, what)

    def _next(self) -> Heard | None:
        """The next valid message, None if there is none for a while."""
        heard = self._hearing.next()
        if not isinstance(heard, Token):
            return heard
        if heard.here:
            self._absent_since.pop(heard.node, None)
        else:
            self._absent_since[heard.node] = time.monotonic()
        self._recorder.event("seen" if heard.here else "lost", heard.node, frame=self._frames_done)
        return None

    def _take(self, message: Heard | None, session: zenoh.Session) -> None:
        if message is None:
            if self._assembly.scenario.pace == "realtime":
                self._truth.tell_one(session, self._frames_done)
            return
        self.results.add(message)
        self._recorder.add(message)
        if isinstance(message, StatusMessage) and message.state == "ready":  # the others have begun
            publish(session, self._assembly.scenario.name, self._start_order)
        if isinstance(message, EstimateMessage) and message.frame >= self._frames_done:
            self._frames_done = message.frame + 1
            self._progress(self._frames_done)
            if self._watched:
                self._truth.tell(session, self._frames_done)
