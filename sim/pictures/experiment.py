"""The figures of an experiment: one a study, and a page of several studies together.

Imports matplotlib: what only runs scenarios does not import this module.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.experiments.found.findings import Findings, GroupFindings
from sim.pictures.comparison import plot_comparison
from sim.pictures.panels import draw_bytes, draw_error, draw_frames, draw_paths, draw_time
from sim.pictures.plots import cleaned, write_figure

PANELS: Mapping[str, Callable[[Axes, Sequence[GroupFindings]], None]] = {
    "error": draw_error,
    "paths": draw_paths,
    "frames": draw_frames,
    "bytes": draw_bytes,
    "time": draw_time,
}
"""How each kind of plot is drawn."""


def write_figures(findings: Findings, folder: Path) -> None:
    """Writes every figure of an experiment, as SVG and PNG, by the names of studies and experiment.

    Raises:
        OSError: They cannot be written.
    """
    for name in findings.options.studies:
        write_figure(plot_study(findings, name), folder / name)
    if findings.options.page:
        for preset in _presets(findings, findings.options.page):
            write_figure(plot_page(findings, preset), folder / f"{findings.options.name}-{preset}")


def plot_study(findings: Findings, name: str) -> Figure:
    """The figure of a study: a column a scenario, a row a preset; of strips, a scenario beside the other."""
    if findings.options.studies[name].plot == "strips":
        return _strips(findings, name)
    presets = _presets(findings, [name])
    rows = [
        [
            (label, findings.study(name, label))
            for label in findings.labels(name)
            if label.endswith(f"({preset})")
        ]
        for preset in presets
    ]
    options = findings.options.studies[name]
    return _grid([(options.plot, row) for row in rows], _titled(findings, options.title or name))


def plot_page(findings: Findings, preset: str) -> Figure:
    """The figure of several studies with one preset: a row a study, a column a scenario."""
    rows = [
        (
            findings.options.studies[name].plot,
            [
                (label, findings.study(name, label))
                for label in findings.labels(name)
                if label.endswith(f"({preset})")
            ],
        )
        for name in findings.options.page
    ]
    return _grid(rows, _titled(findings, f"{findings.options.name}, {preset} preset"))


def _grid(rows: Sequence[tuple[str, Sequence[tuple[str, list[GroupFindings]]]]], title: str) -> Figure:
    """Panels in rows; each row's legend stands beside its last panel."""
    columns = max(len(panels) for _, panels in rows)
    figure = Figure(figsize=(3.7 * columns + 2.2, 3.1 * len(rows) + 0.4), layout="constrained")
    grid = figure.subplots(len(rows), columns, squeeze=False)
    for (plot, panels), places in zip(rows, grid, strict=True):
        for (label, groups), axes in zip(panels, places, strict=False):
            PANELS[plot](cleaned(axes), groups)
            axes.set_title(label, size=10)
        for axes in places[len(panels) :]:
            axes.remove()
        last = places[len(panels) - 1]
        last.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False, fontsize=8, borderaxespad=0)
    figure.suptitle(title, size=11)
    return figure


def _titled(findings: Findings, title: str) -> str:
    """A title that says how many runs stand behind the figure."""
    runs = findings.options.runs
    return f"{title}, {runs} {'run' if runs == 1 else 'runs'} of each setting"


def _strips(findings: Findings, name: str) -> Figure:
    rows = [
        {**run, "scenario": each.group.label} for each in findings.study(name) for run in each.summaries()
    ]
    return plot_comparison(rows)


def _presets(findings: Findings, names: Sequence[str]) -> list[str]:
    return list(dict.fromkeys(each.group.preset for name in names for each in findings.study(name)))
