"""Where the processes of a run find each other: sockets in a folder, or ports for nodes by hand."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from network.graph import Graph
from sim.scenario.model import Scenario

FIRST_PORT = 7448
"""Port of the first node that is started by hand; the next ones follow in the scenario's order."""


@dataclass(frozen=True, slots=True)
class Endpoints:
    """Zenoh endpoints of a run.

    Attributes:
        router: Where nodes find the router.
        nodes: Where each node listens.
    """

    router: str
    nodes: Mapping[str, str]

    def connects(self, name: str, graph: Graph, sink: str | None) -> list[str]:
        """Whom a node connects to: the router, and of each pair of linked nodes the later to the earlier."""
        if name == sink:
            linked = graph.names
        else:
            linked = tuple(other for other in graph.neighbors(name) if other < name)
        return [self.router, *(self.nodes[other] for other in linked)]


def in_folder(folder: Path, scenario: Scenario) -> Endpoints:
    """Unix sockets in a folder: the fastest, and free of ports."""
    return Endpoints(
        f"unixsock-stream/{folder}/r",
        # Short names: a socket's path has 107 characters at most.
        {name: f"unixsock-stream/{folder}/{index}" for index, name in enumerate(_names(scenario))},
    )


def by_hand(scenario: Scenario) -> Endpoints:
    """The endpoints that the scenario names, or ports of the loopback interface."""
    return Endpoints(
        scenario.network.router,
        {
            name: scenario.network.endpoints.get(name, f"tcp/127.0.0.1:{FIRST_PORT + index}")
            for index, name in enumerate(_names(scenario))
        },
    )


def _names(scenario: Scenario) -> list[str]:
    cameras = [camera.name for camera in scenario.cameras]
    return [*cameras, scenario.central.name] if scenario.baselines.cpf else cameras
