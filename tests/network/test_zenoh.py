"""The real network: processes, sockets, time-outs and deaths, on this machine only."""

import contextlib
import json
import os
import queue
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from network.averaging.weights import MetropolisWeights
from network.errors import NetworkError
from network.graphs import graph
from network.links import sessions
from network.links.memory import MemoryNetwork
from network.links.publishers import publish
from network.links.runtime import NODE_RUNTIME
from network.links.transport import links_of
from network.rounds.consensus import Consensus
from network.streams import stream
from network.wire import codec, keys
from network.wire.messages import (
    ConfirmMessage,
    ConsensusMessage,
    ControlMessage,
    EstimateMessage,
    PixelsMessage,
    StatusMessage,
)

pytestmark = pytest.mark.processes

NAMES = ["C1", "C2", "C3", "C4"]
ROOT = Path(__file__).parents[2]


@pytest.fixture
def router(directory):
    endpoint = f"unixsock-stream/{directory}/router.sock"
    session = sessions.open_router([endpoint])
    yield endpoint
    sessions.close(session)


def estimate_of(node, estimator, frame):
    return EstimateMessage("run", node, estimator, frame, 0.0, np.zeros(4), np.eye(4), visible=True,
                           lost=False, ess=1.0, iterations=0, members=(node,))  # fmt: skip


def says(sender, round_, *payload):
    return ConsensusMessage(sender, 0, round_, 1, tuple(map(float, payload)))


@contextlib.contextmanager
def processes_of(run, directory, **more):
    """The processes of a run: four cameras and the centralised filter."""
    spec = {"run": run, "names": NAMES, "directory": directory, "frames": 20, "iterations": 6, **more}
    environment = os.environ | NODE_RUNTIME | {"PYTHONPATH": str(ROOT)}
    script = str(Path(__file__).with_name("ring_node.py"))
    with contextlib.ExitStack() as stack:
        started = {}
        for name in [*NAMES, "central"]:
            command = [sys.executable, script, json.dumps(spec | {"name": name})]
            started[name] = stack.enter_context(
                subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
            )
            stack.callback(started[name].kill)
        yield started


def reports_of(processes):
    outputs = {name: process.communicate(timeout=40)[0] for name, process in processes.items()}
    return {name: json.loads(output) if output else None for name, output in outputs.items()}


def own_value(name, frame):
    return stream(0, name, str(frame)).normal(size=5)


def in_memory(run, frames, iterations):
    """The same run in one thread."""
    net = graph.ring(NAMES)
    network = MemoryNetwork(run, links_of(net, sinks=["central"]))
    nodes = {name: Consensus(name, net.neighbors(name), MetropolisWeights(), iterations) for name in NAMES}
    values = {name: [] for name in NAMES}
    for frame in range(frames):
        for name, node in nodes.items():
            network.post(name, PixelsMessage(name, frame, np.zeros((48, 64, 3), np.uint8)))
            for message in node.begin(frame, own_value(name, frame)):
                network.post(name, message)
        while (delivered := network.deliver()) is not None:
            receiver, message = delivered
            if receiver != "central":
                for reply in nodes[receiver].receive(message):
                    network.post(receiver, reply)
        for name, node in nodes.items():
            values[name].append(node.value.tolist())
    return values, network


@contextlib.contextmanager
def outside(endpoint, run):
    """A client that hears estimates and tokens of a run."""
    session = sessions.open_client(endpoint)
    estimates, tokens = [], queue.SimpleQueue()
    session.declare_subscriber(keys.estimate(run), estimates.append)
    session.liveliness().declare_subscriber(
        keys.alive(run),
        lambda sample: tokens.put(keys.node_of(str(sample.key_expr))),
        history=True,
    )
    try:
        yield session, estimates, tokens
    finally:
        sessions.close(session)


def wait_for_all(tokens):
    seen = set()
    while len(seen) < 5:
        seen.add(tokens.get(timeout=20))


def test_processes_equal_the_network_in_memory_bit_for_bit(directory, router):
    with (
        outside(router, "same") as (session, estimates, tokens),
        processes_of("same", directory) as processes,
    ):
        wait_for_all(tokens)
        publish(session, "same", ControlMessage("start"))
        reports = reports_of(processes)
        time.sleep(0.2)
    values, network = in_memory("same", frames=20, iterations=6)
    for name in NAMES:
        assert reports[name]["order"] == "start"
        assert reports[name]["missing"] == []
        assert reports[name]["values"] == values[name]
        assert reports[name]["unused"] == {}
        for kind in ("consensus", "pixels"):
            assert reports[name]["messages"][kind] == network.counters[name].messages[kind]
            assert reports[name]["bytes"][kind] == network.counters[name].bytes[kind]
    assert reports["central"]["pictures"] == 20 * 4
    assert reports["central"]["messages"] == {"confirm": 20 * 4}
    # the outside heard every estimate once, the last ones too
    heard = sorted((e.node, e.frame) for e in (json_of(sample) for sample in estimates))
    assert heard == [(name, frame) for name in NAMES for frame in range(20)]
    assert str(estimates[0].encoding) == "application/json;dcpf.estimate.v1"


