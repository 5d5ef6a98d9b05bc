"""The figures that only a report has: the world, paths from near, how far apart nodes are, who takes part.

Imports matplotlib: what only runs scenarios does not import this module.
"""

from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from sim.assembly import Assembly
from sim.pictures.ground import Area, area_of, field_of_view, height_of_target
from sim.pictures.plots import cleaned, draw_ground, draw_heights, draw_paths
from sim.pictures.theme import COLORS, MUTED, SEEN
from sim.results.results import Results

WIDTH_IN = 5.4
"""Of a figure: on a telephone its text can still be read."""
_MARGIN = 0.12
_VIEWS = ("#009E73", "#E69F00", "#56B4E9", MUTED)  # of Okabe & Ito's colours those that are no estimator's
_MOST_VIEWS = 12  # cameras whose fields of view are outlined: of more, the shade must say it


def plot_world(results: Results, assembly: Assembly) -> Figure:
    """The ground from above: who sees it, each camera's field of view, who talks to whom, the true path.

    Args:
        results: The run, or one of which nothing is known yet.
        assembly: Its scenario, put together.
    """
    area = _bounded(area_of(results, assembly))
    figure, axes = _of_shape(area)
    draw_ground(axes, results, assembly, area)
    if len(assembly.cameras) <= _MOST_VIEWS:
        reach, height = float(np.linalg.norm(area.size)), height_of_target(results, assembly)
        for color, camera in zip(cycle(_VIEWS), assembly.cameras.values(), strict=False):
            axes.plot(*camera.center[:2], "o", markersize=15, markerfacecolor="none", markeredgecolor=color)
            rim = field_of_view(camera, height, reach)
            axes.fill(*rim.T, facecolor="none", edgecolor=color, linewidth=1.2, linestyle=(0, (6, 2)))
    if assembly.truth is not None:
        (path,) = axes.plot(*assembly.truth[:, :2].T, color=COLORS["truth"], linewidth=1.6)
        path.set_label("true path")
    _show(axes, area)
    shown = [Patch(facecolor=SEEN[n], edgecolor=MUTED, linewidth=0.5) for n in range(len(SEEN))]
    words = ["seen by none", *(f"by {n}" for n in range(1, len(SEEN) - 1)), f"by {len(SEEN) - 1} or more"]
    lines, names = axes.get_legend_handles_labels()
    graph = axes.plot([], [], color=MUTED, linewidth=0.8, linestyle=":")
    figure.legend(
        [*shown, *graph, *lines], [*words, "they exchange messages", *names],
        loc="outside lower center", ncols=4, frameon=False, fontsize=9, columnspacing=1.0, handlelength=1.4,
    )  # fmt: skip
    return figure


def plot_paths(results: Results) -> Figure:
    """The estimates and the truth from near, on the ground or in the one camera's picture.

    Args:
        results: The run.
    """
    truth, unit = results.true_states(), results.scenario.target.unit
    fused = [results.means(track) for track in results.tracks if track[0] != "single"]
    known = np.concatenate([path[:, :2] for path in (fused if truth is None else [truth])])
    low, high = np.nanmin(known, axis=0), np.nanmax(known, axis=0)
    margin = max(_MARGIN * float((high - low).max()), 20.0 if unit == "px" else 0.3)
    area = _bounded(Area(low - margin, high + margin))
    figure, axes = _of_shape(area)
    draw_paths(axes, results)
    _show(axes, area, unit)
    if unit == "px":
        axes.invert_yaxis()  # as in pictures, y grows downwards
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    return figure


def plot_heights(results: Results) -> Figure:
    """The height of the target over the frames, in a volume."""
    figure = Figure(figsize=(WIDTH_IN, 2.6), layout="constrained")
    axes = cleaned(figure.add_subplot())
    draw_heights(axes, results)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    return figure


def plot_disagreement(results: Results) -> Figure:
    """How far the nodes' estimates are from each other in each frame: mean and most over all pairs."""
    n_axes, unit = results.scenario.target.n_axes, results.scenario.target.unit
    positions = np.array([results.means(track)[:, :n_axes] for track in results.of("dcpf").values()])
    figure = Figure(figsize=(WIDTH_IN, 2.9), layout="constrained")
    axes = cleaned(figure.add_subplot())
    mean, most = _apart(positions)
    axes.plot(mean, color=COLORS["dcpf"], linewidth=1.6, label="mean over the pairs of nodes")
    axes.plot(most, color=COLORS["dcpf"], linewidth=0.8, linestyle="--", label="the two farthest")
    axes.set(xlabel="frame", ylabel=f"distance / {unit}", xlim=(0, results.scenario.frames - 1))
    axes.set_ylim(bottom=0)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return figure


def plot_members(results: Results, per_frame: Mapping[str, Sequence[int | None]]) -> Figure:
    """How many members the nodes count in each frame: the most and the fewest over those that tell.

    Args:
        results: The run.
        per_frame: What each node has counted in each frame, None where it told nothing.
    """
    counts = np.ma.masked_invalid(np.array(list(per_frame.values()), dtype=float))
    figure = Figure(figsize=(WIDTH_IN, 2.9), layout="constrained")
    axes = cleaned(figure.add_subplot())
    frames, color = np.arange(counts.shape[1]), COLORS["dcpf"]
    for counted, width, style, label in (
        (counts.max(axis=0), 1.6, "-", "the most that a node counts"),
        (counts.min(axis=0), 0.8, "--", "the fewest"),
    ):
        axes.step(frames, counted, style, where="mid", color=color, linewidth=width, label=label)
    axes.set(xlabel="frame", ylabel="members", xlim=(0, results.scenario.frames - 1))
    axes.set_ylim(0, len(results.scenario.cameras) + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return figure


def _bounded(area: Area) -> Area:
    """The area, widened to the proportions that a page bears."""
    return area.widened(float(np.clip(area.size[0] / area.size[1], 1 / 1.1, 2.5)))


def _of_shape(area: Area) -> tuple[Figure, Axes]:
    """A figure for a part of the ground, in its proportions."""
    width, height = area.size
    figure = Figure(figsize=(WIDTH_IN, (WIDTH_IN - 0.8) * height / width + 1.2), layout="constrained")
    return figure, cleaned(figure.add_subplot())


def _show(axes: Axes, area: Area, unit: str = "m") -> None:
    axes.set(xlabel=f"x / {unit}", ylabel=f"y / {unit}", aspect="equal")
    axes.set(xlim=(area.low[0], area.high[0]), ylim=(area.low[1], area.high[1]))


def _apart(positions: Float[np.ndarray, "C T A"]) -> tuple[Float[np.ndarray, " T"], Float[np.ndarray, " T"]]:
    """Mean and largest distance of two nodes, in each frame; NaN where fewer than two have an estimate."""
    i, j = np.triu_indices(len(positions), k=1)
    distances = np.ma.masked_invalid(np.linalg.norm(positions[i] - positions[j], axis=2))
    return distances.mean(axis=0).filled(np.nan), distances.max(axis=0).filled(np.nan)
