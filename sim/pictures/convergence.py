"""The figure of averaging algorithms: how the error shrinks over the rounds, and what theory says.

Imports matplotlib: what only runs scenarios does not import this module.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from sim.pictures.plots import cleaned
from sim.pictures.theme import INK, MUTED
from sim.results.convergence import EXACT, Convergence

_LOOKS = {
    "constant": ("#000000", "s"),
    "metropolis": ("#0072B2", "o"),
    "best_constant": ("#56B4E9", "D"),
    "chebyshev": ("#D55E00", "^"),
    "finite_time": ("#009E73", "v"),
    "ratio": ("#CC79A7", "P"),
    "event_triggered": ("#E69F00", "X"),
}
"""Colour (Okabe & Ito 2008) and marker of each algorithm."""


def plot_convergence(graph: str, found: Mapping[str, Convergence]) -> Figure:
    """The residual over the rounds, measured (marks) and by theory (lines).

    Args:
        graph: What the graph is called.
        found: How each algorithm converges.

    Returns:
        A figure with rates and bytes in its legend. The axis is logarithmic; what is exact lies on its foot.

    Raises:
        ValueError: There is no algorithm.
    """
    if not found:
        raise ValueError("there is no algorithm to plot: name at least one")
    figure = Figure(figsize=(9.2, 4.6), layout="constrained")
    axes = cleaned(figure.add_subplot())
    axes.set_yscale("log")
    floor = _floor(found.values())
    for name, each in found.items():
        color, marker = _LOOKS[name]
        rounds = np.arange(len(each.residual) + 1)
        if each.expected is not None:
            expected = np.maximum(np.r_[1.0, each.expected], floor)
            axes.plot(rounds, expected, color=color, linewidth=1.2, alpha=0.8)
        label = (
            f"{name.replace('_', ' ')}{'' if each.expected is not None else ', one start'}\n"
            f"rate {each.rate:.3f} (theory {each.theory:.3f}), {_bytes(each.bytes_per_round)} a round"
        )
        axes.plot(
            rounds, np.maximum(np.r_[1.0, each.residual], floor), linestyle="none", marker=marker,
            markersize=5, markeredgewidth=0, color=color, label=label, clip_on=False, zorder=3,
            markevery=max(1, len(rounds) // 40),
        )  # fmt: skip
    axes.plot([], [], color=MUTED, linewidth=1.2, label="lines: theory")
    axes.set(xlabel="round", ylabel="worst residual  ||x - mean|| / ||x(0) - mean||", title=graph)
    axes.yaxis.set_major_locator(LogLocator(numticks=9))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlim(0, max(len(each.residual) for each in found.values()) + 0.3)
    axes.set_ylim(floor, 1.5)
    if any((each.residual < floor).any() for each in found.values()):
        axes.annotate("exact", (0.01, 0.02), xycoords="axes fraction", color=MUTED)
    figure.legend(loc="outside right upper", frameon=False, labelcolor=INK, labelspacing=0.9)
    return figure


def _floor(found: Iterable[Convergence]) -> float:
    """A power of ten below the least residual that is more than rounding."""
    residuals = np.concatenate([[1.0], *(each.residual for each in found)])
    return float(10.0 ** (np.floor(np.log10(residuals[residuals > EXACT].min())) - 1))


def _bytes(count: float) -> str:
    return f"{count / 1e3:.1f} kB" if count >= 1e4 else f"{count:.0f} B"
