"""The picture of a simulation: the network on the ground, and its errors over the frames.

Imports matplotlib: what only runs scenarios does not import this module.
"""

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from sim.assembly import Assembly
from sim.pictures.plots import cleaned, log_axis
from sim.pictures.theme import COLORS, FAINT, LABELS, MUTED
from sim.simulation.summary import Simulated

_FLOOR_M = 1e-3  # errors below look alike


def plot_simulation(found: Simulated, assembly: Assembly) -> Figure:
    """Cameras, links and paths from above, and the errors of all nodes over the frames.

    Args:
        found: The simulation.
        assembly: Its scenario, put together.
    """
    figure = Figure(figsize=(11.5, 5.2), layout="constrained")
    ground, over_time = figure.subplots(1, 2, width_ratios=[1.1, 1])
    _draw_network(figure, cleaned(ground), found, assembly)
    _draw_errors(cleaned(over_time), found)
    # both panels name what they share alike
    named = {
        label: handle
        for axes in (ground, over_time)
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=4, frameon=False)
    return figure


def _draw_network(figure: Figure, axes: Axes, found: Simulated, assembly: Assembly) -> None:
    names = assembly.graph.names
    places = np.array([assembly.cameras[name].center[:2] for name in names])
    row = {name: index for index, name in enumerate(names)}
    links = [(places[row[a]], places[row[b]]) for a, b in sorted(assembly.graph.edges)]
    axes.add_collection(LineCollection(links, colors=FAINT, linewidths=0.6, rasterized=True, zorder=1))
    axes.grid(visible=False)
    # each camera in the colour of its own error
    own = np.sqrt((np.array(found.errors)[1:] ** 2).mean(axis=0))
    size = float(np.clip(4000 / len(names), 2, 60))
    low, high = max(float(own.min()), _FLOOR_M), max(float(own.max()), 2 * _FLOOR_M)
    dots = axes.scatter(
        places[:, 0], places[:, 1], c=np.maximum(own, low), s=size, cmap="cividis_r",
        norm=LogNorm(low, high), linewidths=0, rasterized=True, zorder=2,
    )  # fmt: skip
    bar = figure.colorbar(dots, ax=axes, shrink=0.8, format="{x:g}")
    bar.ax.yaxis.set_minor_formatter("{x:g}")
    bar.set_label("RMSE of the camera's estimates / m")
    truth, exact = np.array(found.truth)[:, :2], np.array(found.exact)[:, :2]
    axes.plot(*truth.T, color=COLORS["truth"], linewidth=3.2, alpha=0.35, label=LABELS["truth"])
    axes.plot(*exact.T, color=COLORS["cpf"], linewidth=1.4, label="all measurements")
    if found.last is not None:
        estimates = found.last.mean
        axes.scatter(
            estimates[:, 0], estimates[:, 1], s=6, color=COLORS["dcpf"], linewidths=0, alpha=0.5,
            rasterized=True, zorder=4, label="the nodes' estimates in the last frame",
        )  # fmt: skip
    margin = 0.06 * float(np.ptp(places, axis=0).max()) + 1
    low_corner, high_corner = places.min(axis=0) - margin, places.max(axis=0) + margin
    axes.set(xlim=(low_corner[0], high_corner[0]), ylim=(low_corner[1], high_corner[1]), aspect="equal")
    axes.set(xlabel="x / m", ylabel="y / m", title=f"{found.scenario.name}, {len(names):,} cameras")


def _draw_errors(axes: Axes, found: Simulated) -> None:
    frames = np.arange(1, len(found.errors))
    errors = np.maximum(np.array(found.errors)[1:], _FLOOR_M)
    low, median, high = np.quantile(errors, [0.05, 0.5, 0.95], axis=1)
    axes.fill_between(
        frames, low, high, color=COLORS["dcpf"], alpha=0.2, linewidth=0, label="nine nodes of ten"
    )
    axes.plot(frames, median, color=COLORS["dcpf"], linewidth=1.8, label="median of the nodes")
    axes.plot(
        frames, _of_those_that_see(found), color=COLORS["single"], linewidth=1.2, label="nodes that see"
    )
    exact = np.maximum(found.exact_errors[1:], _FLOOR_M)
    axes.plot(frames, exact, color=COLORS["cpf"], linewidth=1.4, label="all measurements")
    axes.plot(frames, found.disagreement[1:], color=MUTED, linewidth=1, linestyle=":", label="disagreement")
    log_axis(axes)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="frame", ylabel="position error / m", xlim=(0, len(found.errors) - 1))
    axes.set_title(
        f"{found.scenario.fusion.rule.replace('_', ' ')}, {found.scenario.network.iterations} rounds"
    )


def _of_those_that_see(found: Simulated) -> Float[np.ndarray, " T"]:
    """The median error of the nodes whose camera sees the target; NaN where none does."""
    pairs = zip(found.errors[1:], found.seen[1:], strict=True)
    return np.array([np.median(errors[seen]) if seen.any() else np.nan for errors, seen in pairs])
