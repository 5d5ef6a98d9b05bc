"""What a frame does with its line intervals, on paper: the array's time and the external memory's elements.

Imports matplotlib: what only runs scenarios does not import this module.
"""

import numpy as np
from matplotlib.figure import Figure

from nodes.simd.pipeline import ELEMENTS_PER_LINE, LINE_INTERVAL_US, Pipeline
from sim.pictures.plots import cleaned
from sim.pictures.theme import INK, MUTED

PHASES = ("store the picture", "read samples and count", "weigh, estimate, resample")
"""What line intervals are for, in the order in which a frame needs them."""
COLORS = ("#0072B2", "#D55E00", "#009E73")
"""Their colours, of Okabe and Ito (2008)."""


def plot_line_intervals(pipeline: Pipeline, elements_stored: float, available: int) -> Figure:
    """How much of the line intervals of a frame is used.

    Odd intervals store, even ones read and count while there are samples left, and do the rest.

    Args:
        pipeline: The frame.
        elements_stored: Elements that an interval stores.
        available: Line intervals of a frame at the sensor's rate.

    Returns:
        A figure with a bar for each interval: above the array's time, below the elements that it moves.
    """
    order, busy, moved = _intervals(pipeline, elements_stored)
    figure = Figure(figsize=(7.5, 4.2), layout="constrained")
    time, traffic = (cleaned(axes) for axes in figure.subplots(2, 1, sharex=True))
    places = np.arange(len(order))
    for phase, (label, color) in enumerate(zip(PHASES, COLORS, strict=True)):
        chosen = order == phase
        time.bar(places[chosen], busy[chosen], width=1.0, color=color, label=label)
        traffic.bar(places[chosen], moved[chosen], width=1.0, color=color)
    for axes, limit, label in (
        (time, LINE_INTERVAL_US, "a line interval"),
        (traffic, ELEMENTS_PER_LINE, "what the external memory can move"),
    ):
        axes.axhline(limit, color=INK, linewidth=1)
        axes.annotate(
            label, (4, limit), xytext=(0, -3), textcoords="offset points", va="top", fontsize=8, color=MUTED
        )
        axes.set_ylim(0, 1.08 * max(limit, axes.dataLim.y1))
        axes.axvline(available - 0.5, color=INK, linewidth=1, linestyle=":")
    time.set(ylabel="array's time / µs")
    traffic.set(ylabel="elements moved", xlabel="line interval of a frame; dotted: the sensor's frame ends")
    traffic.set_xlim(-1, max(len(order), available) + 1)
    figure.legend(loc="outside upper center", ncols=3, frameon=False)
    return figure


def _intervals(pipeline: Pipeline, elements_stored: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Phase, time and elements of each interval, stored and even ones in turn as long as there are both."""
    storing = np.zeros(pipeline.storing_lines, int)
    idle = max(pipeline.storing_lines - pipeline.reading_lines - pipeline.rest_lines, 0)
    working = np.repeat([1, 2, 3], [pipeline.reading_lines, pipeline.rest_lines, idle])
    n_both = min(len(storing), len(working))
    interleaved = np.stack([storing[:n_both], working[:n_both]], axis=1).ravel()
    order = np.concatenate([interleaved, storing[n_both:], working[n_both:]])
    # The rest fills its intervals up, the last one in part.
    rest = np.full(pipeline.rest_lines, LINE_INTERVAL_US)
    if len(rest):
        rest[-1] = pipeline.rest_us - LINE_INTERVAL_US * (len(rest) - 1)
    busy = np.choose(order, [pipeline.storing_us, pipeline.reading_us, 0.0, 0.0])
    busy[order == 2] = rest
    moved = np.choose(order, [elements_stored, float(pipeline.elements), 0.0, 0.0])
    return order, busy, moved
