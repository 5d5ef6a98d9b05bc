"""The figure of many runs: how exact DCPF is against CPF and a single camera, scenario by scenario.

Imports matplotlib: what only runs scenarios does not import this module.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.pictures.plots import cleaned, log_axis
from sim.pictures.theme import COLORS, LABELS, MUTED
from sim.results.results import length

_PLACES = {"dcpf": -0.26, "cpf": 0.0, "single": 0.26}  # of the strips beside a scenario's name
_BEST_SINGLE = "best single camera"


def plot_comparison(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """RMSE of DCPF, CPF and the best single camera over the seeds, for each scenario.

    Args:
        rows: The summaries of the runs, as ``summary.json`` has them; those of one ``scenario`` make a group.

    Returns:
        A figure with a point for each run, a cross where the target was lost, the median as a bar, and a line
        between DCPF and CPF of the same run; the axis is logarithmic.

    Raises:
        ValueError: There are no rows.
    """
    if not rows:
        raise ValueError("there are no runs to compare: give at least one summary")
    units = {str(row["scenario"]): str(row.get("unit", "m")) for row in rows}
    names, unit = list(units), " or ".join(sorted(set(units.values())))
    figure = Figure(figsize=(max(7.0, 1.8 + 1.7 * len(names)), 4.2), layout="constrained")
    axes = cleaned(figure.add_subplot())
    log_axis(axes)
    axes.grid(visible=False, axis="x")
    for place, name in enumerate(names):
        _draw_group(axes, place, [row for row in rows if row["scenario"] == name])
    mixed = len(set(units.values())) > 1
    axes.set_xticks(range(len(names)), [f"{name}, in {units[name]}" if mixed else name for name in names])
    axes.set_xlim(-0.6, len(names) - 0.4)
    axes.set_ylabel(f"RMSE of the position / {unit}")
    _draw_legend(figure, axes, unit)
    return figure


def _draw_group(axes: Axes, place: int, runs: Sequence[Mapping[str, Any]]) -> None:
    rmse = {kind: np.array([_rmse(run, kind) for run in runs]) for kind in _PLACES}
    lost = {kind: np.array([_lost(run, kind) for run in runs]) for kind in _PLACES}
    # runs beside each other in their order, so that no point hides another one
    spread = 0.12 * np.linspace(-1, 1, len(runs)) if len(runs) > 1 else np.zeros(1)
    across = {kind: place + offset + 0.5 * spread for kind, offset in _PLACES.items()}
    pairs = [np.stack([across[kind], rmse[kind]]) for kind in ("dcpf", "cpf")]
    axes.plot(*np.stack(pairs, axis=1), color=MUTED, linewidth=0.5, alpha=0.5, zorder=1)
    for kind in _PLACES:
        _draw_strip(axes, across[kind], rmse[kind], lost[kind], COLORS[kind])


def _draw_strip(
    axes: Axes, x: Float[np.ndarray, " N"], rmse: Float[np.ndarray, " N"], lost: np.ndarray, color: str
) -> None:
    """A point for each run, and their median."""
    if np.isnan(rmse).all():
        return
    axes.plot(x[~lost], rmse[~lost], "o", color=color, markersize=4.5, alpha=0.75, markeredgewidth=0)
    axes.plot(x[lost], rmse[lost], "x", color=color, markersize=5.5)
    middle, median = float(x.mean()), float(np.nanmedian(rmse))
    axes.plot([middle - 0.11, middle + 0.11], [median, median], color=color, linewidth=2.5, zorder=3)
    axes.text(
        middle, 1.01, f"{median:.2g}", transform=axes.get_xaxis_transform(), ha="center", color=color, size=9
    )


def _draw_legend(figure: Figure, axes: Axes, unit: str) -> None:
    for kind in _PLACES:
        label = _BEST_SINGLE if kind == "single" else LABELS[kind]
        axes.plot([], [], "o", color=COLORS[kind], label=label)
    axes.plot([], [], "x", color=MUTED, label="target lost")
    axes.plot([], [], color=MUTED, linewidth=2.5, label=f"median, above in {unit}")
    figure.legend(loc="outside lower center", ncols=5, frameon=False, columnspacing=1.2, handletextpad=0.5)


def _best_single(run: Mapping[str, Any]) -> str | None:
    known = {node: value for node, value in length(run, "rmse")["single"].items() if value is not None}
    return min(known, key=known.__getitem__, default=None)


def _rmse(run: Mapping[str, Any], kind: str) -> float:
    best = _best_single(run)
    rmse = length(run, "rmse")
    value = rmse["single"].get(best) if kind == "single" else rmse[kind]
    return np.nan if value is None else value


def _lost(run: Mapping[str, Any], kind: str) -> bool:
    best = _best_single(run)
    return bool(run["lost"]["single"].get(best) if kind == "single" else run["lost"][kind])
