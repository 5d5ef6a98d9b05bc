"""What a node answers those who ask over Zenoh, and how it asks: its status, its estimate, and its state."""

from functools import partial

import zenoh

from network.errors import RefusedMessage
from network.links.transport import Traffic
from network.wire import codec, keys
from network.wire.messages import StateMessage


class Answers:
    """The queryables of a node."""

    def __init__(self, session: zenoh.Session, run: str, name: str, counters: Traffic) -> None:
        """A node that has nothing to tell yet.

        Args:
            session: Its session.
            run: Name of the run.
            name: The node.
            counters: Where answers that cannot be used are counted.
        """
        self._session, self._run, self._name, self._counters = session, run, name, counters
        self._latest: dict[str, bytes] = {}
        self._state: StateMessage | None = None
        for key in (keys.status(run, name), keys.estimate(run, name)):
            session.declare_queryable(key, zenoh.handlers.Callback(partial(self._answer, key)))
        session.declare_queryable(keys.state(run, name), zenoh.handlers.Callback(self._answer_state))

    def keep(self, key: str, data: bytes) -> None:
        """Keeps the latest of what is published under a key."""
        self._latest[key] = data

    def offer(self, state: StateMessage) -> None:
        """Keeps what the node knows, for neighbours that ask."""
        self._state = state

    def ask(self, name: str, timeout_s: float) -> StateMessage | None:
        """What another node knows, None where it does not answer in time or has nothing to tell."""
        for reply in self._session.get(keys.state(self._run, name), timeout=timeout_s):
            if reply.ok is None:
                continue
            try:
                state = codec.decode_public(StateMessage, reply.ok.payload.to_bytes())
            except RefusedMessage as refusal:
                self._counters.refuse(name, refusal.reason)
                continue
            if state.node == name:
                return state
        return None

    def _answer(self, key: str, query: zenoh.Query) -> None:
        # Under the node's own key: the question may be a wildcard.
        with query:
            if key in self._latest:
                query.reply(key, self._latest[key])

    def _answer_state(self, query: zenoh.Query) -> None:
        # Put into bytes here, since hardly anybody ever asks.
        with query:
            if self._state is not None:
                query.reply(keys.state(self._run, self._name), codec.encode_public(self._state))
