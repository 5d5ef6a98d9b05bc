"""The report of a run: what its folder tells, as a page.

Imports matplotlib: what only runs scenarios does not import this module.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from sim.assembly import Assembly
from sim.pictures.convergence import plot_convergence
from sim.pictures.plots import plot_errors
from sim.report.elements import Plot, RunReport
from sim.report.figures import WIDTH_IN, plot_disagreement, plot_heights, plot_members, plot_paths, plot_world
from sim.report.retelling import filmed, told_again
from sim.report.run_tables import (
    array_table,
    events_table,
    figures_table,
    links_table,
    messages_table,
    timing_table,
)
from sim.report.stills import choose_moments, drawn_in, moments_of
from sim.report.svg import inline
from sim.results.convergence import converge
from sim.results.results import Results
from sim.scenario.model import SPACES

_ERRORS_IN = 3.6


def run_report(
    results: Results,
    assembly: Assembly,
    summary: Mapping[str, Any],
    scenario: str,
    *,
    film: Path | None,
    progress: Callable[[int], None],
) -> RunReport:
    """What the page of a run shows.

    Args:
        results: The run.
        assembly: Its scenario, put together; gives the pictures.
        summary: Its summary.
        scenario: Its scenario as run, YAML.
        film: Its recording, if it has one; else the cameras' pictures are made again.
        progress: Told how many frames have been made again.

    Raises:
        SourceError: A camera's pictures cannot be read.
        RecordingError: The recording cannot be read.
    """
    why = choose_moments(results)
    previews = filmed(film, why) if film else told_again(results, assembly, why, progress)
    return RunReport(
        name=results.scenario.name,
        facts=_facts(results, summary),
        versions=summary.get("versions", {}),
        notes=_notes(results, summary),
        figures=figures_table(results, summary),
        errors=_errors(results),
        places=_places(results, assembly),
        moments=moments_of(results, assembly, previews, why),
        shown=drawn_in(results),
        network=_network(results, assembly, summary),
        messages=messages_table(results, summary),
        events=events_table(summary),
        links=links_table(results, assembly, summary),
        timing=timing_table(summary),
        array=array_table(results, summary),
        scenario=scenario,
    )


def _facts(results: Results, summary: Mapping[str, Any]) -> dict[str, str]:
    scenario, network = results.scenario, results.scenario.network
    target, names = scenario.target, [camera.name for camera in scenario.cameras]
    subject = target.person or target.object or "what the footage shows"
    links = len(scenario.graph.edges)
    graph = network.graph if isinstance(network.graph, str) else f"{links} links"
    averaging = (
        f"{network.consensus.algorithm.replace('_', ' ')} averaging, {network.iterations} rounds a frame"
    )
    source = "rendered" if scenario.footage is None else f"footage {scenario.footage.name or ''}".strip()
    return {
        "Scenario": scenario.name,
        "Preset": scenario.preset,
        "Seed": str(scenario.seed),
        "Frames": f"{results.frames_done} at {scenario.rate_hz:g} Hz, {scenario.pace}",
        "Target": f"{subject}, {SPACES[target.space]}",
        "Cameras": f"{len(names)}: {', '.join(names)}",
        "Pictures": source,
        "Network": f"{graph}, {averaging}" if links else "one camera, nobody to agree with",
        "Particles": f"{scenario.filter.n_particles} a filter",
        "Processes": str(summary["processes"]) if summary.get("processes") else "unknown",
    }


def _notes(results: Results, summary: Mapping[str, Any]) -> list[str]:
    notes = []
    done, wanted = results.frames_done, results.scenario.frames
    if done < wanted:
        notes.append(f"The run was interrupted: {done} of {wanted} frames are there.")
    elif "died" not in summary:
        notes.append("The run was not finished: what the nodes sent and timed is not known.")
    if summary.get("died"):
        notes.append(f"Did not reach the end: {', '.join(summary['died'])}.")
    if results.true_states() is None:
        notes.append("Nobody knows the truth of this footage: there are no errors.")
    return notes


def _errors(results: Results) -> list[Plot]:
    if results.true_states() is None:
        return []
    return [
        Plot(
            _drawn(plot_errors(results), "errors", "Position error of each estimator over the frames"),
            "Position error over the frames, on a logarithmic axis.",
        )
    ]


def _places(results: Results, assembly: Assembly) -> list[Plot]:
    """World and paths from above; of one camera in its pixels, the path in its picture."""
    space = results.scenario.target.space
    plots = []
    if space != "image":
        world = inline(plot_world(results, assembly), "world", "The ground from above with cameras and graph")
        caption = (
            "The ground from above: the darker, the more cameras have the target's middle in view there"
            " (whatever stands between); dashed, each camera's field of view at that height; dotted, who"
            " exchanges messages."
        )
        plots.append(Plot(world, caption))
    where = "in the picture, y downwards" if space == "image" else "on the ground, from near"
    paths = inline(plot_paths(results), "paths", f"Paths of the estimates and of the truth {where}")
    plots.append(Plot(paths, f"Paths {where}."))
    if space == "volume":
        heights = inline(plot_heights(results), "heights", "Height of the target over the frames")
        plots.append(Plot(heights, "Height over the frames."))
    return plots


def _network(results: Results, assembly: Assembly, summary: Mapping[str, Any]) -> list[Plot]:
    """How the nodes agree, in the run and by their algorithm; of one node there is nothing to say."""
    if len(results.of("dcpf")) < 2:
        return []
    name = results.scenario.network.consensus.algorithm
    found = dict(converge(results.scenario, (name,), None))
    graph = f"{len(assembly.graph.names)} nodes, {len(assembly.graph.edges)} links"
    convergence = plot_convergence(graph, found)
    convergence.set_size_inches(7.4, 3.4)
    apart = "How far the nodes' estimates are from each other"
    members = plot_members(results, summary["members"]["per_frame"])
    counted = "How many cameras take part, as the nodes count them"
    rounds = "How the rounds of a frame bring any values together"
    start = "one start" if found[name].expected is None else "the worst start, against theory"
    return [
        Plot(inline(plot_disagreement(results), "disagreement", apart), f"{apart}, over the frames."),
        Plot(inline(members, "members", counted), f"{counted}, over the frames."),
        Plot(
            inline(convergence, "rounds", rounds),
            f"{rounds} on this graph, over perfect links: {start}.",
            wide=True,
        ),
    ]


def _drawn(figure: Figure, name: str, label: str) -> Any:
    """A figure as narrow as a page may be, with its name left to the heading."""
    figure.set_size_inches(WIDTH_IN, _ERRORS_IN)
    for axes in figure.axes:
        axes.set_title("")
    return inline(figure, name, label)
