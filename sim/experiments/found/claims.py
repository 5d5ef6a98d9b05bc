"""Whether the figures show what they should: a sentence for each claim, with what was measured."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.experiments.found.findings import Findings, GroupFindings
from sim.experiments.found.reasons import deviations, why_not_flat, why_not_noisier, why_not_within
from sim.experiments.options import Claim, FlatClaim, NoisierClaim, WithinClaim
from sim.metrics.intervals import ratio_interval

Found = tuple[bool | None, str, Sequence[str]]
"""Whether a claim holds, what was measured, and why it does not hold if it does not."""

FLAT = 0.25
"""DCPF counts as flat if its mean error changes by at most this part of what the single cameras' does."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """A claim held against what was measured.

    Attributes:
        study: The study.
        label: Scenario and preset.
        claim: Which claim.
        holds: Whether it holds; None if these runs cannot say.
        text: What was measured, and why it does not hold if it does not.
    """

    study: str
    label: str
    claim: str
    holds: bool | None
    text: str

    @property
    def in_words(self) -> str:
        """Whether it holds, for people."""
        return {True: "holds", False: "does not hold", None: "cannot be judged"}[self.holds]


def judge(findings: Findings) -> list[Verdict]:
    """Every claim of an experiment, for each scenario and preset, of studies of which all runs are there."""
    verdicts = []
    for name, study in findings.options.studies.items():
        if findings.missing[name]:
            continue
        for label in findings.labels(name):
            groups = findings.study(name, label)
            for claim in study.claims:
                holds, text, reasons = _measure(claim, groups)
                why = " ".join(["Why:", *reasons]) if reasons else ""
                verdicts.append(Verdict(name, label, claim.kind, holds, f"{text} {why}".strip()))
    return verdicts


def _measure(claim: Claim, groups: Sequence[GroupFindings]) -> Found:
    match claim:
        case FlatClaim():
            return _flat(groups)
        case WithinClaim():
            return _within(groups, claim)
        case NoisierClaim():
            return _noisier(groups)


def _flat(groups: Sequence[GroupFindings]) -> Found:
    key, unit = groups[0].group.settings[0][0], groups[0].unit
    if len({group.node_rmse("single").shape[1] for group in groups}) > 1:
        return None, f"over {key}, the cameras are not the same ones: a single one cannot be followed.", []
    ours = _range([float(group.rmse("dcpf").mean()) for group in groups])
    best = _range([float(group.rmse("single").mean()) for group in groups])
    each = np.array([group.node_rmse("single").mean(axis=0) for group in groups])
    single = float(np.mean(each.max(axis=0) - each.min(axis=0)))
    text = (
        f"over {key}, DCPF's mean RMSE changes by {ours:.3f} {unit}, a single camera's by {single:.3f} {unit}"
        f" in the mean (the best one's by {best:.3f} {unit})."
    )
    holds = ours <= FLAT * single
    return holds, text, [] if holds else [*why_not_flat(groups, FLAT * single)]


def _within(groups: Sequence[GroupFindings], claim: WithinClaim) -> Found:
    key = groups[0].group.settings[0][0]
    last = [group for group in groups if float(group.settings[key]) >= claim.from_value]
    if not last:
        return None, f"{key} has no value from {claim.from_value:g} on.", []
    ratios = {group: ratio_interval(group.rmse("dcpf"), group.rmse("cpf")) for group in last}
    worst = max(ratios, key=lambda group: ratios[group].value)
    found, allowed = ratios[worst], 1 + claim.percent / 100
    where = ", ".join(f"{name} = {value}" for name, value in worst.group.settings)
    text = (
        f"from {key} = {claim.from_value:g} on, DCPF's mean RMSE is at most {found.value:.2f} times CPF's"
        f" (95%: {found.low:.2f} to {found.high:.2f}, at {where})."
    )
    holds = found.value <= allowed
    return holds, text, [] if holds else [*why_not_within(last, worst, allowed)]


def _noisier(groups: Sequence[GroupFindings]) -> Found:
    key, unit = groups[0].group.settings[1][0], groups[0].unit
    few, *_, many = list(dict.fromkeys(group.settings[key] for group in groups))
    if len(groups[0].results) == 1:
        return None, "one run has no deviation.", []
    runs = [[g.rmse("dcpf") for g in groups if g.settings[key] == value] for value in (few, many)]
    deviates = deviations(np.array(runs))
    text = (
        f"DCPF's RMSE deviates from run to run by {deviates[0]:.4f} {unit} with {key} = {few}, by"
        f" {deviates[1]:.4f} {unit} with {many}."
    )
    holds = bool(deviates[0] > deviates[1])
    return holds, text, [] if holds else [*why_not_noisier(groups, few, many)]


def _range(values: Sequence[float]) -> float:
    return max(values) - min(values)


def as_data(verdicts: Sequence[Verdict]) -> list[Mapping[str, Any]]:
    """Verdicts as plain data."""
    return [{name: getattr(each, name) for name in Verdict.__slots__} for each in verdicts]
