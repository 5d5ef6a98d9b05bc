"""Figures of one run on paper: its errors over time and its paths over the ground.

Imports matplotlib: what only runs scenarios does not import this module.
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from jaxtyping import Float, Int
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.ticker import LogLocator, NullLocator

from sim.assembly import Assembly
from sim.pictures.ground import Area, coverage, heading, height_of_target
from sim.pictures.theme import COLORS, FAINT, INK, LABELS, MUTED, SEEN
from sim.results.results import Results

_GRID_CELLS = 300  # along the longer side of the ground, for who sees what


def plot_errors(results: Results) -> Figure:
    """The position error over the frames: DCPF, CPF and each single camera.

    Args:
        results: A run with a truth.

    Returns:
        A figure; DCPF is the median of its nodes, in a band from the best node to the worst. The axis is
        logarithmic and begins where 2 % of the fused errors are below it.

    Raises:
        ValueError: The run has no truth.
    """
    if results.true_states() is None:
        raise ValueError(f"the run of {results.scenario.name} has no truth: there are no errors to plot")
    figure = Figure(figsize=(7.5, 3.6), layout="constrained")
    axes = cleaned(figure.add_subplot())
    frames = np.arange(1, results.scenario.frames)
    for index, errors in enumerate(_errors(results, "single")):
        label = LABELS["single"] if index == 0 else None
        axes.plot(frames, errors, color=COLORS["single"], linewidth=0.9, alpha=0.7, label=label)
    for errors in _errors(results, "cpf"):
        axes.plot(frames, errors, color=COLORS["cpf"], linewidth=1.8, label=LABELS["cpf"])
    nodes = _errors(results, "dcpf")
    told = np.isfinite(nodes).any(axis=0)
    if told.any():
        _draw_nodes(axes, frames[told], nodes[:, told])
    unit = results.scenario.target.unit
    axes.set(xlabel="frame", ylabel=f"position error / {unit}", title=results.scenario.name)
    axes.set_xlim(0, results.scenario.frames - 1)
    log_axis(axes)
    fused = np.concatenate([nodes, _errors(results, "cpf")])
    if (fused > 0).any():
        # a logarithm would give much of the figure to the few frames that happen to be exact
        axes.set_ylim(bottom=float(np.percentile(fused[fused > 0], 2)))
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure


def write_figure(figure: Figure, stem: Path) -> None:
    """Writes a figure as SVG and as PNG; the same figure gives the same files.

    Args:
        figure: What to write.
        stem: Where, without an ending.
    """
    stem.parent.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context({"svg.hashsalt": stem.name}):
        figure.savefig(stem.with_name(f"{stem.name}.svg"), metadata={"Date": None})
    figure.savefig(stem.with_name(f"{stem.name}.png"), dpi=160)


def cleaned(axes: Axes) -> Axes:
    """The same axes with a faint grid and without a box around them."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(MUTED)
    axes.tick_params(colors=MUTED, labelcolor=INK)
    axes.grid(color=FAINT, linewidth=0.6)
    axes.set_axisbelow(True)
    return axes


def log_axis(axes: Axes) -> None:
    """Makes the vertical axis logarithmic, with labels at 1, 2 and 5 in plain numbers."""
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())


def _errors(results: Results, estimator: str) -> Float[np.ndarray, "C T"]:
    """One row a node, from frame 1 on; NaN where it has no estimate."""
    found = [results.errors(track) for track in results.of(estimator).values()]
    return np.array(found, dtype=float).reshape(-1, results.scenario.frames - 1)


def _draw_nodes(axes: Axes, frames: Int[np.ndarray, " T"], errors: Float[np.ndarray, "C T"]) -> None:
    """The median of DCPF's nodes, and the band that holds them all."""
    label, color = f"{LABELS['dcpf']}: nodes' median and range", COLORS["dcpf"]
    axes.plot(frames, np.nanmedian(errors, axis=0), color=color, linewidth=1.8, label=label)
    low, high = np.nanmin(errors, axis=0), np.nanmax(errors, axis=0)
    axes.fill_between(frames, low, high, color=color, alpha=0.25, linewidth=0)


def draw_ground(axes: Axes, results: Results, assembly: Assembly, area: Area) -> None:
    """The ground from above: shaded by how many cameras see it, with occluders, cameras and their graph."""
    step = float(area.size.max()) / _GRID_CELLS
    x, y = (np.arange(low, high, step) for low, high in zip(area.low, area.high, strict=True))
    seen = coverage(assembly.cameras.values(), x, y, height_of_target(results, assembly))
    levels = np.arange(len(SEEN) + 1) - 0.5
    axes.contourf(x, y, np.minimum(seen, len(SEEN) - 1), levels, colors=list(SEEN))
    for occluder in assembly.world.occluders if assembly.world else ():
        axes.add_patch(Polygon(occluder.footprint, color=MUTED))
    for a, b in sorted(assembly.graph.edges):
        ends = np.array([assembly.cameras[name].center[:2] for name in (a, b)])
        axes.plot(*ends.T, color=MUTED, linewidth=0.8, linestyle=":")
    for name, camera in assembly.cameras.items():
        here, ahead = camera.center[:2], heading(camera)
        marker = (3, 0, float(np.degrees(np.arctan2(ahead[1], ahead[0]))) + 90)
        axes.plot(*here, marker=marker, markersize=9, color=INK)
        behind = -14 if ahead[1] > 0 else 14
        axes.annotate(
            name, (here[0], here[1]), xytext=(0, behind), textcoords="offset points",
            ha="center", va="center", color=INK, weight="bold",
        )  # fmt: skip


def draw_paths(axes: Axes, results: Results) -> None:
    """Where the estimators had the target, and where it was."""
    truth = results.true_states()
    if truth is not None:
        axes.plot(*truth[:, :2].T, color=COLORS["truth"], linewidth=3.2, alpha=0.35, label=LABELS["truth"])
    for kind, width, alpha in (("single", 0.7, 0.6), ("cpf", 1.6, 1.0), ("dcpf", 0.9, 1.0)):
        for index, track in enumerate(results.of(kind).values()):
            label = LABELS[kind] if index == 0 else None
            axes.plot(
                *results.means(track)[:, :2].T, color=COLORS[kind], linewidth=width, alpha=alpha, label=label
            )


def draw_heights(axes: Axes, results: Results) -> None:
    """The height of the target in a volume, frame by frame."""
    truth = results.true_states()
    if truth is not None:
        axes.plot(truth[:, 2], color=COLORS["truth"], linewidth=3.2, alpha=0.35, label=LABELS["truth"])
    for kind, width in (("cpf", 1.6), ("dcpf", 0.9)):
        for index, track in enumerate(results.of(kind).values()):
            label = LABELS[kind] if index == 0 else None
            axes.plot(results.means(track)[:, 2], color=COLORS[kind], linewidth=width, label=label)
    axes.set(xlabel="frame", ylabel="z / m", xlim=(0, results.scenario.frames - 1))
