"""The figure of the filter by one thread and by several: time of each step, and the clip's frames per second.

After Truong & Kim (2017), Fig. 4 to 7, over the number of particles. Imports matplotlib: what only runs
scenarios does not import this module.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from sim.pictures.plots import cleaned
from sim.pictures.theme import COLORS

_ONE, _SEVERAL = COLORS["cpf"], COLORS["dcpf"]
_TITLES = {
    "shuffle": "shuffling: one thread",
    "resampling": "resampling",
    "likelihood": "likelihood",
}


def plot_parallel(report: Mapping[str, Any]) -> Figure:
    """Draws what `dcpf bench parallel` has measured.

    Args:
        report: As the command prints it with ``--json``.

    Returns:
        A panel for each step, time against particles, a ring where so many threads would lose and the program
        takes one; and one for the whole clip.
    """
    figure = Figure(figsize=(11.0, 3.4), layout="constrained")
    axes = [cleaned(panel) for panel in figure.subplots(1, 4)]
    for panel, step in zip(axes[:3], _TITLES, strict=True):
        _draw_step(panel, report["steps"], step)
    axes[0].set_ylabel("time / ms")
    _draw_rates(axes[3], report["frames_per_s_by_particles"])
    several = f"{report['threads']} threads"
    axes[0].plot([], [], "o-", color=_ONE, label="one thread")
    axes[0].plot([], [], "o-", color=_SEVERAL, label=several)
    axes[0].plot(
        [], [], "o", color=_SEVERAL, markerfacecolor="white", label="measured; the program takes one"
    )
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure


def _draw_step(axes: Axes, rows: Sequence[Mapping[str, Any]], step: str) -> None:
    particles = [row["particles"] for row in rows]
    axes.set(xscale="log", yscale="log", xlabel="particles", title=_TITLES[step])
    if step in rows[0]["threads_used"]:
        times = [row["ms"][step]["parallel"] for row in rows]
        axes.plot(particles, times, color=_SEVERAL, linewidth=1.6)
        for row, n, time in zip(rows, particles, times, strict=True):
            face = _SEVERAL if row["threads_used"][step] > 1 else "white"
            axes.plot([n], [time], "o", color=_SEVERAL, markerfacecolor=face, markersize=5)
    axes.plot(particles, [row["ms"][step]["sequential"] for row in rows], "o-", color=_ONE, markersize=4)
    axes.xaxis.set_minor_locator(NullLocator())


def _draw_rates(axes: Axes, rates: Mapping[Any, Mapping[str, float]]) -> None:
    for place, rate in enumerate(rates.values()):
        for offset, way, color in ((-0.2, "sequential", _ONE), (0.2, "parallel", _SEVERAL)):
            axes.bar(place + offset, rate[way], 0.36, color=color)
            words = f"{rate[way]:.1f}" if rate[way] < 100 else f"{rate[way]:,.0f}"
            axes.text(place + offset, rate[way], words, ha="center", va="bottom", size=8)
    axes.set(yscale="log", ylabel="frames/s", xlabel="particles", title="whole clip")
    axes.set_xticks(range(len(rates)), [f"{int(n):,}" for n in rates])
    axes.grid(visible=False, axis="x")
    axes.margins(y=0.15)