def json_of(sample):
    return codec.decode_public(EstimateMessage, sample.payload.to_bytes())


def test_a_killed_node_is_noticed_and_the_others_go_on(directory, router):
    with (
        outside(router, "kill") as (session, _, tokens),
        processes_of("kill", directory, killed=["C3", 7]) as processes,
    ):
        wait_for_all(tokens)
        begin = time.monotonic()
        publish(session, "kill", ControlMessage("start"))
        reports = reports_of(processes)
    assert reports["C3"] is None
    assert time.monotonic() - begin < 10
    for name in ("C1", "C2", "C4"):
        assert len(reports[name]["values"]) == 20
        assert reports[name]["gone"] == ([] if name == "C1" else ["C3"])
        assert max(reports[name]["seconds"], 0) < 2.0  # nobody waited for a time-out: liveliness woke them
    assert reports["central"]["pictures"] == 20 * 4 - 13


def test_receive_ends_in_time_and_keeps_order(pair):
    a, b = pair
    begin = time.monotonic()
    assert a.receive("B", timeout_s=0.05) is None
    assert 0.05 <= time.monotonic() - begin < 0.5
    assert a.receive("B", timeout_s=0.0) is None
    b.send(says("B", 1, 1.0, 2.0))
    b.send(says("B", 2, 3.0, 4.0))
    assert [a.receive("B", timeout_s=2.0).round for _ in range(2)] == [1, 2]
    assert b.counters.messages == {"consensus": 2}
    assert b.counters.bytes == {"consensus": 2 * (24 + 16)}


def test_a_lost_neighbour_wakes_who_waits_for_it(pair):
    a, b = pair
    b.send(says("B", 1, 1.0))
    time.sleep(0.1)
    threading.Timer(0.2, b.close).start()
    assert a.receive("B", timeout_s=10.0).round == 1
    begin = time.monotonic()
    assert a.receive("B", timeout_s=10.0) is None
    assert time.monotonic() - begin < 3.0
    assert not a.alive("B")
    assert a.receive("B", timeout_s=10.0) is None  # at once
    a.send(says("A", 1, 1.0))
    assert a.counters.messages["consensus"] == 0  # nobody received it


def test_rubbish_is_refused_and_the_next_message_comes_through(pair):
    a, b = pair
    token = b._session.liveliness().declare_token("dcpf/run/-b-/alive")
    publisher = b._publishers[ConsensusMessage]
    publisher.put(b"rubbish")
    publisher.put(b"")
    publisher.put(codec.encode("other", says("B", 1, 1.0)))
    publisher.put(codec.encode("run", says("C", 1, 1.0)))
    publisher.put(codec.encode("run", ConfirmMessage("B", 1)))
    b.send(says("B", 9, 1.0))
    assert a.receive("B", timeout_s=2.0).round == 9
    assert a.counters.refused == {"length": 2, "run": 1, "sender": 1, "kind": 1}
    assert a._alive == {"A", "B"}  # the foreign token is nobody's
    token.undeclare()


def test_orders_reach_nodes(pair):
    a, b = pair
    assert a.wait_for_control(timeout_s=0.0) is None
    b._session.put(keys.control("run"), b"{}")
    publish(b._session, "run", ControlMessage("start", 12.5))
    assert a.wait_for_control(timeout_s=2.0) == ControlMessage("start", 12.5)
    assert a.wait_for_control(timeout_s=0.01) is None
    assert a.counters.refused == {"fields": 1}


def test_the_latest_joint_estimate_and_status_can_be_asked_for(pair):
    a, b = pair

    def ask(key):
        return [reply.ok.payload.to_bytes() for reply in a._session.get(key, timeout=2.0)]

    assert ask(keys.estimate("run", "B")) == []
    for estimator, frame in (("dcpf", 1), ("dcpf", 2), ("single", 2)):
        b.send(estimate_of("B", estimator, frame))
    b.send(StatusMessage("B", "running", 2, {"late": 0}, {}))
    for node in ("B", "*"):
        (answer,) = ask(keys.estimate("run", node))
        found = codec.decode_public(EstimateMessage, answer)
        assert (found.estimator, found.frame) == ("dcpf", 2)
        (answer,) = ask(keys.status("run", node))
        assert codec.decode_public(StatusMessage, answer).frame == 2


def test_taken_endpoints_are_named(directory):
    endpoint = f"unixsock-stream/{directory}/router.sock"
    session = sessions.open_router([endpoint])
    try:
        with pytest.raises(NetworkError, match=f"cannot listen on {endpoint}: end what uses it"):
            sessions.open_router([endpoint])
    finally:
        sessions.close(session)


def test_silent_endpoints_are_named():
    with pytest.raises(NetworkError, match=r"nothing answers at tcp/127\.0\.0\.1:9: check the endpoint"):
        sessions.open_client("tcp/127.0.0.1:9", timeout_s=0.2)
    with pytest.raises(NetworkError, match="cannot connect to nonsense: check the endpoint"):
        sessions.open_peer([], ["nonsense"])
