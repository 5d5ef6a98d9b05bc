"""Graph files of other programs, read with networkx.

networkx takes its time to import: only who reads such a file does, and no node process.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from xml.etree.ElementTree import ParseError

from network.graphs.graph import Graph
from sim.scenario.parsing import ScenarioError

ENDINGS = (".graphml", ".gml", ".gexf", ".net", ".json", ".adjlist", ".edgelist")
"""The formats by their endings; `.net` is Pajek's, `.json` networkx' node-link data."""


def read_graph(path: Path, names: Sequence[str]) -> Graph:
    """The graph of a file over the cameras.

    Args:
        path: The file.
        names: The cameras. The file's nodes bear their names; if none does, they stand for them in order,
            numbers in theirs.

    Raises:
        ScenarioError: The file cannot be read, or its nodes are not the cameras.
    """
    if path.suffix.lower() not in ENDINGS:
        raise ScenarioError(f"{path}: is no graph file by its ending: take one of {', '.join(ENDINGS)}")
    try:
        found = _read(path)
    except FileNotFoundError:
        raise ScenarioError(f"{path}: there is no such graph file: check network.graph.path") from None
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read: {error.strerror}: check network.graph.path") from None
    except (ParseError, ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise ScenarioError(
            f"{path}: is no {path.suffix} graph: {error}: write it with networkx, for example"
        ) from None
    nodes, edges, directed = found
    if directed:
        raise ScenarioError(f"{path}: its edges have directions, but consensus speaks both ways: undirect it")
    if not set(nodes) & set(names) and len(nodes) == len(names):
        in_order = sorted(nodes, key=int) if all(node.isdecimal() for node in nodes) else nodes
        renamed = dict(zip(in_order, names, strict=True))
        return Graph.from_edges(names, [(renamed[a], renamed[b]) for a, b in edges])
    strange, missing = sorted(set(nodes) - set(names)), sorted(set(names) - set(nodes))
    if strange or missing:
        what = f"node {strange[0]} is no camera" if strange else f"camera {missing[0]} is not in it"
        raise ScenarioError(f"{path}: {what}; the cameras are {', '.join(names)}: name its nodes like them")
    return Graph.from_edges(names, edges)


def _read(path: Path) -> tuple[list[str], list[tuple[str, str]], bool]:
    """Nodes, edges, and whether these have a direction."""
    import networkx as nx  # noqa: PLC0415 - see the top

    try:
        match path.suffix.lower():
            case ".graphml":
                graph = nx.read_graphml(path)
            case ".gml":
                graph = nx.read_gml(path)
            case ".gexf":
                graph = nx.read_gexf(path)
            case ".net":
                graph = nx.read_pajek(path)
            case ".json":
                data = json.loads(path.read_text(encoding="utf-8"))
                graph = nx.node_link_graph(data, edges="links" if "links" in data else "edges")
            case ".adjlist":
                graph = nx.read_adjlist(path)
            case _:
                graph = nx.read_edgelist(path, data=False)
    except nx.NetworkXException as error:
        raise ValueError(str(error)) from error
    return [str(node) for node in graph], [(str(a), str(b)) for a, b, *_ in graph.edges], graph.is_directed()
