"""The files of an experiment: cells as JSON lines, the summary as JSON and CSV, its claims as text.

Everything here depends on the experiment alone; what depends on the machine goes into `timing.json`.
"""

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sim.experiments.computing.work import as_plain
from sim.experiments.found.claims import Verdict, as_data
from sim.experiments.found.figures import compare
from sim.experiments.found.findings import Findings, GroupFindings, Track
from sim.metrics.errors import is_lost
from sim.metrics.intervals import mean_interval
from sim.metrics.sets import gospa, ospa
from sim.results.results import Results, in_unit, length

_TRACKS: tuple[Track, ...] = ("dcpf", "cpf", "single", "coded")


def report(findings: Findings, verdicts: Sequence[Verdict]) -> dict[str, Any]:
    """The figures of every group by its label, with the runs' summaries; and the claims, if there are any."""
    found: dict[str, Any] = {}
    for each in findings.groups:
        summaries = each.summaries()
        found[title(findings, each)] = {
            "settings": each.settings,
            **compare(summaries, each.group.scenario_run.target.n_axes),
            "summaries": summaries,
        }
    return {**found, **({"claims": as_data(verdicts)} if verdicts else {})}


def title(findings: Findings, each: GroupFindings) -> str:
    """What a group is called in tables: study, if there are several, scenario, preset and settings."""
    study = [f"{each.group.study}:"] if len(findings.options.studies) > 1 else []
    settings = (
        [", ".join(f"{key}={value}" for key, value in each.group.settings)] if each.group.settings else []
    )
    return " ".join([*study, each.group.label, *settings])


def write_files(
    findings: Findings, found: Mapping[str, Any], verdicts: Sequence[Verdict], folder: Path
) -> None:
    """Writes `comparison.json`, `cells.jsonl`, `summary.csv`, `timing.json` and, with claims, `claims.md`.

    Raises:
        OSError: They cannot be written.
    """
    (folder / "comparison.json").write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    cells = [json.dumps(cell) + "\n" for each in findings.groups for cell in _cells(each)]
    (folder / "cells.jsonl").write_text("".join(cells), encoding="utf-8")
    rows = [row for each in findings.groups for row in figure_rows(each)]
    with (folder / "summary.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(dict.fromkeys(key for row in rows for key in row)), restval="")
        writer.writeheader()
        writer.writerows(rows)
    timing = {title(findings, each): _timing(each) for each in findings.groups}
    (folder / "timing.json").write_text(json.dumps(timing, indent=2) + "\n", encoding="utf-8")
    if verdicts:
        (folder / "claims.md").write_text(claims_text(findings, verdicts), encoding="utf-8")


def claims_text(findings: Findings, verdicts: Sequence[Verdict]) -> str:
    """What the figures show of what they should, as Markdown."""
    lines = [f"# {findings.options.name}: what was claimed, and what was measured", ""]
    for name in dict.fromkeys(verdict.study for verdict in verdicts):
        lines += [f"## {name}: {findings.options.studies[name].title}".rstrip(": "), ""]
        for verdict in (each for each in verdicts if each.study == name):
            lines.append(f"- **{verdict.label}, {verdict.claim}: {verdict.in_words}.** {verdict.text}")
        lines.append("")
    return "\n".join(lines)


def _cells(each: GroupFindings) -> Iterator[dict[str, Any]]:
    """One run: its figures, and the error of each estimator by frame from 1 on."""
    errors = {track: each.node_errors(track) for track in _TRACKS if each.has(track)}
    group = each.group
    for run, (seed, summary) in enumerate(zip(group.seeds, each.summaries(), strict=True)):
        # DCPF: root mean square over the nodes of a frame; single: one line a camera.
        by_frame = {
            track: found[run] if track == "single" else np.sqrt(np.mean(found[run] ** 2, axis=0))
            for track, found in errors.items()
        }
        yield {
            "study": group.study,
            "scenario": group.scenario,
            "preset": group.preset,
            "settings": each.settings,
            "seed": seed,
            "unit": each.unit,
            **in_unit({name: length(summary, name) for name in ("rmse", "disagreement")}, each.unit),
            **{key: summary[key] for key in ("lost", "anees", "tracking")},
            f"rmse_coded_{each.unit}": float(each.rmse("coded")[run]) if "coded" in errors else None,
            "bytes_per_frame": summary["network"]["bytes_per_frame"],
            f"errors_{each.unit}": {track: as_plain(found, 5) for track, found in by_frame.items()},
        }


def figure_rows(each: GroupFindings) -> Iterator[dict[str, Any]]:
    """One line of the CSV for each estimator of a group."""
    group, n_axes = each.group, each.group.scenario_run.target.n_axes
    sent, limit = each.bytes_per_frame(), Results(group.scenario_run).lost_error
    for track in _TRACKS:
        if not each.has(track):
            continue
        runs, errors = each.rmse(track), each.scored(track)
        interval = mean_interval(runs)
        lost = [any(is_lost(node, limit) for node in run) for run in errors]
        nees = each.nees(track)[:, :, 1:]
        yield {
            "study": group.study,
            "scenario": group.scenario,
            "preset": group.preset,
            **each.settings,
            "estimator": "best single" if track == "single" else "cpf jpeg" if track == "coded" else track,
            "unit": each.unit,
            "runs": len(runs),
            "rmse_mean": f"{interval.value:.5f}",
            "rmse_low95": f"{interval.low:.5f}",
            "rmse_high95": f"{interval.high:.5f}",
            "rmse_deviation": f"{np.std(runs, ddof=1) if len(runs) > 1 else 0.0:.5f}",
            "rmse_median": f"{np.median(runs):.5f}",
            "rmse_worst": f"{runs.max():.5f}",
            "lost_fraction": f"{np.mean(lost):.3f}",
            "ospa": f"{np.mean([ospa(node, limit) for run in errors for node in run]):.5f}",
            "gospa": f"{np.sqrt(np.mean([gospa(node, limit) ** 2 for run in errors for node in run])):.5f}",
            "anees": f"{np.nanmean(nees) / n_axes:.4f}",
            "bytes_per_frame": f"{sent.get('jpeg' if track == 'coded' else track, 0.0):.0f}",
        }


def _timing(each: GroupFindings) -> dict[str, Any]:
    kinds = each.results[0].keys()
    return {f"{kind}_cpu_ms_per_frame": each.cpu_ms(kind).round(3).tolist() for kind in kinds}
