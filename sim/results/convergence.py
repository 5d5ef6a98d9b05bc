"""How averaging converges on a scenario's graph: the real rounds of every node, over the network in memory.

The residual is the worst over all starts, ||X(t) - mean|| / ||X(0) - mean||: with a unit vector at every
node, the values after t rounds are the rounds' matrix. Where thresholds decide what is sent, or numbers are
rounded, there is no such matrix, and the residual is that of one start, drawn by the scenario's seed. Bytes
are counted on that start too, with vectors as long as the scenario's fusion sends them.

The links are perfect, whatever the scenario's conditions.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from jaxtyping import Float
from pydantic import TypeAdapter

from network.averaging import matrices
from network.averaging.weights import ConsensusOptions
from network.graphs.graph import Graph
from network.graphs.laplacian import laplacian
from network.graphs.spectrum import extremes_of, spectrum_of
from network.links.memory import MemoryNetwork
from network.links.transport import links_of
from network.rounds.consensus import Consensus
from network.streams import stream
from network.wire.messages import ConsensusMessage
from network.wire.quantization import Quantizer
from nodes.filtering.fusion import packed_size
from sim.scenario.model import Scenario
from sim.scenario.parsing import ScenarioError
from sim.scenario.presets import PAPER

ALGORITHMS = (
    "constant",
    "metropolis",
    "best_constant",
    "chebyshev",
    "finite_time",
    "ratio",
    "event_triggered",
)
"""All that a scenario can choose."""

EXACT = 1e-11
"""Residuals below are rounding, where all bits are sent."""


@dataclass(frozen=True, slots=True, eq=False)
class Convergence:
    """How one algorithm converges.

    Attributes:
        residual: After each round.
        expected: The same by theory, None where there is none for each round.
        rate: What is left of the residual from one round to the next; 0 where it is exact.
        theory: The same by theory.
        bytes_per_round: Of all nodes' messages, each counted for every receiver.
    """

    residual: Float[np.ndarray, " T"]
    expected: Float[np.ndarray, " T"] | None
    rate: float
    theory: float
    bytes_per_round: float


def converge(
    scenario: Scenario, algorithms: tuple[str, ...], rounds: int | None
) -> Iterator[tuple[str, Convergence]]:
    """Runs algorithms on a scenario's graph, one after the other.

    Args:
        scenario: The scenario, of two cameras or more.
        algorithms: Their names. One that the scenario has chosen has its options, the others have the
            defaults; constant weights the paper's where they converge, 1 / (1 + largest degree) elsewhere.
        rounds: How many. None for the scenario's, or as many as finite-time averaging needs if it is one of
            them and these are more.

    Raises:
        ScenarioError: Finite-time averaging is one of them, and the graph is too large for it.
    """
    graph = scenario.graph
    try:
        # finite-time rounds are those of a whole run, also where not all of them are looked at
        needed = len(spectrum_of(graph).eigenvalues) if "finite_time" in algorithms else 0
    except ValueError as error:
        raise ScenarioError(f"{scenario.name}: {error}") from error
    if rounds is None:
        rounds = max(scenario.network.iterations, needed)
    encoding = scenario.network.payload.encoding
    rounding = max(EXACT, float(np.finfo(encoding).epsneg))
    for name in algorithms:
        options = _options(scenario, name)
        algorithm = options.tuned(graph, max(rounds, needed))
        size = packed_size(2 * scenario.target.n_axes, scenario.fusion)
        values = np.array(
            [stream(scenario.seed, each, "consensus").normal(size=size) for each in graph.names]
        )
        drawn, sent = average(scenario.name, graph, _nodes(scenario, algorithm, rounds), values)
        if name == "event_triggered" or encoding != "float64":
            # what a threshold or rounding makes of unit vectors it makes of nothing else
            residual, expected = np.array([matrices.residual(each, values) for each in drawn]), None
        else:
            nodes = _nodes(scenario, algorithm, rounds)
            units, _ = average(scenario.name, graph, nodes, np.eye(len(graph.names)))
            residual = np.array([matrices.worst_residual(each) for each in units])
            expected = _expected(options, graph, rounds)
        rate, theory = _rate(residual, rounding), _theory(options, graph)
        yield name, Convergence(residual[1:], expected, rate, theory, sent / max(rounds, 1))


def average(
    run: str, graph: Graph, nodes: Mapping[str, Consensus], values: Float[np.ndarray, "C K"]
) -> tuple[Float[np.ndarray, "T C K"], int]:
    """One frame of consensus.

    Args:
        run: Name of the run.
        graph: The nodes' graph.
        nodes: The nodes, before the frame.
        values: Their values, in the graph's order.

    Returns:
        The values before the first round and after each, and the bytes sent.
    """
    network = MemoryNetwork(run, links_of(graph))
    history = {name: [value] for name, value in zip(graph.names, values, strict=True)}
    for name, value in zip(graph.names, values, strict=True):
        _post(network, nodes[name].begin(0, value))
    while (delivered := network.deliver()) is not None:
        receiver, message = delivered
        node = nodes[receiver]
        if isinstance(message, ConsensusMessage):
            _post(network, node.receive(message))
        if node.rounds_done == len(history[receiver]):
            history[receiver].append(node.value)
    sent = sum(traffic.bytes["consensus"] for traffic in network.counters.values())
    return np.array(list(history.values())).swapaxes(0, 1), sent


def _post(network: MemoryNetwork, messages: tuple[ConsensusMessage, ...]) -> None:
    for message in messages:
        network.post(message.sender, message)


def _nodes(scenario: Scenario, algorithm: Any, rounds: int) -> dict[str, Consensus]:
    graph, payload = scenario.graph, scenario.network.payload
    quantizers: dict[str, Quantizer] = {name: payload.quantizer(scenario.seed, name) for name in graph.names}
    return {
        name: Consensus(name, graph.neighbors(name), algorithm, rounds, quantizers[name])
        for name in graph.names
    }


def _options(scenario: Scenario, name: str) -> ConsensusOptions:
    if scenario.network.consensus.algorithm == name:
        return scenario.network.consensus
    paper, degree = PAPER["network"]["consensus"]["epsilon"], scenario.graph.max_degree
    epsilon = {"epsilon": paper if paper * degree < 1 else 1 / (1 + degree)} if name == "constant" else {}
    options: ConsensusOptions = TypeAdapter(ConsensusOptions).validate_python({"algorithm": name, **epsilon})
    return options


def _theory(options: ConsensusOptions, graph: Graph) -> float:
    """The rate, from the algorithm's matrices."""
    match options.algorithm:
        case "constant":
            return matrices.linear_rate(laplacian(graph), options.epsilon)
        case "metropolis" | "event_triggered":  # which follows it, down to the threshold's floor
            return matrices.linear_rate(matrices.metropolis_laplacian(graph))
        case "best_constant":
            return extremes_of(graph).contraction
        case "chebyshev":
            return matrices.chebyshev_rate(extremes_of(graph))
        case "finite_time":
            return 0.0
        case "ratio":
            return matrices.ratio_rate(laplacian(graph))


def _expected(options: ConsensusOptions, graph: Graph, rounds: int) -> Float[np.ndarray, " T"]:
    """The worst residual after each round, from the algorithm's matrices."""
    values = matrices.rounds(options, graph)(np.eye(len(graph.names)))
    return np.array([matrices.worst_residual(each) for each in islice(values, 1, rounds + 1)])


def _rate(residual: Float[np.ndarray, " T"], rounding: float) -> float:
    """The mean factor over the second half of the rounds until the error is at its least, or rounding is."""
    reached = np.flatnonzero(residual <= rounding)
    last = int(np.argmin(residual[: reached[0] if reached.size else None]))
    if reached.size and last + 1 == reached[0] and residual[last] > np.sqrt(rounding):
        return 0.0  # from far off to exact in one round
    first = last // 2
    return float((residual[last] / residual[first]) ** (1 / max(last - first, 1)))
