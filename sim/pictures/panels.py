"""The panels of an experiment's figures: error over a key, over bytes, over time, and paths.

Imports matplotlib: what only runs scenarios does not import this module.
"""

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from sim.experiments.found.findings import GroupFindings, Track
from sim.metrics.intervals import Interval, mean_interval
from sim.pictures.plots import log_axis
from sim.pictures.swept import AXES, from_to, lines_of, places_of, tick_labels
from sim.pictures.theme import COLORS, LABELS, PAPER

_NAMES: dict[Track, str] = {
    "dcpf": LABELS["dcpf"],
    "cpf": LABELS["cpf"],
    "single": "best single camera",
    "coded": "CPF, JPEG",
}
_TINTS: dict[Track, str] = {
    "dcpf": COLORS["dcpf"],
    "cpf": COLORS["cpf"],
    "single": COLORS["single"],
    "coded": "#56B4E9",
}
_MOST_TICKS = 9
_LEAST_RANGE = 2.5  # of a logarithmic axis, top over bottom: less makes mountains of noise
_DASHES = ("-", "--", ":", "-.")


def draw_error(axes: Axes, groups: Sequence[GroupFindings]) -> None:
    """Mean RMSE over the first swept key in a band of 95% confidence, a dash for each value of the others.

    Where the key's values are words, nothing lies between them: points with bars, and no lines.
    """
    key, *_ = (name for name, _ in groups[0].group.settings)
    values = list(dict.fromkeys(group.settings[key] for group in groups))
    places, is_number = places_of(values)
    tracks: tuple[Track, ...] = ("single", "cpf", "dcpf")
    for place, track in enumerate(tracks):
        for dash, (label, line) in zip(cycle(_DASHES), lines_of(groups, track).items(), strict=False):
            x = places[[values.index(group.settings[key]) for group in line]]
            intervals = [mean_interval(group.rmse(track)) for group in line]
            name = _NAMES[track] + label
            if track == "single":
                _draw_cameras(axes, x, line)
            if is_number:
                _draw_line(axes, x, intervals, _TINTS[track], name, dash)
            else:
                _draw_points(axes, x + 0.08 * (place - 1), intervals, _TINTS[track], "o", name)
    if not is_number or len(values) <= _MOST_TICKS:
        axes.set_xticks(places, tick_labels(places, values))
    if not is_number:
        axes.set_xlim(-0.5, len(values) - 0.5)
    axes.set(xlabel=AXES.get(key, key), ylabel=_rmse_label(groups))
    _log_error_axis(axes)


def draw_paths(axes: Axes, groups: Sequence[GroupFindings]) -> None:
    """The ground from above: each run's deviation from its own truth, laid on the mean true path.

    People walk a little differently with every seed; so the paths of different runs can be compared.
    """
    (group,) = groups[:1]
    truth = group.truth()[:, :, :2]
    middle = truth.mean(axis=0)
    axes.plot(*middle.T, color=COLORS["truth"], linewidth=4.0, alpha=0.3, label=LABELS["truth"])
    widths: dict[Track, float] = {"single": 1.4, "cpf": 1.8, "dcpf": 1.0}
    for track, width in widths.items():
        if not group.has(track):
            continue
        deviation = group.paths(track)[:, :, :2] - truth
        for run in deviation:
            axes.plot(*(middle + run).T, color=_TINTS[track], linewidth=0.5, alpha=0.5)
        mean = middle + np.ma.masked_invalid(deviation).mean(axis=0).filled(np.nan)
        axes.plot(*mean.T, color=_TINTS[track], linewidth=width, label=_NAMES[track])
    axes.set(xlabel=f"x / {group.unit}", ylabel=f"y / {group.unit}")
    axes.margins(0.08)


