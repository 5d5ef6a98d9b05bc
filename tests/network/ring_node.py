"""One node of a small run for the tests: consensus rounds over Zenoh, results on stdout.

Usage: ring_node.py JSON, with run, name, names, directory, frames, iterations.
"""

import json
import os
import signal
import sys
import time

import numpy as np

from network.averaging.weights import MetropolisWeights
from network.graphs import graph
from network.links.transport import links_of
from network.links.zenoh import ZenohTransport
from network.rounds.consensus import Consensus
from network.streams import stream
from network.wire.messages import ConfirmMessage, EstimateMessage, PixelsMessage


def own_value(name, frame):
    return stream(0, name, str(frame)).normal(size=5)


def picture(name, frame):
    return stream(1, name, str(frame)).integers(0, 255, (48, 64, 3), np.uint8)


def rounds(transport, consensus, frame, value):
    for message in consensus.begin(frame, value):
        transport.send(message)
    while not consensus.done:
        transport.exchange(consensus.receive, consensus.waiting_for, timeout_s=2.0)
        for name in consensus.waiting_for():
            if not transport.alive(name):
                for reply in consensus.drop(name):
                    transport.send(reply)


def estimate(run, name, frame, consensus):
    mean = consensus.value[:4]
    return EstimateMessage(run, name, "dcpf", frame, 0.1 * frame, mean, np.eye(4), visible=True, lost=False,
                           ess=1.0, iterations=consensus.rounds_done, members=(name,))  # fmt: skip


def camera(transport, spec):
    name, run = spec["name"], spec["run"]
    net = graph.ring(spec["names"])
    consensus = Consensus(name, net.neighbors(name), MetropolisWeights(), spec["iterations"])
    missing = transport.wait_until_alive([*net.neighbors(name), "central"], timeout_s=15)
    values = []
    for frame in range(spec["frames"]):
        if [name, frame] == spec.get("killed"):
            os.kill(os.getpid(), signal.SIGKILL)
        transport.send(PixelsMessage(name, frame, picture(name, frame)))
        rounds(transport, consensus, frame, own_value(name, frame))
        transport.send(estimate(run, name, frame, consensus))
        values.append(consensus.value.tolist())
        confirmed = transport.receive("central", timeout_s=5.0)
        assert isinstance(confirmed, ConfirmMessage)
        assert confirmed.frame == frame
    return {
        "missing": missing,
        "values": values,
        "unused": dict(consensus.counters),
        "gone": sorted(consensus.gone),
    }


def central(transport, spec):
    missing = transport.wait_until_alive(spec["names"], timeout_s=15)
    pictures = 0
    for frame in range(spec["frames"]):
        for name in spec["names"]:
            message = transport.receive(name, timeout_s=5.0)
            if message is not None:
                np.testing.assert_array_equal(message.image, picture(name, frame))
                pictures += 1
        transport.send(ConfirmMessage("central", frame))
    return {"missing": missing, "pictures": pictures}


def main():
    spec = json.loads(sys.argv[1])
    name, directory = spec["name"], spec["directory"]
    links = links_of(graph.ring(spec["names"]), sinks=["central"])[name]
    earlier = [other for other in links.heard() if other < name]
    endpoint = f"unixsock-stream/{directory}/{{}}.sock".format
    transport = ZenohTransport(
        spec["run"], name, links, [endpoint(name)],
        [endpoint(other) for other in [*earlier, "router"]], drop_late_pixels=False,
    )  # fmt: skip
    try:
        transport.announce()
        order = transport.wait_for_control(timeout_s=20)
        begin = time.perf_counter()
        report = (central if name == "central" else camera)(transport, spec)
        counters = transport.counters
        report |= {"order": order and order.action, "seconds": time.perf_counter() - begin}
        report |= {"messages": counters.messages, "bytes": counters.bytes, "alive": sorted(transport._alive)}
        sys.stdout.write(json.dumps(report))
    finally:
        transport.close()


if __name__ == "__main__":
    main()
