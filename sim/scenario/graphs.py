"""Graphs that a scenario describes: by radio range, by chance, by what cameras see, or by a file.

They are worked out once, when the scenario is read. What runs knows nothing but their edges.
"""

from collections.abc import Mapping
from itertools import combinations
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from network.graphs.graph import Edge, Graph
from network.graphs.random_graphs import geometric, watts_strogatz
from network.options import Options
from network.streams import stream
from nodes.imaging.camera import Camera


class GeometricGraph(Options):
    """Cameras that are near enough to hear each other."""

    kind: Literal["geometric"]
    """By distance."""
    range_m: float = Field(gt=0)
    """The largest distance between two cameras that are linked, in m."""
    positions: Mapping[str, tuple[float, float, float]] | None = None
    """Where each node is, in m, in place of the cameras' own places."""


class WattsStrogatzGraph(Options):
    """A small world over the cameras, drawn by the scenario's seed."""

    kind: Literal["watts_strogatz"]
    """Near neighbours on a ring, with some links that lead anywhere."""
    neighbors: int = Field(default=4, ge=2)
    """How many of the nearest each camera is linked to before links are drawn anew, an even number."""
    rewiring: float = Field(default=0.1, ge=0, le=1)
    """Share of the links that are drawn anew."""


class OverlapGraph(Options):
    """Cameras that see the same places."""

    kind: Literal["overlap"]
    """By the overlap of the fields of view."""
    share: float = Field(default=0.1, gt=0, le=1)
    """What two that are linked have in common at least, as a share of what the one that sees less sees."""


class FileGraph(Options):
    """A graph from a file."""

    kind: Literal["file"]
    """By a file that networkx reads."""
    path: str
    """GraphML, GML, GEXF, Pajek, JSON (node-link), adjacency or edge list, by its ending; relative to the
    scenario file."""


DescribedGraph = Annotated[
    GeometricGraph | WattsStrogatzGraph | OverlapGraph | FileGraph, Field(discriminator="kind")
]
"""A graph that has to be worked out."""


def near(options: GeometricGraph, cameras: Mapping[str, Camera]) -> Graph:
    """The cameras within range of each other.

    Raises:
        ValueError: Some have no position, or there are positions of others.
    """
    places = {name: tuple(camera.center.tolist()) for name, camera in cameras.items()}
    if options.positions is not None:
        if places.keys() != options.positions.keys():
            other = min(places.keys() ^ options.positions.keys())
            wrong = "is no camera" if other not in places else "is missing"
            raise ValueError(f"positions: {other} {wrong}: give each camera one position")
        places = {name: options.positions[name] for name in places}
    return geometric(tuple(places), np.array(list(places.values())), options.range_m)


def small_world(options: WattsStrogatzGraph, cameras: Mapping[str, Camera], seed: int) -> Graph:
    """A small world over the cameras in their order.

    Raises:
        ValueError: There are too few cameras for so many neighbours, or the number is odd.
    """
    return watts_strogatz(tuple(cameras), options.neighbors, options.rewiring, stream(seed, "graph"))


def overlapping(
    options: OverlapGraph, cameras: Mapping[str, Camera], points: Float[np.ndarray, "N 3"]
) -> Graph:
    """The cameras whose pictures hold the same points, whatever stands between.

    Args:
        options: How many they must have in common.
        cameras: The cameras.
        points: Samples of the places where a target can be, in metres.
    """
    seen = {name: camera.contains(camera.project(points)[0]) for name, camera in cameras.items()}
    edges: list[Edge] = []
    for (a, in_a), (b, in_b) in combinations(seen.items(), 2):
        fewer = min(np.count_nonzero(in_a), np.count_nonzero(in_b))
        if fewer and np.count_nonzero(in_a & in_b) >= options.share * fewer:
            edges.append((a, b))
    return Graph.from_edges(tuple(cameras), edges)


def sample_places(
    low: tuple[float, float, float], high: tuple[float, float, float]
) -> Float[np.ndarray, "N 3"]:
    """A regular grid of points in a box: 60 along x and y, 10 in height if it has any."""
    counts = (60, 60, 10 if high[2] > low[2] else 1)
    axes = [np.linspace(a, b, n) for a, b, n in zip(low, high, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
