"""Works out the graph that a scenario describes: afterwards it has edges, whatever they came from."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float

from nodes.imaging.camera import Camera
from sim.scenario.graph_files import read_graph
from sim.scenario.graphs import (
    FileGraph,
    GeometricGraph,
    OverlapGraph,
    WattsStrogatzGraph,
    near,
    overlapping,
    sample_places,
    small_world,
)
from sim.scenario.model import Scenario


def with_edges(scenario: Scenario, cameras: Mapping[str, Camera], folder: Path) -> Scenario:
    """The same scenario with the edges of its graph, where it describes one.

    Args:
        scenario: The scenario.
        cameras: Its cameras, calibrated.
        folder: What a graph's file is relative to.

    Raises:
        ValueError: There is no such graph, or consensus does not converge on it.
    """
    described = scenario.network.graph
    if isinstance(described, str | tuple):
        return scenario
    try:
        match described:
            case GeometricGraph():
                graph = near(described, cameras)
            case WattsStrogatzGraph():
                graph = small_world(described, cameras, scenario.seed)
            case OverlapGraph():
                graph = overlapping(described, cameras, _places(scenario, cameras))
            case FileGraph():
                graph = read_graph(folder / described.path, tuple(cameras))
        network = scenario.network.model_copy(update={"graph": tuple(sorted(graph.edges))})
        scenario = scenario.model_copy(update={"network": network})
        scenario.require_convergence()
    except ValueError as error:
        raise ValueError(f"network.graph of kind {described.kind}: {error}") from None
    return scenario


def _places(scenario: Scenario, cameras: Mapping[str, Camera]) -> Float[np.ndarray, "N 3"]:
    """Where the target may be: over the room's floor, or over the ground between the cameras."""
    target = scenario.target
    if scenario.world is not None:
        room = scenario.world.room
        center, half = np.array(room.center), np.array(room.size) / 2
        low, high, top = center - half, center + half, room.height
    else:
        centers = np.array([camera.center for camera in cameras.values()])
        low, high, top = centers[:, :2].min(axis=0), centers[:, :2].max(axis=0), float(centers[:, 2].max())
    if target.space == "volume":
        bottom = 0.0
    else:
        bottom = top = target.plane_height + target.height / 2
    return sample_places((*low.tolist(), bottom), (*high.tolist(), top))
