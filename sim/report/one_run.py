"""One run of an experiment, told again with its pictures: cells keep where estimates were, and no more."""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from network.wire.messages import PreviewMessage
from nodes.imaging.sources import SourceError
from sim.assembly import Assembly
from sim.experiments.found.findings import Findings, GroupFindings
from sim.report.elements import ShownRun
from sim.report.run_tables import links_table
from sim.report.stills import drawn_in, moments_by, moments_of
from sim.results.provenance import sent_per_frame
from sim.results.results import Results, summarize
from sim.running.in_process import run_in_process

LIMIT_BYTES = 1_000_000
"""All pictures of an experiment's page together; its figures need more room than a run's."""


def plainest(findings: Findings) -> list[GroupFindings]:
    """Of each scenario the group in which least is swept, the last of them."""
    names = list(dict.fromkeys(each.group.scenario for each in findings.groups))
    return [
        min(
            (each for each in reversed(findings.groups) if each.group.scenario == name),
            key=lambda each: len(each.settings),
        )
        for name in names
    ]


def shown_runs(groups: Sequence[GroupFindings]) -> list[ShownRun]:
    """The first run of each group; none of those whose pictures are on other machines only."""
    shown = []
    for each in groups:
        with suppress(SourceError):
            shown.append(_shown(each, LIMIT_BYTES // len(groups)))
    return shown


def _shown(each: GroupFindings, limit_bytes: int) -> ShownRun:
    scenario = each.group.scenario_run
    # The network and CPF know nothing of each camera's own filter.
    baselines = scenario.baselines.model_copy(update={"single": False})
    assembly = Assembly(scenario.model_copy(update={"baselines": baselines}))
    results = Results(assembly.scenario)
    errors = each.node_errors("dcpf")[0] if each.has("dcpf") else np.empty(0)
    why = moments_by(scenario.frames - 1, errors)
    previews: dict[int, dict[str, PreviewMessage]] = {frame: {} for frame in why}
    for message in run_in_process(assembly, watched=True, with_visibility=False):
        results.add(message)
        if isinstance(message, PreviewMessage) and message.frame in previews:
            previews[message.frame][message.node] = message
    summary = {**summarize(results, processes=1), "sent_per_frame": sent_per_frame(results)}
    return ShownRun(
        title=f"{each.group.label}, seed {scenario.seed}",
        settings=", ".join(f"{key} = {value}" for key, value in each.group.settings),
        moments=moments_of(results, assembly, previews, why, limit_bytes),
        shown=drawn_in(results),
        links=links_table(results, assembly, summary),
    )