def draw_frames(axes: Axes, groups: Sequence[GroupFindings]) -> None:
    """The error over the frames: the median over runs and nodes, in a band from 10 to 90 per cent of them."""
    (group,) = groups[:1]
    for track in ("single", "cpf", "dcpf"):
        if not group.has(track):
            continue
        errors = group.errors(track)
        low, median, high = np.nanpercentile(errors, [10, 50, 90], axis=(0, 1))
        frames = np.arange(1, errors.shape[2] + 1)
        axes.plot(frames, median, color=_TINTS[track], linewidth=1.6, label=_NAMES[track])
        axes.fill_between(frames, low, high, color=_TINTS[track], alpha=0.2, linewidth=0)
    axes.set(xlabel="frame", ylabel=f"position error / {group.unit}", xlim=(0, group.truth().shape[1] - 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    log_axis(axes)


def draw_bytes(axes: Axes, groups: Sequence[GroupFindings]) -> None:
    """Mean RMSE over the bytes that all cameras send in a frame: DCPF's settings, CPF's codings.

    DCPF has a line over the first swept key, with a dash for each value of the others.
    """
    for index, (label, line) in enumerate(lines_of(groups, "dcpf").items()):
        ours = [mean_interval(group.rmse("dcpf")) for group in line]
        x = np.array([group.bytes_per_frame()["dcpf"] for group in line])
        style = f"{_DASHES[index % len(_DASHES)]}o"
        name = _NAMES["dcpf"] + label + from_to(line)
        _draw_points(axes, x, ours, _TINTS["dcpf"], style, name, hollow=index > 0)
    sent = groups[0].bytes_per_frame()
    raw = mean_interval(groups[0].rmse("cpf"))
    points = [("cpf", raw, "o", "CPF, raw pictures"), ("bins", raw, "s", "CPF, bin indices as PNG")]
    if groups[0].has("coded"):
        points.append(("jpeg", mean_interval(groups[0].rmse("coded")), "^", "CPF, JPEG"))
    for name, interval, marker, label in points:
        if name in sent:
            color = _TINTS["coded" if name == "jpeg" else "cpf"]
            _draw_points(axes, np.array([sent[name]]), [interval], color, marker, label)
    axes.set(xlabel="bytes a frame, all cameras", ylabel=_rmse_label(groups), xscale="log")
    _log_error_axis(axes)


def draw_time(axes: Axes, groups: Sequence[GroupFindings]) -> None:
    """Mean RMSE over the processor time of a frame: a camera's in DCPF, the central node's in CPF."""
    if groups[0].has("cpf"):
        spent = np.array([np.median(group.cpu_ms("central")) for group in groups])
        _draw_cost(axes, groups, "cpf", spent, "central node")
    if groups[0].has("dcpf"):
        spent = np.array(
            [np.median(group.cpu_ms("cameras")) / len(group.group.scenario_run.cameras) for group in groups]
        )
        _draw_cost(axes, groups, "dcpf", spent, "each camera")
    axes.set(xlabel="processor time a frame / ms", ylabel=_rmse_label(groups))
    _log_error_axis(axes)
    axes.set_xlim(left=0)


def _draw_cost(
    axes: Axes, groups: Sequence[GroupFindings], track: Track, spent: Float[np.ndarray, " S"], where: str
) -> None:
    intervals = [mean_interval(group.rmse(track)) for group in groups]
    name = f"{_NAMES[track]}, {where}{from_to(groups)}"
    _draw_points(axes, spent, intervals, _TINTS[track], "-o", name)


def _draw_cameras(axes: Axes, x: Float[np.ndarray, " S"], groups: Sequence[GroupFindings]) -> None:
    """The mean RMSE of each single camera, thin; not where their number is what is swept."""
    each = [group.node_rmse("single").mean(axis=0) for group in groups]
    if len({len(cameras) for cameras in each}) == 1:
        lines = axes.plot(x, np.array(each), color=_TINTS["single"], linewidth=0.7, alpha=0.6)
        if "each single camera" not in axes.get_legend_handles_labels()[1]:
            lines[0].set_label("each single camera")


def _draw_line(
    axes: Axes, x: Float[np.ndarray, " S"], intervals: Sequence[Interval], color: str, label: str, dash: str
) -> None:
    value, low, high = np.array([[each.value, each.low, each.high] for each in intervals]).T
    fill = color if dash == "-" else PAPER
    axes.plot(
        x,
        value,
        dash,
        marker="o",
        markersize=4,
        color=color,
        markerfacecolor=fill,
        linewidth=1.6,
        label=label,
    )
    axes.fill_between(x, low, high, color=color, alpha=0.15, linewidth=0)


def _draw_points(
    axes: Axes,
    x: Float[np.ndarray, " S"],
    intervals: Sequence[Interval],
    color: str,
    style: str,
    label: str,
    *,
    hollow: bool = False,
) -> None:
    """Points with bars of 95% confidence."""
    value, low, high = np.array([[each.value, each.low, each.high] for each in intervals]).T
    axes.errorbar(
        x, value, yerr=[value - low, high - value], fmt=style, color=color, markersize=5, linewidth=1.6,
        markerfacecolor=PAPER if hollow else color, elinewidth=0.8, capsize=2, label=label,
    )  # fmt: skip


def _log_error_axis(axes: Axes) -> None:
    """A logarithmic axis of errors, wide enough that what is alike looks alike."""
    log_axis(axes)
    bottom, top = axes.get_ylim()
    widen = np.sqrt(max(1.0, _LEAST_RANGE / (top / bottom)))
    axes.set_ylim(bottom / widen, top * widen)


def _rmse_label(groups: Sequence[GroupFindings]) -> str:
    return f"RMSE of the position / {groups[0].unit}"
