"""What a valid scenario may not be meant to say: one sentence each, with the remedy."""

import json
import math
from collections.abc import Iterator

import numpy as np

from network.averaging.finite_time import roots_of
from nodes.estimators.array_estimator import not_on_array
from nodes.vision.appearance import pack_looks
from sim.scenario.model import Scenario


def advice(scenario: Scenario) -> Iterator[str]:
    """What the network's conditions do to its averaging, and what the array does not do.

    Args:
        scenario: With a graph of names and edges.
    """
    network, lag, needed = scenario.network, scenario.lag_frames, scenario.needed_lag_frames
    conditions, message_s = network.conditions, network.conditions.latest_round_s
    yield from _array_advice(scenario)
    cut = scenario.pace == "realtime" and lag < needed
    if network.consensus.algorithm != "ratio" and (conditions.lose or (cut and conditions.vary)):
        where = "on links that lose messages" if conditions.lose else "where jitter has rounds cut"
        yield (
            f"network.consensus is {network.consensus.algorithm}, whose average suffers from every message"
            f" that only one end of a link has in time: {where}, ratio does not"
        )
    if scenario.pace == "realtime":
        yield from _slow_start(scenario)
    if scenario.pace != "realtime" or not message_s:
        return
    if cut:
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


def _array_advice(scenario: Scenario) -> Iterator[str]:
    options = scenario.filter
    on_array = options.backend == "simd" and scenario.target.space == "image" and scenario.baselines.single
    others = not_on_array(options) if on_array else {}
    if others:
        does = ", ".join(f"filter.{key}: {json.dumps(value)}" for key, value in others.items())
        yield (
            f"{scenario.cameras[0].name} alone runs on the array as Medeiros et al. have it, with {does},"
            " whatever the scenario says"
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
