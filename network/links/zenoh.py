"""A node's transport over Eclipse Zenoh: what it hears, who is there, and how it waits.

``receive`` waits in Zenoh's own channels, which is faster than callbacks but knows no time-out. What ends the
wait is an empty message that the node puts into the channel itself: the watchdog when time is up, liveliness
when the sender is gone. Whoever receives it looks again whether there is anything left to wait for.
"""

import contextlib
import queue
import threading
import time
from collections.abc import Iterable, Sequence

import zenoh
from zenoh import Locality

from network.errors import RefusedMessage
from network.links import sessions
from network.links.answers import Answers
from network.links.publishers import declare_publishers
from network.links.transport import Links, LostMessage, Traffic
from network.wire import codec, keys
from network.wire.messages import (
    ConfirmMessage,
    ConsensusMessage,
    ControlMessage,
    EstimateMessage,
    PeerMessage,
    PixelsMessage,
    PreviewMessage,
    StateMessage,
    StatusMessage,
)

_DEPTHS: dict[type[PeerMessage], int] = {ConsensusMessage: 64, ConfirmMessage: 64, PixelsMessage: 4}
_KEYS = {ConsensusMessage: keys.consensus, ConfirmMessage: keys.confirm, PixelsMessage: keys.pixels}
_WATCH_PERIOD_S = 0.01
_WATCH_CLOSELY_S = 0.002
"""The watchdog's period while somebody waits whose time is nearly up."""
_WAKE_UP = b""

_Inbox = zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]]


