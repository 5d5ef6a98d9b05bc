"""From a report to its page: the templates, filled."""

from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from sim.report.elements import ExperimentReport, RunReport

FILE = "report.html"
"""In the folder of a run or of an experiment."""

_TEMPLATES = Environment(
    # Everything is escaped but the figures' SVG, which comes as markup.
    loader=PackageLoader("sim.report"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


def render(report: RunReport | ExperimentReport) -> str:
    """The page, HTML."""
    kind = "run" if isinstance(report, RunReport) else "experiment"
    return _TEMPLATES.get_template(f"{kind}.html").render(report=report)


def write_page(report: RunReport | ExperimentReport, path: Path) -> None:
    """Writes the page, whole or not at all.

    Raises:
        OSError: It cannot be written.
    """
    part = path.with_name(f"{path.name}.part")
    part.write_text(render(report), encoding="utf-8")
    part.replace(path)
