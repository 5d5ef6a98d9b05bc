"""Launches a run: one process a node, one for the router; listens as anybody could; ends them all."""

import logging
import queue
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import zenoh

from network import codec, keys, sessions
from network.errors import RefusedMessage
from network.messages import ControlMessage, EstimateMessage, StatusMessage, TruthMessage
from network.zenoh import publish
from sim.assembly import Assembly
from sim.running.children import Children, RunFailed
from sim.running.endpoints import run_endpoints
from sim.running.recorder import Recorder, expected_tracks
from sim.running.results import Results

_log = logging.getLogger(__name__)
START_LIMIT_S = 60.0
"""How long the nodes of the launcher have for getting ready."""
IDLE_S = 0.1
LEAD_S = 0.2
"""In real time, frame 0 begins this long after the order to start."""

Progress = Callable[[int], None]
"""Told the number of frames that are done."""


class Launch:
    """A run in processes, from the first to the last. Everything that the launcher does is in here."""

    def __init__(
        self, assembly: Assembly, recorder: Recorder, progress: Progress, by_hand: Sequence[str]
    ) -> None:
        """A run that has not begun.

        Args:
            assembly: What to run.
            recorder: Where it is recorded.
            progress: Told how far it is.
            by_hand: Nodes that somebody else starts.
        """
        self.results = Results(assembly.scenario)
        self.dead: list[str] = []
        self._assembly, self._recorder, self._progress, self._by_hand = assembly, recorder, progress, by_hand
        self._heard: queue.SimpleQueue[zenoh.Sample] = queue.SimpleQueue()
        self._nodes = {node for _, node in expected_tracks(assembly.scenario)}
        self._truth_next = 0
        self._frames_done = 0

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
        began = time.monotonic()
        folder = Path(tempfile.mkdtemp(prefix="dcpf-"))
        recorded = self._recorder.folder
        with ExitStack() as stack:
            children = stack.enter_context(
                Children(recorded / "scenario.yaml", recorded / "logs", folder, self._by_hand)
            )
            session = sessions.open_client(run_endpoints(self._assembly.scenario, folder, []).router)
            stack.callback(sessions.close, session)
            self._listen(session)
            self._wait_until_ready(children)
            self._start(session)
            started = time.monotonic()
            for message in self._messages(children):
                self._take(message, session)
                first = isinstance(message, EstimateMessage) and message.frame == 1
                if first and "first_estimate_s" not in self.results.timing:
                    self.results.timing["first_estimate_s"] = round(time.monotonic() - began, 3)
            elapsed = time.monotonic() - started
            publish(session, self._assembly.scenario.name, ControlMessage("stop"))
            self.results.timing["frames_per_s"] = round(self._assembly.scenario.frames / elapsed, 2)
            self._tell_truth(session, self._assembly.scenario.frames)
        return self.results

    def _listen(self, session: zenoh.Session) -> None:
        run = self._assembly.scenario.name
        hear = zenoh.handlers.Callback(self._heard.put, indirect=False)
        session.declare_subscriber(keys.estimate(run), hear)
        session.declare_subscriber(keys.status(run), hear)
        session.liveliness().declare_subscriber(keys.alive(run), hear, history=True)

    def _wait_until_ready(self, children: Children) -> None:
        """The start barrier: every node hears those that it has to."""
        limit = None if self._by_hand else time.monotonic() + START_LIMIT_S
        ready: set[str] = set()
        while ready < self._nodes:
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
        publish(session, self._assembly.scenario.name, ControlMessage("start", start_time_s))

    def _messages(self, children: Children) -> Iterator[EstimateMessage | StatusMessage | None]:
        """What the nodes tell, until all have told their last or have died."""
        working = set(self._nodes)
        while working:
            message = self._next()
            yield message
            if isinstance(message, StatusMessage) and message.state in ("done", "failed"):
                working.discard(message.node)
            for name, code in children.ended():
                if name in working and not self._heard.qsize():
                    working.discard(name)
                    self._bury(name, code)

    def _bury(self, name: str, code: int) -> None:
        self.dead.append(name)
        self._recorder.event("died", name, exit_code=code)
        self._recorder.forget(name)
        _log.error("node %s died (exit code %d); the others go on", name, code)

    def _next(self) -> EstimateMessage | StatusMessage | None:
        """The next valid message, None if there is none for a while."""
        try:
            sample = self._heard.get(timeout=IDLE_S)
        except queue.Empty:
            return None
        key, data = str(sample.key_expr), sample.payload.to_bytes()
        if key.endswith("/alive"):
            seen = sample.kind == zenoh.SampleKind.PUT
            self._recorder.event("seen" if seen else "lost", keys.node_of(key), frame=self._frames_done)
            return None
        try:
            if key.endswith("/estimate"):
                return codec.decode_public(EstimateMessage, data)
            return codec.decode_public(StatusMessage, data)
        except RefusedMessage as refusal:
            self._recorder.event("refused", keys.node_of(key), reason=refusal.reason)
            return None

    def _take(self, message: EstimateMessage | StatusMessage | None, session: zenoh.Session) -> None:
        if message is None:
            self._tell_truth(session, min(self._truth_next + 1, self._frames_done))
            return
        self.results.add(message)
        self._recorder.add(message)
        if isinstance(message, EstimateMessage) and message.frame >= self._frames_done:
            self._frames_done = message.frame + 1
            self._progress(self._frames_done)

    def _tell_truth(self, session: zenoh.Session, until: int) -> None:
        """Publishes and records the truth of frames that are done; when there is time, it takes some."""
        while self._truth_next < until:
            message: TruthMessage | None = self._assembly.truth_message(self._truth_next)
            self._truth_next += 1
            if message is not None:
                publish(session, self._assembly.scenario.name, message)
                self.results.add(message)
                self._recorder.add(message)
