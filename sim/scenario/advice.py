"""What a valid scenario may not be meant to say: one sentence each, with the remedy."""

import math
from collections.abc import Iterator

import numpy as np

from network.averaging.finite_time import roots_of
from nodes.vision.appearance import pack_looks
from sim.scenario.model import Scenario


def advice(scenario: Scenario) -> Iterator[str]:
    """What the network's conditions do to its averaging.

    Args:
        scenario: With a graph of names and edges.
    """
    network, lag, needed = scenario.network, scenario.lag_frames, scenario.needed_lag_frames
    message_s = network.conditions.latest_round_s
    if network.conditions.lose and network.consensus.algorithm != "ratio":
        yield (
            f"network.consensus is {network.consensus.algorithm}, whose average suffers from every message"
            " that only one end of a link has: on links that lose messages, ratio does not"
        )
    if scenario.pace == "realtime":
        yield from _slow_start(scenario)
    if scenario.pace != "realtime" or not message_s:
        return
    if lag < needed:
        yield (
            f"network.lag_frames is {lag}, and {network.iterations} rounds of {message_s:g} s need {needed}:"
            " rounds will be cut; leave it out"
        )
    elif lag:
        needs = len(roots_of(scenario.graph))
        sooner = f": {needs} rounds of finite_time bring them sooner" if needs < network.iterations else ""
        yield (
            f"network.iterations is {network.iterations}, which takes {network.iterations * message_s:g} s on"
            f" these links, so that estimates come {lag} frames after their pictures{sooner}"
        )


def _slow_start(scenario: Scenario) -> Iterator[str]:
    """Frame 0, whose messages are by far the longest: they say what the target looks like."""
    network = scenario.network
    given = [each.bytes_per_s for each in (network.conditions, *network.conditions.links)]
    slowest = min((each for each in given if each is not None), default=np.inf)
    n_bytes = len(pack_looks(None, scenario.filter.color)) * np.dtype(network.payload.encoding).itemsize
    takes_s, has_s = network.iterations * n_bytes / slowest, (1 + scenario.lag_frames) / scenario.rate_hz
    if takes_s > has_s:
        yield (
            f"network.conditions.bytes_per_s is {slowest:.0f}, and in frame 0, which has {has_s:.2g} s,"
            f" {network.iterations} rounds of {n_bytes} bytes, which say what the target looks like, take"
            f" {takes_s:.2g} s: cameras may be on their own at first; allow"
            f" {math.ceil(network.iterations * n_bytes / has_s)}, or take fewer network.iterations"
        )
