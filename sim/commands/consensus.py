"""`dcpf consensus`: how fast each averaging algorithm converges on a scenario's graph, and what it sends."""

import json
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from network.graphs.spectrum import LARGEST_DENSE, extremes_of
from sim.commands.shared import AsJson, Overrides, ScenarioPath, Seed, progress_bar, read_scenario
from sim.results.recorder import RecordingError
from sim.scenario.model import Scenario
from sim.scenario.parsing import ScenarioError

if TYPE_CHECKING:
    from sim.results.convergence import Convergence


def consensus(
    scenario: ScenarioPath,
    graph: Annotated[
        str | None,
        typer.Option(help="Graph in place of the scenario's, as network.graph takes it.", show_default=False),
    ] = None,
    algorithm: Annotated[
        list[str] | None, typer.Option(help="Algorithm to run; repeat for more.", show_default="all")
    ] = None,
    rounds: Annotated[
        int | None, typer.Option(help="Rounds.", min=1, max=1000, show_default="the scenario's")
    ] = None,
    seed: Seed = None,
    overrides: Overrides = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the results.", show_default=False)] = None,
    as_json: AsJson = False,
) -> None:
    """Compare averaging algorithms on a scenario's graph, on perfect links: convergence and bytes."""
    # SciPy takes its time to import, and only this needs it.
    from sim.results.convergence import ALGORITHMS, converge

    chosen = tuple(dict.fromkeys(algorithm or ALGORITHMS))
    for name in chosen:
        if name not in ALGORITHMS:
            raise ScenarioError(f"there is no algorithm {name}: choose among {', '.join(ALGORITHMS)}")
    given = [*(overrides or []), *([f"network.graph={graph}"] if graph else [])]
    read = read_scenario(scenario, given, seed=seed, rendered=False)
    if len(read.cameras) < 2:
        raise ScenarioError(f"{read.name} has one camera, and nobody to average with: name another scenario")
    if not (rounds or read.network.iterations):
        raise ScenarioError(f"{read.name}: network.iterations is 0, and nothing averages: give --rounds")
    if not read.network.conditions.are_perfect:
        Console(stderr=True, highlight=False).print(
            f"dcpf: {read.name}: network.conditions is left out: the algorithms are compared on perfect"
            " links; dcpf run has one of them on these",
            soft_wrap=True,
        )
    found: dict[str, Convergence] = {}
    with progress_bar("algorithms", len(chosen)) as bar:
        for name, each in converge(read, chosen, rounds):
            found[name] = each
            bar(len(found))
    title = _title(read, graph)
    facts = {name: _facts(each) for name, each in found.items()}
    report: dict[str, Any] = {"graph": _graph_facts(read, title), "algorithms": facts}
    folder = out or Path("runs") / f"consensus-{datetime.now(UTC).strftime('%Y%m%dT%H%M%S.%fZ')}"
    _write(report, title, found, folder)
    if as_json:
        sys.stdout.write(json.dumps(report) + "\n")
    else:
        _print(report, title, folder)


def _title(scenario: Scenario, graph: str | None) -> str:
    """What to call the graph: as it was asked for, and its size."""
    shape = scenario.network.graph
    asked = graph or (shape if isinstance(shape, str) else "graph")
    return f"{asked}, {len(scenario.cameras)} nodes" if len(asked) < 40 else f"{len(scenario.cameras)} nodes"


def _graph_facts(scenario: Scenario, title: str) -> dict[str, Any]:
    graph, eigenvalues = scenario.graph, extremes_of(scenario.graph).eigenvalues
    return {
        "name": title,
        "nodes": list(graph.names),
        "edges": sorted(map(list, graph.edges)),
        "max_degree": graph.max_degree,
        "eigenvalues": list(eigenvalues),
        "has_all_eigenvalues": len(graph.names) <= LARGEST_DENSE,
    }


def _facts(found: "Convergence") -> dict[str, Any]:
    return {
        "residual": found.residual.tolist(),
        "theory_residual": None if found.expected is None else found.expected.tolist(),
        "rate": found.rate,
        "theory": found.theory,
        "bytes_per_round": found.bytes_per_round,
    }


def _write(report: dict[str, Any], title: str, found: "dict[str, Convergence]", folder: Path) -> None:
    # Matplotlib takes its time to import, and only this needs it.
    from sim.pictures.convergence import plot_convergence
    from sim.pictures.plots import write_figure

    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "consensus.json").write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
        write_figure(plot_convergence(title, found), folder / "consensus")
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be written: {error.strerror}: name another --out") from error


def _print(report: dict[str, Any], title: str, folder: Path) -> None:
    console, facts = Console(highlight=False), report["graph"]
    eigenvalues = facts["eigenvalues"]
    rounds = max(len(each["residual"]) for each in report["algorithms"].values())
    distinct = f", {len(eigenvalues)} distinct non-zero eigenvalues" if facts["has_all_eigenvalues"] else ""
    console.print(
        f"{title}, {rounds} rounds: {len(facts['edges'])} links, largest degree {facts['max_degree']},"
        f" λ₂ = {eigenvalues[0]:.3g}, λ_N = {eigenvalues[-1]:.3g}{distinct}",
        soft_wrap=True,
    )
    table = Table()
    table.add_column("algorithm", no_wrap=True)
    for heading in ("residual", "theory", "rate", "theory", "B a round"):
        table.add_column(heading, justify="right", no_wrap=True)
    for name, each in report["algorithms"].items():
        residual, expected = each["residual"], each["theory_residual"]
        table.add_row(
            name,
            f"{residual[-1]:.2g}",
            "–" if expected is None else f"{expected[-1]:.2g}",
            f"{each['rate']:.4f}",
            f"{each['theory']:.4f}",
            f"{each['bytes_per_round']:,.0f}",
        )
    console.print(table)
    console.print(f"figures and plot in {folder}", soft_wrap=True)
