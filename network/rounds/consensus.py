"""Everything about consensus rounds lives here: a state machine, given messages, tells what to send.

It knows no clock and no network. Links deliver in order, so that a neighbour's later message tells that the
one waited for will not come. A neighbour that keeps to the rounds is never more than one ahead: it waits too.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from network.averaging.algorithm import Algorithm
from network.graphs.graph import Graph
from network.rounds.membership import Membership
from network.wire.messages import ConsensusMessage
from network.wire.quantization import Quantizer

_Position = tuple[int, int]
"""Frame and round, in the order in which a node goes through them."""

_NOWHERE: _Position = (-1, 0)


class Consensus:
    """Average consensus of one node with its neighbours, frame after frame.

    What a round does to the node's state is the algorithm's affair (`network.averaging`), the plain one being
    Eq. 3 of Jing & Chen; who takes part in it and when it is over is decided here.

    Methods that may complete rounds return the messages to send to all neighbours now, in order. There may be
    several: where one neighbour held a round up, the next round's messages of the others can be here already.

    Attributes:
        name: The node.
        neighbors: Whom it exchanges messages with, sorted by name: the order in which they are summed.
        rounds_done: Rounds done in this frame.
        rounds_in_all: Rounds done in all frames.
        done: Whether this frame's rounds are over.
        gone: The neighbours that it goes on without.
        counters: Messages that were of no use, by reason; those that came after their round and still served
            (``late``); those that their round was done without (``missed``); frames that were ``cut``.
    """

    def __init__(
        self,
        name: str,
        neighbors: Iterable[str],
        algorithm: Algorithm[Any],
        iterations: int,
        quantizer: Quantizer | None = None,
        membership: Membership | None = None,
    ) -> None:
        """A node before its first frame.

        Args:
            name: The node.
            neighbors: Whom it exchanges messages with.
            algorithm: How they average, the same in all nodes.
            iterations: Rounds in each frame, at least 0.
            quantizer: Rounds what it sends; None for the full numbers.
            membership: Who takes part, by the network's links; None where nobody wants to know.
        """
        self.name = name
        self.neighbors = tuple(sorted(neighbors))
        self.rounds_done = self.rounds_in_all = 0
        self.done = True
        self.counters: Counter[str] = Counter()
        self._algorithm, self._iterations = algorithm, iterations
        self._quantizer = quantizer or Quantizer()
        self._membership = membership or Membership(
            name, Graph((name, *self.neighbors), frozenset()), iterations
        )
        self._state: Any = None  # of the algorithm's own type; None before the first frame
        self._said: ConsensusMessage  # in this round
        self._position = _NOWHERE
        self.gone: set[str] = set()
        self._absent: set[str] = set()  # in this frame: the gone, also those restored during it
        self._present: list[str] = []  # neighbours of this frame: neither absent nor heard in a later one
        self._awaited: list[str] = []  # those of them that have said nothing yet in this round
        self._heard = dict.fromkeys(self.neighbors, _NOWHERE)
        self._inbox: dict[int, dict[str, ConsensusMessage]] = {}  # of this frame, by round and sender
        self._early: dict[str, ConsensusMessage] = {}  # first rounds of later frames, by sender

    @property
    def value(self) -> Float[np.ndarray, " K"]:
        """The estimate, after the rounds done so far, of the average over all nodes."""
        return np.array(() if self._state is None else self._state.value)

    @property
    def members(self) -> tuple[str, ...]:
        """The nodes that take part in this frame, as far as it is known here, sorted by name."""
        return self._membership.members(max(self._position[0], 0))

    @property
    def heard(self) -> Mapping[str, int]:
        """The latest frame in which each neighbour has spoken, -1 for one that never has."""
        return {name: frame for name, (frame, _) in self._heard.items()}

    def begin(self, frame: int, value: Float[np.ndarray, " K"]) -> tuple[ConsensusMessage, ...]:
        """Starts a frame with the node's own value.

        Raises:
            ValueError: The frame is not later than the last one, or that one is not over.
        """
        last_frame, _ = self._position
        if not self.done or frame <= last_frame:
            raise ValueError(f"{self.name} cannot begin frame {frame}: it is in frame {last_frame}")
        self._state = self._algorithm.begin(tuple(value.tolist()), self._state)
        self.rounds_done = 0
        self.done = False
        self._absent = set(self.gone)
        self._present = [
            name for name, last in self._heard.items() if name not in self._absent and last < (frame + 1, 0)
        ]
        first = self._enter_round(frame)
        due = [message for message in self._early.values() if message.frame <= frame]
        for message in due:
            del self._early[message.sender]
            self._keep(message)
        return first + self._advance()

    def receive(self, message: ConsensusMessage) -> tuple[ConsensusMessage, ...]:
        """Takes a neighbour's message; one that is of no use is counted and dropped."""
        sender, position = message.sender, (message.frame, message.round)
        last = self._heard.get(sender)
        if last is None:
            self.counters["stranger"] += 1
            return ()
        if position <= last:
            self.counters["duplicate" if position == last else "old"] += 1
            return ()
        self._heard[sender] = position
        frame, _ = self._position
        if last < (frame, 1) and message.frame > frame and sender in self._present:
            self._leave_out(sender)  # it has left out the frame
        self._keep(message)
        return self._await_no_more(sender, position)

    def waiting_for(self) -> tuple[str, ...]:
        """The neighbours whose message of this round may still come, sorted by name."""
        return tuple(self._awaited)

    def drop(self, neighbor: str) -> tuple[ConsensusMessage, ...]:
        """Goes on without a neighbour from now on; what it has said for this round still counts."""
        self.gone.add(neighbor)
        self._leave_out(neighbor)
        return self._advance()

    def restore(self, neighbor: str) -> None:
        """Counts on a neighbour again, from the next frame on."""
        self.gone.discard(neighbor)

    def miss(self, neighbor: str, frame: int, round_: int) -> tuple[ConsensusMessage, ...]:
        """A neighbour's message is known not to come: its round is done without it."""
        if neighbor in self._absent or (frame, round_) <= self._heard[neighbor]:
            return ()
        self._heard[neighbor] = (frame, round_)
        self.counters["missed"] += 1
        return self._await_no_more(neighbor, (frame, round_))

    def expire(self) -> tuple[ConsensusMessage, ...]:
        """Does this round without those that are late; they take part in the next one."""
        if self.done:
            return ()
        self.counters["missed"] += len(self._awaited)
        self._awaited.clear()
        return self._advance()

    def cut(self) -> None:
        """Ends the frame with the rounds done so far."""
        if not self.done:
            self.counters["cut"] += 1
            self._finish()

    def _await_no_more(self, sender: str, position: _Position) -> tuple[ConsensusMessage, ...]:
        """A neighbour that has come to a position says nothing more of the rounds before."""
        if position >= self._position:
            if sender in self._awaited:
                self._awaited.remove(sender)
            if position[0] > self._position[0] and sender in self._present:
                self._present.remove(sender)
        return () if self._awaited else self._advance()

    def _leave_out(self, neighbor: str) -> None:
        """Does without a neighbour for the rest of the frame, and says so."""
        frame, round_ = self._position
        self._absent.add(neighbor)
        self._present = [name for name in self._present if name != neighbor]
        self._awaited = [name for name in self._awaited if name != neighbor]
        self._inbox.get(round_ + 1, {}).pop(neighbor, None)
        if not self.done:
            self._membership.lose(neighbor, frame)

    def _keep(self, message: ConsensusMessage) -> None:
        """Keeps a message that this round, the next one, or a later frame's first can use."""
        frame, round_ = self._position
        sender, its_frame, its_round = message.sender, message.frame, message.round
        # what is told of links counts when its frame comes
        if message.down and its_frame <= frame:
            self._membership.hear(message.down, its_frame)
        late = its_frame < frame or (its_frame == frame and its_round < round_)
        if late and not (self._algorithm.uses_late and its_frame == frame and not self.done):
            self.counters["old"] += 1
        elif its_frame > frame and its_round == 1:
            self._early[sender] = message
        elif its_frame > frame or its_round > round_ + 1 or its_round > self._iterations:
            self.counters["ahead"] += 1
        elif sender in self._absent:
            self.counters["absent"] += 1
        elif self._membership.down and self._membership.is_down(sender, frame):
            # The other end goes on without this node: so does this one without it.
            self._leave_out(sender)
            self.counters["absent"] += 1
        elif not self._algorithm.fits(self._state, message):
            self.counters["shape"] += 1
        elif late:
            self.counters["late"] += 1
            self._inbox.setdefault(round_, {})[sender] = message
        else:
            self._inbox.setdefault(its_round, {})[sender] = message

    def _enter_round(self, frame: int) -> tuple[ConsensusMessage, ...]:
        """Enters the round after those done, or ends the frame where there is none or nobody to talk to."""
        round_ = self.rounds_done + 1
        self._position = position = (frame, round_)
        degree = len(self._present)
        if not self.rounds_done and degree < len(self.neighbors):
            for name in self._heard.keys() - self._present:
                self._membership.lose(name, frame)
        if self.rounds_done == self._iterations or (degree == 0 and (self.rounds_done or not self.neighbors)):
            self._finish()
            return ()
        self._awaited = [name for name in self._present if self._heard[name] < position]
        payload = self._quantizer(self._algorithm.payload(self._state, degree))
        down = self._membership.reports(frame) if self._membership.down else ()
        self._said = ConsensusMessage(
            self.name, frame, round_, degree, payload, self._quantizer.encoding, down
        )
        if degree == 0:
            # Said all the same: who is back hears that this node is there, and who waits for it need not.
            self._finish()
        return (self._said,)

    def _advance(self) -> tuple[ConsensusMessage, ...]:
        """Completes rounds as long as nobody is waited for."""
        messages: tuple[ConsensusMessage, ...] = ()
        while not self.done and not self._awaited:
            frame, round_ = self._position
            # with what has come, in the order of the senders' names
            received = sorted(self._inbox.pop(round_, {}).values())
            self._state = self._algorithm.step(self._state, self._said, received)
            self.rounds_done += 1
            self.rounds_in_all += 1
            messages += self._enter_round(frame)
        return messages

    def _finish(self) -> None:
        """Ends the frame: what still comes for it is old."""
        frame, _ = self._position
        self.done = True
        self._position = (frame, self._iterations + 1)
        self._awaited.clear()
        self._inbox.clear()
