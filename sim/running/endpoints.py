"""Where the processes of a run find each other: sockets in a folder, or ports for nodes by hand."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from sim.assembly import Assembly
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

    def connects(self, name: str, assembly: Assembly) -> list[str]:
        """Whom a node connects to: the router, and of each pair of linked nodes the later to the earlier."""
        links = assembly.links[name]
        linked = links.cameras or tuple(other for other in links.neighbors if other < name)
        return [self.router, *(self.nodes[other] for other in linked)]


def run_endpoints(scenario: Scenario, folder: Path, by_hand: Sequence[str]) -> Endpoints:
    """The endpoints of a run that is launched.

    Args:
        scenario: Resolved.
        folder: Of sockets: the fastest, and free of ports.
        by_hand: Nodes that somebody else starts; if there are any, nobody can be told of our folder.
    """
    router = f"unixsock-stream/{folder}/r"
    if by_hand:
        return Endpoints(router, hand_endpoints(scenario).nodes)
    # Short names: a socket's path has 107 characters at most.
    return Endpoints(
        router, {name: f"unixsock-stream/{folder}/{index}" for index, name in enumerate(_names(scenario))}
    )


def hand_endpoints(scenario: Scenario) -> Endpoints:
    """The endpoints that the scenario names for nodes by hand, or ports of the loopback interface."""
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
