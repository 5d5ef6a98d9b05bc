"""What a valid scenario may not be meant to say: one sentence each, with the remedy."""

import json
from collections.abc import Iterator

from network.averaging.finite_time import roots_of
from nodes.estimators.array_estimator import not_on_array
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
