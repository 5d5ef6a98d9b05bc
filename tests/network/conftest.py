"""All nodes of a network in step, over links that may lose messages; and two of them over real sockets."""

import tempfile

import jaxtyping
import networkx as nx
import numpy as np
import pytest

from network.graphs import graph
from network.graphs.graph import Graph
from network.links.transport import Links
from network.links.zenoh import ZenohTransport
from network.rounds.consensus import Consensus


def run_rounds(net, algorithm, iterations, values, *, loss=0.0, rng=None, quantizers=None, during=None):
    """The values before the first round and after each, by rounds, nodes and numbers; the nodes.

    Each round's messages arrive together, those that are not lost; what is late is not waited for. `during`
    is called with the round and the nodes after every one.
    """
    nodes = {
        name: Consensus(name, net.neighbors(name), algorithm, iterations, (quantizers or {}).get(name))
        for name in net.names
    }
    history = [np.array(values, dtype=float)]
    outgoing = {name: nodes[name].begin(0, value) for name, value in zip(net.names, values, strict=True)}
    for round_ in range(1, iterations + 1):
        sent, outgoing = outgoing, dict.fromkeys(net.names, ())
        for sender, messages in sent.items():
            for message in messages:
                for receiver in net.neighbors(sender):
                    if loss == 0 or rng.random() >= loss:
                        outgoing[receiver] += nodes[receiver].receive(message)
        for name, node in nodes.items():
            if node.rounds_done < round_:
                outgoing[name] += node.expire()
        if during is not None:
            for name, messages in during(round_, nodes).items():
                outgoing[name] += messages
        history.append(np.array([node.value for node in nodes.values()]))
    return np.array(history), nodes


def geometric_32():
    """Thirty-two nodes at random in a square, those within 0.3 of each other linked."""
    net = nx.random_geometric_graph(32, 0.3, seed=6)
    return Graph.from_edges(map(str, net), ((str(a), str(b)) for a, b in net.edges))


NETS = {
    "ring-4": graph.ring("ABCD"),
    "path-4": graph.path("ABCD"),
    "ring-8": graph.ring("ABCDEFGH"),
    "ring-12": graph.ring("ABCDEFGHIJKL"),
    "grid-16": graph.grid("ABCDEFGHIJKLMNOP"),
    "geometric-32": geometric_32(),
}


@pytest.fixture
def unchecked():
    """Leaves shapes unchecked in a test of very many rounds, which takes ten times as long otherwise."""
    jaxtyping.config.update("jaxtyping_disable", "1")
    yield
    jaxtyping.config.update("jaxtyping_disable", "0")


@pytest.fixture
def rounds():
    """The function."""
    return run_rounds


@pytest.fixture(params=NETS)
def net(request):
    """Each of the graphs that all algorithms must master."""
    return NETS[request.param]


@pytest.fixture
def nets():
    """All of them by name."""
    return NETS


@pytest.fixture
def directory():
    with tempfile.TemporaryDirectory(prefix="dcpf-", dir="/tmp") as made:  # socket paths must be short
        yield made


@pytest.fixture
def pair(directory):
    """Two neighbours A and B in this process, B connects to A; and C is another one of A, who never comes."""
    neighbors = {"A": ("B", "C"), "B": ("A",)}
    made = [
        ZenohTransport(
            "run", name, Links(neighbors[name]), [f"unixsock-stream/{directory}/{name}.sock"],
            [f"unixsock-stream/{directory}/{other}.sock"] if name == "B" else [], drop_late_pixels=False,
        )
        for name, other in ("AB", "BA")
    ]  # fmt: skip
    for transport in made:
        transport.announce()
    assert made[0].wait_until_alive(["B"], 5.0) == ()
    assert made[1].wait_until_alive(["A"], 5.0) == ()
    yield made
    for transport in made:
        transport.close()