class ZenohTransport:
    """A node's way to the others over Zenoh (see ``network.links.transport.Transport``).

    Attributes:
        counters: What it has sent and refused.
    """

    def __init__(
        self,
        run: str,
        name: str,
        links: Links,
        listen: Sequence[str],
        connect: Sequence[str],
        *,
        drop_late_pixels: bool,
    ) -> None:
        """Opens the session and declares everything but the node's token.

        Args:
            run: Name of the run.
            name: The node.
            links: The nodes that it is linked to.
            listen: Endpoints where they find it.
            connect: Endpoints of the router and of those that it has to find.
            drop_late_pixels: Whether pictures that do not get through in time are dropped (real time) or
                waited for (lockstep).

        Raises:
            NetworkError: An endpoint is malformed, or one to listen on cannot be had.
        """
        self.counters = Traffic()
        self._run, self._name, self._links = run, name, links
        self._heard = links.heard()
        self._inbox_keys = {sender: _KEYS[kind](run, sender) for sender, kind in self._heard.items()}
        self._token_key = keys.alive(run, name)
        self._alive: set[str] = set()
        self._receivers: dict[type, tuple[str, ...]] = dict.fromkeys(links.receivers(), ())  # that are alive
        self._alive_changed = threading.Condition()
        self._orders: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._wait: tuple[str, float] | None = None
        self._closed = threading.Event()
        self._session = sessions.open_peer(listen, connect)
        self._inboxes = {sender: self._declare_inbox(sender) for sender in self._heard}
        self._declare_orders()
        self._watched = threading.Event()
        self._publishers = declare_publishers(self._session, run, name, drop_late_pixels=drop_late_pixels)
        self._publishers[PreviewMessage].declare_matching_listener(zenoh.handlers.Callback(self._on_watched))
        self._declare_liveliness()
        threading.Thread(target=self._watch, name="watchdog", daemon=True).start()

    def announce(self) -> None:
        """Tells everybody that this node hears: from here on messages to it arrive."""
        self._token = self._session.liveliness().declare_token(self._token_key)

    def alive(self, name: str) -> bool:
        """Whether a node has announced itself and is there."""
        return name in self._alive

    def wait_until_alive(self, names: Iterable[str], timeout_s: float) -> tuple[str, ...]:
        """Waits until nodes are alive; returns those that are still missing when time is up."""
        names = tuple(names)
        with self._alive_changed:
            self._alive_changed.wait_for(lambda: self._alive.issuperset(names), timeout_s)
            return tuple(name for name in names if name not in self._alive)

    def wait_for_control(self, timeout_s: float) -> ControlMessage | None:
        """The next order to this run, None when time is up; 0 only looks."""
        deadline = time.monotonic() + timeout_s
        while True:
            try:
                data = self._orders.get(timeout=max(0.0, deadline - time.monotonic()))
            except queue.Empty:
                return None
            try:
                return codec.decode_public(ControlMessage, data)
            except RefusedMessage as refusal:
                self.counters.refuse("control", refusal.reason)

    @property
    def watched(self) -> bool:
        """Whether somebody looks at previews: they are sent only then."""
        return self._watched.is_set()

    def send(self, message: PeerMessage | EstimateMessage | StatusMessage | PreviewMessage) -> None:
        """Sends a message of this node to whom it concerns."""
        data = codec.encode(self._run, message)
        publisher, receivers = self._publishers[type(message)], self._receivers.get(type(message))
        if receivers is not None:
            self.counters.count(message.kind, len(data), len(receivers))
            if isinstance(message, ConsensusMessage):
                for name in receivers:
                    self.counters.sent[name] += 1
        else:
            self.counters.count(message.kind, len(data), 1)
            # those who ask want the joint estimate, not that of one camera on its own
            if isinstance(message, StatusMessage) or getattr(message, "estimator", "single") != "single":
                self._answers.keep(str(publisher.key_expr), data)
        publisher.put(data)

    def receive(self, sender: str, timeout_s: float) -> PeerMessage | LostMessage | None:
        """The next valid message of a linked node, None when time is up or the sender is gone."""
        deadline = time.monotonic() + timeout_s
        while (data := self._next(sender, deadline)) is not None:
            message = self._read(sender, data)
            if message is not None:
                return message
        return None

    def receive_each(self, senders: Sequence[str], timeout_s: float) -> tuple[PeerMessage | LostMessage, ...]:
        """The next message of each of several linked nodes, but of those that are gone, silent or refused."""
        deadline = time.monotonic() + timeout_s
        came = [(sender, self._next(sender, deadline)) for sender in senders]
        read = [self._read(sender, data) for sender, data in came if data is not None]
        return tuple([message for message in read if message is not None])

    def _next(self, sender: str, deadline: float) -> bytes | None:
        """The next bytes of a linked node, None when time is up or it is gone."""
        inbox = self._inboxes[sender]
        # what has come already needs no watchdog
        while (sample := inbox.try_recv() or self._await(sender, deadline)) is not None:
            data = sample.payload.to_bytes()
            if data != _WAKE_UP:
                return data
        return None

    def _await(self, sender: str, deadline: float) -> zenoh.Sample | None:
        """The next sample, a wake-up perhaps; None when time is up or the sender is gone."""
        inbox = self._inboxes[sender]
        if sender not in self._alive or time.monotonic() >= deadline:
            return inbox.try_recv()  # its last words may have come just before it left
        self._wait = (sender, deadline)
        try:
            return inbox.recv()
        finally:
            self._wait = None

    def _read(self, sender: str, data: bytes) -> PeerMessage | None:
        """The message in a linked node's bytes; None, counted, where there is none."""
        try:
            message = codec.decode(self._heard[sender], self._run, sender, data)
        except RefusedMessage as refusal:
            self.counters.refuse(sender, refusal.reason)
            return None
        if isinstance(message, ConsensusMessage):
            self.counters.received[sender] += 1
        return message

    def offer(self, state: StateMessage) -> None:
        """Keeps what this node knows, for neighbours that ask."""
        self._answers.offer(state)

    def ask(self, name: str, timeout_s: float) -> StateMessage | None:
        """What another node knows, None where it does not answer in time or has nothing to tell."""
        return self._answers.ask(name, timeout_s)

    def close(self) -> None:
        """Leaves the network, within seconds whatever the others do."""
        self._closed.set()
        sessions.close(self._session)

    def _declare_inbox(self, sender: str) -> _Inbox:
        depth = _DEPTHS[self._heard[sender]]
        return self._session.declare_subscriber(self._inbox_keys[sender], zenoh.handlers.RingChannel(depth))

    def _declare_orders(self) -> None:
        self._session.declare_subscriber(keys.control(self._run), zenoh.handlers.Callback(self._on_order))
        self._answers = Answers(self._session, self._run, self._name, self.counters)

    def _on_order(self, sample: zenoh.Sample) -> None:
        self._orders.put(sample.payload.to_bytes())

    def _on_watched(self, status: zenoh.MatchingStatus) -> None:
        if status.matching:
            self._watched.set()
        else:
            self._watched.clear()

    def _declare_liveliness(self) -> None:
        self._session.liveliness().declare_subscriber(
            keys.alive(self._run), zenoh.handlers.Callback(self._on_liveliness), history=True
        )

    def _on_liveliness(self, sample: zenoh.Sample) -> None:
        try:
            name = keys.node_of(str(sample.key_expr))
        except ValueError:  # somebody else's token
            return
        with self._alive_changed:
            if sample.kind == zenoh.SampleKind.PUT:
                self._alive.add(name)
            else:
                self._alive.discard(name)
            self._receivers = {
                kind: tuple(other for other in others if other in self._alive)
                for kind, others in self._links.receivers().items()
            }
            self._alive_changed.notify_all()
        if sample.kind == zenoh.SampleKind.DELETE:
            self._wake(name)

    def _watch(self) -> None:
        """Wakes the waiting node when its time is up."""
        woken = None
        period_s = _WATCH_PERIOD_S
        while not self._closed.wait(period_s):
            wait = self._wait
            left_s = _WATCH_PERIOD_S if wait is None else wait[1] - time.monotonic()
            period_s = _WATCH_CLOSELY_S if left_s < _WATCH_PERIOD_S else _WATCH_PERIOD_S
            if wait is None or wait is woken:
                continue
            sender, deadline = wait
            if time.monotonic() >= deadline:
                woken = wait
                self._wake(sender)

    def _wake(self, sender: str) -> None:
        """Puts an empty message into a sender's inbox, for whoever waits there."""
        if sender in self._inbox_keys:
            with contextlib.suppress(zenoh.ZError):  # the session is closing: nobody waits any more
                self._session.put(
                    self._inbox_keys[sender], _WAKE_UP, allowed_destination=Locality.SESSION_LOCAL
                )
