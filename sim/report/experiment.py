"""The report of an experiment: every study with its figure, what it should show, and its figures as a table.

Imports matplotlib: what only runs scenarios does not import this module.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import count
from typing import Any

from sim.assembly import Assembly
from sim.experiments.found.claims import Verdict
from sim.experiments.found.findings import Findings, GroupFindings
from sim.experiments.found.reporting import figure_rows
from sim.metrics.consistency import anees_band
from sim.pictures.experiment import plot_study
from sim.report.elements import ExperimentReport, Plot, StudyReport, Table
from sim.report.figures import plot_world
from sim.report.one_run import plainest, shown_runs
from sim.report.svg import inline
from sim.results.provenance import versions
from sim.results.results import Results

_CAPTIONS: Mapping[str, str] = {
    "error": "mean over the runs, in bands or bars of 95% confidence",
    "paths": "thin, each run, its deviation from its own truth laid on the mean true path; thick, their mean",
    "frames": "median over runs and nodes, in a band from 10 to 90% of them",
    "bytes": "mean over the runs, in bars of 95% confidence",
    "time": "mean over the runs, in bars of 95% confidence; processor time in the median",
    "strips": "a point a run, the median as a bar",
}
_ESTIMATORS = {"dcpf": "DCPF", "cpf": "CPF", "best single": "best single camera", "cpf jpeg": "CPF, JPEG"}


def experiment_report(findings: Findings, verdicts: Sequence[Verdict], mark: str) -> ExperimentReport:
    """What the page of an experiment shows.

    Args:
        findings: What it has found, whole or not.
        verdicts: Its claims, held against that.
        mark: What the page will be known by.
    """
    names = list(dict.fromkeys(each.group.study for each in findings.groups))
    plain = plainest(findings)
    return ExperimentReport(
        name=findings.options.name,
        facts=_facts(findings),
        versions=versions(),
        notes=_notes(findings),
        worlds=[*_worlds(plain)],
        studies=[_study(findings, name, [each for each in verdicts if each.study == name]) for name in names],
        # As the scenarios are, if some study has them so; whoever has interrupted it wants to be gone.
        runs=[]
        if any(findings.missing.values())
        else shown_runs([each for each in plain if not each.settings] or plain),
        fingerprint=mark,
    )


def _facts(findings: Findings) -> dict[str, str]:
    groups = findings.groups
    seeds = sorted({seed for each in groups for seed in each.group.seeds})
    between = str(seeds[0]) if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"
    return {
        "Experiment": findings.options.name,
        "Scenarios": ", ".join(dict.fromkeys(each.group.label for each in groups)),
        "Studies": ", ".join(dict.fromkeys(each.group.study for each in groups)),
        "Runs of each setting": str(findings.options.runs),
        "Seeds": f"{between}, the same for all estimators",
        "Runs in all": str(sum(len(each.results) for each in groups)),
    }


def _notes(findings: Findings) -> list[str]:
    missing = {name: number for name, number in findings.missing.items() if number}
    if not missing:
        return []
    each = ", ".join(f"{number} of {name}" for name, number in missing.items())
    lacking = f"{sum(missing.values())} runs are missing ({each})"
    shown = "This page shows what is there; claims of studies with gaps are not judged."
    return [f"The experiment was interrupted, or runs failed: {lacking}. {shown}"]


def _worlds(groups: Sequence[GroupFindings]) -> Iterator[Plot]:
    """The ground of each scenario, once for all its settings; none where it is a camera's picture."""
    number = count(1)
    for group in (each.group for each in groups):
        if group.scenario_run.target.space == "image":
            continue
        name = group.scenario
        drawing = inline(
            plot_world(Results(group.scenario_run), Assembly(group.scenario_run)),
            f"world-{next(number)}",
            f"The ground of {name} from above, with cameras and graph",
        )
        yield Plot(drawing, f"{name}, seed {group.scenario_run.seed}: cameras, what they see, the true path.")


def _study(findings: Findings, name: str, verdicts: Sequence[Verdict]) -> StudyReport:
    options = findings.options.studies[name]
    title = options.title or name
    figure = plot_study(findings, name)
    figure.suptitle("")  # the heading has said it
    drawing = inline(figure, f"study-{name}", f"Figure of the study {title}")
    return StudyReport(
        title=title,
        plot=Plot(drawing, f"{_runs(findings)} of each setting: {_CAPTIONS[options.plot]}.", wide=True),
        claims=[(each.in_words, f"{each.label}, {each.claim}: {each.text}") for each in verdicts],
        figures=[_table(label, findings.study(name, label)) for label in findings.labels(name)],
    )


def _runs(findings: Findings) -> str:
    runs = findings.options.runs
    return f"{runs} runs" if runs > 1 else "One run"


def _table(label: str, groups: Sequence[GroupFindings]) -> Table:
    """The figures of a scenario and preset: a row for each setting and estimator."""
    unit, keys = groups[0].unit, list(groups[0].settings)
    rows = [_row(row, keys, each) for each in groups for row in figure_rows(each)]
    headings = (
        "estimator",
        *keys,
        "runs",
        f"RMSE / {unit}",
        "95% interval",
        "worst",
        "lost",
        f"OSPA / {unit}",
        f"GOSPA / {unit}",
        "ANEES",
        "its 95% band",
        "bytes a frame",
    )
    return Table(label, headings, rows)


def _row(row: Mapping[str, Any], keys: Sequence[str], each: GroupFindings) -> list[str]:
    digits = 1 if each.unit == "px" else 3
    length = {
        name: f"{float(row[name]):.{digits}f}"
        for name in ("rmse_mean", "rmse_low95", "rmse_high95", "rmse_worst", "ospa", "gospa")
    }
    low, high = anees_band(int(row["runs"]), each.group.scenario_run.target.n_axes)
    return [
        _ESTIMATORS[row["estimator"]],
        *(str(row[key]) for key in keys),
        str(row["runs"]),
        length["rmse_mean"],
        f"{length['rmse_low95']} to {length['rmse_high95']}",
        length["rmse_worst"],
        f"{float(row['lost_fraction']):.0%}",
        length["ospa"],
        length["gospa"],
        f"{float(row['anees']):.2f}",
        f"{low:.2f} to {high:.2f}",
        f"{int(row['bytes_per_frame']):,}",
    ]
