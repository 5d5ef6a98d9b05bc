"""The benchmark of consensus rounds: its ways exchange what they should, and it reports what it says."""

import threading

import pytest

from network.graphs.graph import grid, ring
from sim.benchmarks.rounds.consensus import bench_consensus
from sim.benchmarks.rounds.exchange import PlainSockets, connected
from sim.running.children import RunFailed


@pytest.mark.parametrize("shape", [ring, grid])
def test_every_edge_is_a_pair_of_sockets(shape):
    graph = shape([f"N{index}" for index in range(6)])
    ends = connected(graph)
    for name in graph.names:
        assert len(ends[name]) == graph.degree(name)
        for other, end in zip(graph.neighbors(name), ends[name], strict=True):
            end.sendall(name.encode())
            heard = ends[other][graph.neighbors(other).index(name)].recv(2)
            assert heard.decode() == name
    nodes = [
        threading.Thread(target=PlainSockets("bench", name, ends[name]).rounds, args=[5])
        for name in graph.names
    ]
    for node in nodes:
        node.start()
    for node in nodes:
        node.join(10)
        assert not node.is_alive()
    for end in (end for each in ends.values() for end in each):
        end.close()


@pytest.mark.processes
@pytest.mark.timeout(60)
def test_four_processes_on_a_ring_are_measured():
    done = []
    report = bench_consensus(("ring",), (4,), 3, lambda: done.append(None))
    assert report.keys() == {"ring-4"}
    ways = ("round", "bare_zenoh", "bare_zenoh_tuned", "plain_socket")
    assert report["ring-4"].keys() == {f"{way}{what}" for way in ways for what in ("_us", "_cpu_us")}
    assert all(value > 0 for value in report["ring-4"].values())
    assert len(done) == 1


@pytest.mark.processes
def test_what_cannot_run_is_one_sentence():
    with pytest.raises(RunFailed, match="4 nodes on a knot"):
        bench_consensus(("knot",), (4,), 3)
