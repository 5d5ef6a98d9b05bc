"""The page's ear: everything of one run that is told over Zenoh, and pictures only while somebody looks."""

import threading
from collections.abc import Callable

import zenoh

from network.links import sessions
from network.wire import keys

LEAVE_S = 6.0
"""A session has five seconds to close."""

Hear = Callable[[str, bytes, bool], None]
"""Told a key, the payload, and whether it is there (a token may be gone)."""


class Feed:
    """A subscriber from the outside.

    Attributes:
        listening: Set when everything that is told is heard.
    """

    def __init__(self, endpoint: str, run: str, hear: Hear) -> None:
        """Connects when a router is there, and again when it has gone and come back.

        Args:
            endpoint: Of the router.
            run: Name of the run.
            hear: Called from Zenoh's threads.
        """
        self._endpoint, self._run, self._hear = endpoint, run, hear
        self.listening = threading.Event()
        self._wanted, self._closed = False, threading.Event()
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._listen, name="feed", daemon=True)
        self._thread.start()

    def look(self, *, wanted: bool) -> None:
        """Asks for pictures, or does without."""
        with self._changed:
            self._wanted = wanted
            self._changed.notify()

    def close(self) -> None:
        """Leaves, at once if no router has been found yet."""
        with self._changed:
            self._closed.set()
            self._changed.notify()
        if self.listening.is_set():
            self._thread.join(LEAVE_S)

    def _listen(self) -> None:
        """Everything of the session, in one thread: Zenoh wants it so."""
        session = sessions.open_client(self._endpoint, timeout_s=None)
        hear = zenoh.handlers.Callback(self._on_sample)
        for key in (keys.estimate(self._run), keys.status(self._run), keys.truth(self._run)):
            session.declare_subscriber(key, hear)
        session.liveliness().declare_subscriber(keys.alive(self._run), hear, history=True)
        self.listening.set()
        looking = None
        while not self._closed.is_set():
            if self._wanted and looking is None:
                looking = session.declare_subscriber(keys.preview(self._run), hear)
            elif not self._wanted and looking is not None:
                looking.undeclare()  # type: ignore[no-untyped-call]  # zenoh's stub has none here
                looking = None
            with self._changed:
                while not self._closed.is_set() and self._wanted == (looking is not None):
                    self._changed.wait()
        sessions.close(session)

    def _on_sample(self, sample: zenoh.Sample) -> None:
        here = sample.kind == zenoh.SampleKind.PUT
        self._hear(str(sample.key_expr), sample.payload.to_bytes(), here)
