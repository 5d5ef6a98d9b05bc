"""A subscriber from the outside, as anybody could write one: estimates of runs that come and go."""

import logging
import queue
import threading
import time
from collections.abc import Iterator

import zenoh

from network.errors import NetworkError, RefusedMessage
from network.links import sessions
from network.wire import codec
from network.wire.messages import EstimateMessage

REFRESH_S = 0.1

_log = logging.getLogger(__name__)


def estimates(key: str, endpoint: str) -> Iterator[EstimateMessage | None]:
    """Estimates as they come, for ever; None about ten times a second, for whoever shows them.

    Args:
        key: Key expression.
        endpoint: Of a run's router; until one is there, and after it has gone, it is tried again.

    Raises:
        NetworkError: The key expression or the endpoint is malformed.
    """
    heard: queue.SimpleQueue[zenoh.Sample | NetworkError] = queue.SimpleQueue()
    # The session opens when a router is there: elsewhere, so that Ctrl-C is heard meanwhile.
    threading.Thread(target=_listen, args=[key, endpoint, heard], name="listener", daemon=True).start()
    pause_at = 0.0
    while True:
        if time.monotonic() >= pause_at:
            pause_at = time.monotonic() + REFRESH_S
            yield None
        try:
            sample = heard.get(timeout=REFRESH_S)
        except queue.Empty:
            continue
        if isinstance(sample, NetworkError):
            raise sample
        try:
            yield codec.decode_public(EstimateMessage, sample.payload.to_bytes())
        except RefusedMessage as refusal:
            _log.warning("refused a message on %s: %s", sample.key_expr, refusal.reason)


def _listen(key: str, endpoint: str, heard: queue.SimpleQueue[zenoh.Sample | NetworkError]) -> None:
    try:
        expression = zenoh.KeyExpr.autocanonize(key)
    except zenoh.ZError:
        heard.put(NetworkError(f"{key} is no key expression: write it like dcpf/*/*/estimate"))
        return
    try:
        session = sessions.open_client(endpoint, timeout_s=None)
    except NetworkError as error:
        heard.put(error)
        return
    session.declare_subscriber(expression, zenoh.handlers.Callback(heard.put))
    threading.Event().wait()  # for ever: a session that nobody holds is closed
