"""A run over real links that are cut, lose and delay: one camera in a network namespace of its own.

The other nodes and the launcher are in a second one; a pair of virtual interfaces joins the two. What the
kernel does to packets is real. Everything that is made here is removed afterwards.
"""

import json
import os
import shutil
import subprocess
import time
from types import SimpleNamespace

import pytest

pytestmark = [pytest.mark.processes, pytest.mark.timeout(90)]

HERE, THERE = "10.77.213.1", "10.77.213.2"
FRAMES = 60
DELAY_S = 0.05
DOWN_S = 1.5
"""Longer than it takes to notice (a lease of 1 s), shorter than a node may be away (5 s)."""


def command(*arguments):
    subprocess.run(arguments, check=True, capture_output=True, timeout=10)


@pytest.fixture
def apart():
    """Two namespaces, joined by a link, which `inside` starts commands in."""
    if os.geteuid() != 0:
        pytest.skip("needs root, to make network namespaces")
    if shutil.which("ip") is None:
        pytest.skip("needs ip (iproute2), to make network namespaces")
    names = SimpleNamespace(most=f"dcpf{os.getpid()}a", one=f"dcpf{os.getpid()}b")
    made = []
    try:
        for name in (names.most, names.one):
            try:
                command("ip", "netns", "add", name)
            except subprocess.CalledProcessError as error:
                pytest.skip(f"cannot make network namespaces here: {error.stderr.decode().strip()}")
            made.append(name)
        link = ("type", "veth", "peer", "name", "link0", "netns", names.one)
        command("ip", "link", "add", "link0", "netns", names.most, *link)
        for name, address in ((names.most, HERE), (names.one, THERE)):
            command("ip", "-n", name, "address", "add", f"{address}/24", "dev", "link0")
            for device in ("lo", "link0"):
                command("ip", "-n", name, "link", "set", device, "up")
        yield names
    finally:
        for name in made:
            command("ip", "netns", "delete", name)


def inside(name):
    return ("ip", "netns", "exec", name)


def drop(name, protocol, per_mille):
    """Lets a namespace lose so many of a thousand packets of a protocol, on their way in and out."""
    if shutil.which("nft") is None:
        pytest.skip("needs nft (nftables), to lose packets at random")
    command(*inside(name), "nft", "add", "table", "ip", "lossy")
    for hook in ("input", "output"):
        chain = f"{{ type filter hook {hook} priority 0; }}"
        command(*inside(name), "nft", "add", "chain", "ip", "lossy", hook, chain)
        lose = ("meta", "l4proto", protocol, "numgen", "random", "mod", "1000", "<", str(per_mille), "drop")
        command(*inside(name), "nft", "add", "rule", "ip", "lossy", hook, *lose)


def delay(name):
    """Lets all that a namespace sends travel for `DELAY_S` longer."""
    if shutil.which("tc") is None:
        pytest.skip("needs tc (iproute2), to delay packets")
    try:
        netem = ("netem", "delay", f"{1000 * DELAY_S:.0f}ms")
        command(*inside(name), "tc", "qdisc", "add", "dev", "link0", "root", *netem)
    except subprocess.CalledProcessError as error:
        pytest.skip(f"this kernel has no netem, to delay packets: {error.stderr.decode().strip()}")


def start(launched, dcpf, small, apart, protocol, *more):
    """A run of which camera B is in the namespace `one`."""
    hosts = {"A": HERE, "B": THERE, "C": HERE, "D": HERE}
    endpoints = ", ".join(f"{n}: {protocol}/{host}:{7500 + i}" for i, (n, host) in enumerate(hosts.items()))
    launched.router = f"tcp/{HERE}:7447"
    agreed = [
        *("--frames", FRAMES, "--set", f"network.endpoints={{{endpoints}}}"),
        *("--set", "network.consensus={algorithm: ratio}", "--set", "baselines={cpf: false, single: false}"),
        *(each for key in more for each in ("--set", key)),
    ]
    launched.through = inside(apart.most)
    launched.run(small, "--json", "--by-hand", "B", *agreed)
    router = ("--set", f"network.router={launched.router}")
    return launched.beside(*inside(apart.one), *dcpf, "node", "B", small, *agreed, *router)


def frames_told(launched):
    told = {name: set() for name in "ABCD"}
    for line in launched.lines("estimates"):
        estimate = json.loads(line)
        told[estimate["node"]].add(estimate["frame"])
    return told


def test_links_over_udp_lose_messages_and_ratio_consensus_goes_on(launched, dcpf, small, apart):
    drop(apart.one, "udp", 50)
    start(launched, dcpf, small, apart, "udp", "pace=realtime")

    code, stdout, stderr = launched.end(60)

    assert code == 0, stderr
    summary = json.loads(stdout)
    assert summary["network"]["lost"] > 0
    assert summary["rmse_m"]["dcpf"] < 0.3
    # the run took its time and no more
    assert summary["timing"]["frames_per_s"] == pytest.approx(10, abs=2)
    assert all(len(frames) > 0.8 * FRAMES for frames in frames_told(launched).values())
    assert launched.is_gone()


def test_links_over_tcp_stall_and_lose_nothing(launched, dcpf, small, apart):
    drop(apart.one, "tcp", 50)
    start(launched, dcpf, small, apart, "tcp", "pace=lockstep")

    code, stdout, stderr = launched.end(80)

    assert code == 0, stderr
    summary = json.loads(stdout)
    assert summary["network"]["lost"] == 0
    assert all(len(frames) == FRAMES for frames in frames_told(launched).values())


def test_links_that_take_their_time_are_waited_for_round_by_round(launched, dcpf, small, apart):
    for name in (apart.one, apart.most):
        delay(name)
    start(launched, dcpf, small, apart, "tcp", "pace=lockstep")

    code, stdout, stderr = launched.end(80)

    assert code == 0, stderr
    summary = json.loads(stdout)
    assert summary["network"]["lost"] == summary["network"]["late_messages"] == 0
    assert all(len(frames) == FRAMES for frames in frames_told(launched).values())
    # each of the three rounds of a frame waits for what B and its neighbours tell each other
    assert summary["timing"]["frames_per_s"] < 1 / (3 * DELAY_S)


def test_a_link_that_is_down_parts_the_network_and_nobody_waits_for_the_other_side(
    launched, dcpf, small, apart
):
    start(launched, dcpf, small, apart, "tcp", "pace=realtime")
    assert launched.reaches(10)
    command("ip", "-n", apart.most, "link", "set", "link0", "down")
    time.sleep(DOWN_S)
    command("ip", "-n", apart.most, "link", "set", "link0", "up")

    code, stdout, stderr = launched.end(60)

    assert code == 0, stderr
    summary = json.loads(stdout)
    assert summary["rmse_m"]["dcpf"] < 0.5
    for name in "ACD":
        assert len(frames_told(launched)[name]) > 0.8 * FRAMES
    assert summary["timing"]["frames_per_s"] == pytest.approx(10, abs=2)
