"""A node's transport over Eclipse Zenoh: what it hears, who is there, and how it waits.

Zenoh's thread puts what it receives into inboxes. During an ``exchange`` it passes it on and sends the
answers itself: no other thread is woken until the exchange is over. The README says what that saves, and why
what it sends cannot hold it up.
"""

import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from functools import partial

import zenoh

from network.errors import RefusedMessage
from network.links import sessions, threads
from network.links.answers import Answers
from network.links.publishers import declare_publishers
from network.links.transport import Links, LostMessage, Take, Traffic
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
        self._token_key = keys.alive(run, name)
        self._alive: set[str] = set()
        self._gone: set[str] = set()  # since somebody last wanted to know
        self._away = set(self._heard)  # of those who speak to this node
        self._receivers: dict[type, tuple[str, ...]] = dict.fromkeys(links.receivers(), ())  # that are alive
        # held whenever what has come, or who is there, is touched; by itself, since the `with` of a condition
        # takes two more calls of Python for each message
        self._lock = threading.RLock()
        self._changed = threading.Condition(self._lock)
        self._exchange: tuple[Take, Callable[[], Sequence[str]]] | None = None  # under way
        self._awaited: Sequence[str] = ()  # in it
        self._failure: Exception | None = None  # of an exchange, in Zenoh's thread
        self._orders: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._session = sessions.open_peer(listen, connect)
        self._inboxes = {sender: self._declare_inbox(sender) for sender in self._heard}
        self._declare_orders()
        self._watched = threading.Event()
        self._publishers = declare_publishers(self._session, run, name, drop_late_pixels=drop_late_pixels)
        self._publishers[PreviewMessage].declare_matching_listener(zenoh.handlers.Callback(self._on_watched))
        self._declare_liveliness()

    def announce(self) -> None:
        """Tells everybody that this node hears: from here on messages to it arrive."""
        self._token = self._session.liveliness().declare_token(self._token_key)

    def alive(self, name: str) -> bool:
        """Whether a node has announced itself and is there."""
        return name in self._alive

    def gone_meanwhile(self) -> frozenset[str]:
        """Nodes that have gone since this was last called, also those that are back."""
        with self._lock:
            gone, self._gone = frozenset(self._gone), set()
            return gone

    def wait_until_alive(self, names: Iterable[str], timeout_s: float) -> tuple[str, ...]:
        """Waits until nodes are alive; returns those that are still missing when time is up."""
        names = tuple(names)
        with self._lock:
            self._changed.wait_for(lambda: self._alive.issuperset(names), timeout_s)
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
        with self._lock:
            while (message := self._next(sender)) is None and self._may_come(sender):
                if not self._wait_until(deadline):
                    break
            return message

    def exchange(self, take: Take, awaited: Callable[[], Sequence[str]], timeout_s: float) -> None:
        """Hears neighbours and answers them in Zenoh's thread, until nobody is awaited, or can be."""
        deadline = time.monotonic() + timeout_s
        with self._lock:
            self._exchange, self._awaited = (take, awaited), awaited()
            try:
                while self._pass_on() and self._wait_until(deadline):
                    pass
            finally:
                self._exchange = None
            failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    def _pass_on(self) -> bool:
        """Passes on what has come from those who are awaited; returns whether all of these may still come."""
        if self._exchange is None:
            return False
        take, awaited = self._exchange
        while self._awaited:
            for sender in self._awaited:
                message = self._next(sender)
                if message is not None:
                    for answer in take(message):
                        self.send(answer)
                    self._awaited = awaited()
                    break
            else:
                return not self._away or all(self._may_come(sender) for sender in self._awaited)
        return False

    def _next(self, sender: str) -> PeerMessage | LostMessage | None:
        """The next valid message of a linked node that is here; None where there is none."""
        inbox = self._inboxes[sender]
        while inbox:
            try:
                message = codec.decode(
                    self._heard[sender], self._run, sender, inbox.popleft().payload.to_bytes()
                )
            except RefusedMessage as refusal:
                self.counters.refuse(sender, refusal.reason)
                continue
            if isinstance(message, ConsensusMessage):
                self.counters.received[sender] += 1
            return message
        return None

    def _may_come(self, sender: str) -> bool:
        """Whether a node is there to say more."""
        return sender in self._alive

    def _wait_until(self, deadline: float) -> bool:
        """Waits for anything to change; returns whether there was time left."""
        left_s = deadline - time.monotonic()
        if left_s <= 0:
            return False
        self._changed.wait(left_s)
        return True

    def offer(self, state: StateMessage) -> None:
        """Keeps what this node knows, for neighbours that ask."""
        self._answers.offer(state)

    def ask(self, name: str, timeout_s: float) -> StateMessage | None:
        """What another node knows, None where it does not answer in time or has nothing to tell."""
        return self._answers.ask(name, timeout_s)

    def close(self) -> None:
        """Leaves the network, within seconds whatever the others do."""
        sessions.close(self._session)

    def _declare_inbox(self, sender: str) -> deque[zenoh.Sample]:
        """Where a node's messages wait for this one: the latest, if it does not read them."""
        kind = self._heard[sender]
        inbox = deque[zenoh.Sample](maxlen=_DEPTHS[kind])
        heard = zenoh.handlers.Callback(partial(self._on_sample, inbox), indirect=False)
        self._session.declare_subscriber(_KEYS[kind](self._run, sender), heard)
        return inbox

    def _on_sample(self, inbox: deque[zenoh.Sample], sample: zenoh.Sample) -> None:
        """In Zenoh's thread: a message has come, and rounds go on right here where they wait for it."""
        threads.keep_state()
        with self._lock:
            inbox.append(sample)
            try:
                goes_on = self._pass_on()
            except Exception as error:  # noqa: BLE001 - raised again where the node waits
                self._failure, self._exchange, goes_on = error, None, False
            if not goes_on:
                self._changed.notify()

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
        with self._lock:
            if sample.kind == zenoh.SampleKind.PUT:
                self._alive.add(name)
            else:
                self._alive.discard(name)
                self._gone.add(name)
            self._away = self._heard.keys() - self._alive
            self._receivers = {
                kind: tuple(other for other in others if other in self._alive)
                for kind, others in self._links.receivers().items()
            }
            self._changed.notify_all()
