"""Rounds that go on in Zenoh's thread: who is heard, when it ends, and what fails in it."""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from network.links.runtime import NODE_RUNTIME
from network.wire.messages import ConsensusMessage

pytestmark = pytest.mark.processes

ROOT = Path(__file__).parents[2]


def says(sender, round_, *payload):
    return ConsensusMessage(sender, 0, round_, 1, tuple(map(float, payload)))


class Listener:
    """Waits for some messages of B, and answers each with as many as it is told."""

    def __init__(self, wanted, answers=0):
        self.wanted, self.answers = wanted, answers
        self.rounds, self.threads = [], set()

    def awaited(self):
        return ("B",) if len(self.rounds) < self.wanted else ()

    def take(self, message):
        self.rounds.append(message.round)
        self.threads.add(threading.get_ident())
        return [says("A", 1 + number, 0.0) for number in range(self.answers)]


def test_an_exchange_hears_who_is_awaited_until_nobody_is_and_passes_over_what_is_refused(pair):
    a, b = pair
    b.send(says("B", 1, 1.0))
    b._publishers[ConsensusMessage].put(b"rubbish")
    b.send(says("B", 3, 1.0))
    b.send(says("B", 4, 1.0))
    two = Listener(2)
    begin = time.monotonic()
    a.exchange(two.take, two.awaited, 2.0)
    assert two.rounds == [1, 3]
    assert time.monotonic() - begin < 1.0
    assert a.counters.refused == {"length": 1}
    time.sleep(0.1)
    assert a.receive("B", 0.0).round == 4  # left alone: nobody waited for it


def test_an_exchange_ends_in_time_and_goes_on_where_it_was_ended(pair):
    a, b = pair
    listener = Listener(2)
    b.send(says("B", 1, 1.0))
    begin = time.monotonic()
    a.exchange(listener.take, listener.awaited, 0.2)
    assert 0.2 <= time.monotonic() - begin < 1.0
    b.send(says("B", 2, 1.0))
    time.sleep(0.1)
    assert listener.rounds == [1]
    a.exchange(listener.take, listener.awaited, 0.0)
    assert listener.rounds == [1, 2]


def test_an_exchange_answers_in_the_thread_that_receives(pair):
    a, b = pair
    asked = Listener(1, answers=3)
    threading.Timer(0.2, b.send, [says("B", 1, 1.0)]).start()
    a.exchange(asked.take, asked.awaited, 5.0)
    assert asked.rounds == [1]
    assert threading.get_ident() not in asked.threads
    assert [b.receive("A", 2.0).round for _ in range(3)] == [1, 2, 3]


def test_an_exchange_ends_where_one_who_is_awaited_goes(pair):
    a, b = pair
    listener = Listener(2)
    b.send(says("B", 1, 1.0))
    threading.Timer(0.2, b.close).start()
    begin = time.monotonic()
    a.exchange(listener.take, listener.awaited, 10.0)
    a.exchange(listener.take, listener.awaited, 10.0)  # at once
    assert time.monotonic() - begin < 3.0
    assert listener.rounds == [1]


def test_an_exchange_ends_where_one_who_is_gone_becomes_awaited(pair):
    # in the round that begins with B's message, C is waited for, who is not there
    a, b = pair
    heard = []

    def take(message):
        heard.append(message.sender)
        return ()

    threading.Timer(0.2, b.send, [says("B", 1, 1.0)]).start()
    begin = time.monotonic()
    a.exchange(take, lambda: ("B", "C") if heard else ("B",), 5.0)
    assert time.monotonic() - begin < 2.0
    assert heard == ["B"]


def test_what_fails_in_an_exchange_fails_where_the_node_waits(pair):
    a, b = pair

    def take(message):
        raise ArithmeticError(message.round)

    threading.Timer(0.2, b.send, [says("B", 7, 1.0)]).start()
    begin = time.monotonic()
    with pytest.raises(ArithmeticError, match="7"):
        a.exchange(take, lambda: ("B",), 5.0)
    assert time.monotonic() - begin < 2.0
    b.send(says("B", 8, 1.0))
    assert a.receive("B", 2.0).round == 8


def test_the_thread_that_sends_does_not_wait_for_itself(directory):
    # far more than a node has to say at once, two rounds of each frame under way; a full queue ends the link
    script = str(Path(__file__).with_name("many_answers.py"))
    environment = os.environ | NODE_RUNTIME | {"PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, script, directory], check=True, timeout=30, env=environment)
