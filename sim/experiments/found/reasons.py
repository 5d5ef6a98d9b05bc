"""Why a figure does not show what it should: sentences that follow from the runs, each with its figures.

Of each claim the reasons are looked for in the order in which they would explain the others away: chance,
lost targets, and then what the filters do.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Bool, Float

from sim.experiments.found.findings import GroupFindings, Track
from sim.metrics.errors import is_lost
from sim.metrics.intervals import Interval, bootstrap, mean_interval, ratio_interval
from sim.results.results import Results, length

LITTLE = 0.1
"""Single cameras hardly depend on a key if their error changes by less than this part of it."""
ALIKE = 0.5
"""CPF does as DCPF does if it changes by at least this part; runs go together from this correlation on."""
APART = 2.0
"""Times as large as elsewhere: from where on an error counts as having grown."""


def why_not_flat(groups: Sequence[GroupFindings], allowed: float) -> Iterator[str]:
    """Why DCPF depends on a key.

    Args:
        groups: A group for each value of the key.
        allowed: By how much its mean RMSE may change.
    """
    unit, means = groups[0].unit, [float(group.rmse("dcpf").mean()) for group in groups]
    best, worst = groups[int(np.argmin(means))], groups[int(np.argmax(means))]
    change = mean_interval(worst.rmse("dcpf") - best.rmse("dcpf"))
    yield from _chance(
        change, allowed, len(best.results), f"{unit}, where {allowed:.3f} {unit} would be flat"
    )

    each = np.array([group.node_rmse("single").mean(axis=0) for group in groups])
    moved = float(np.mean(np.ptp(each, axis=0)) / each.mean())
    if moved < LITTLE:
        yield f"The single cameras hardly depend on it themselves: their errors change by {moved:.0%}."

    lost = np.array([_lost(group, "dcpf") for group in groups])
    n_best, n_worst = _lost(best, "dcpf").sum(), _lost(worst, "dcpf").sum()
    if n_worst > n_best:
        sentence = (
            f"DCPF loses the target in {n_worst} of {lost.shape[1]} runs at {_at(worst)}, in {n_best} at"
            f" {_at(best)}"
        )
        never = ~lost.any(axis=0)
        if never.any():
            kept = np.ptp([float(group.rmse("dcpf")[never].mean()) for group in groups])
            sentence += f"; over the runs that never lose it, {never.sum()}, it changes by {kept:.3f} {unit}"
        yield f"{sentence}."

    if groups[0].has("cpf"):
        central = np.ptp([float(group.rmse("cpf").mean()) for group in groups])
        is_alike = central >= ALIKE * np.ptp(means)
        also = f"CPF changes by {central:.3f} {unit}"
        yield f"It is not the network's doing: {also}, too." if is_alike else f"{also} only."

    frame = _apart_from(worst, best)
    if frame is not None:
        yield (
            f"At {_at(worst)} the median error is more than {APART:g} times that at {_at(best)} from frame"
            f" {frame} to the end."
        )


def why_not_within(groups: Sequence[GroupFindings], worst: GroupFindings, allowed: float) -> Iterator[str]:
    """Why DCPF is farther from CPF than it should be.

    Args:
        groups: Those of which it is claimed.
        worst: The one with the largest ratio.
        allowed: How many times CPF's error it may be.
    """
    ours, theirs = worst.rmse("dcpf"), worst.rmse("cpf")
    ratio = ratio_interval(ours, theirs)
    yield from _chance(ratio, allowed, len(ours), f"times CPF's, where {allowed:.2f} would do")

    lost, lost_by_cpf = _lost(worst, "dcpf"), _lost(worst, "cpf")
    if (lost & ~lost_by_cpf).any():
        sentence = f"DCPF loses the target in {lost.sum()} of {len(lost)} runs, CPF in {lost_by_cpf.sum()}"
        kept = ~(lost | lost_by_cpf)
        if kept.any():
            sentence += f"; where neither does, the ratio is {ours[kept].mean() / theirs[kept].mean():.2f}"
        yield f"{sentence}."

    # would more rounds help, and are the nodes one?
    line = [group for group in groups if group.group.settings[1:] == worst.group.settings[1:]]
    key, first = line[0].group.settings[0]
    last = line[-1].settings[key]
    change = float(line[-1].rmse("dcpf").mean() / line[0].rmse("dcpf").mean()) - 1
    if last != first:
        helps = "helps" if change <= 1 - allowed else "does not help"
        # whole per cent: none is neither more nor less
        yield f"More {helps}: from {key} = {first} to {last}, DCPF's error changes by {round(100 * change)}%."
    summaries = [run["cameras"]["summary"] for run in worst.results]
    apart = [known for each in summaries if (known := length(each, "disagreement")) is not None]
    excess = float(ours.mean() - theirs.mean())
    if apart and np.mean(apart) < ALIKE * excess:
        yield (
            f"The nodes agree on what is farther off: they differ by {np.mean(apart):.3f} {worst.unit}, and"
            f" CPF's error is {excess:.3f} {worst.unit} less."
        )

    indefinite = float(np.mean([each["fusion"]["indefinite_local_fraction"] for each in summaries]))
    if indefinite > 0:
        yield f"In {indefinite:.0%} of the local results, the ratio of Eq. 17 was no density."


def why_not_noisier(groups: Sequence[GroupFindings], few: str, many: str) -> Iterator[str]:
    """Why DCPF does not vary more from run to run with the one value of the second key than with the other.

    Args:
        groups: All groups of the study.
        few: The value that should vary more.
        many: The value that should vary less.
    """
    by_value = [[group for group in groups if group.group.settings[1][1] == value] for value in (few, many)]
    runs = np.array([[group.rmse("dcpf") for group in each] for each in by_value])  # value, setting, run

    # p = σ_few / (σ_few + σ_many) is in [0, 1] whatever is drawn; p = 1/2 where they are equal
    columns = runs.reshape(-1, runs.shape[2]).T
    found = bootstrap(columns, lambda drawn: _share(drawn.reshape(*drawn.shape[:2], 2, -1)))
    if found.low <= 0.5 <= found.high:
        yield (
            f"{runs.shape[2]} runs cannot tell: {found.value:.0%} of both deviations is that with {few} (95%:"
            f" {found.low:.0%} to {found.high:.0%}), equal ones have 50%."
        )

    lost = np.any([_lost(group, "dcpf") for each in by_value for group in each], axis=0)
    if lost.any():
        sentence = f"DCPF loses the target in {lost.sum()} of {len(lost)} runs, at one setting at least"
        if np.sum(~lost) > 1:
            few_kept, many_kept = deviations(runs[:, :, ~lost])
            sentence += f"; without these it deviates by {few_kept:.4f} and {many_kept:.4f} {groups[0].unit}"
        yield f"{sentence}."

    centred = runs - runs.mean(axis=2, keepdims=True)
    scale = float(np.sqrt(np.prod(np.sum(centred**2, axis=(1, 2)))))
    together = float(np.sum(centred[0] * centred[1])) / scale if scale > 0 else 0.0
    if together >= ALIKE:
        yield (
            f"Runs of the same seed go together (correlation {together:.2f}): what their pictures have in"
            " common outweighs the particles' own noise."
        )
    else:
        yield (
            f"Runs of the same seed do not go together (correlation {together:.2f}): it is not the pictures,"
            f" but the particles' own noise, which is not less with {many}."
        )


def deviations(runs: Float[np.ndarray, "V S R"]) -> Float[np.ndarray, " V"]:
    """Of each value, the standard deviation over the runs, pooled over the settings; needs two runs."""
    return np.sqrt(np.var(runs, axis=2, ddof=1).mean(axis=1))


def _share(drawn: Float[np.ndarray, "B R V S"]) -> Float[np.ndarray, " B"]:
    """The first value's part of both deviations; half of it where there are none."""
    few, many = np.sqrt(np.var(drawn, axis=1, ddof=1).mean(axis=2)).T
    both = few + many
    return np.divide(few, both, out=np.full_like(both, 0.5), where=both > 0)


def _chance(found: Interval, allowed: float, n_runs: int, what: str) -> Iterator[str]:
    if n_runs == 1:
        yield "One run cannot tell it from chance."
    elif found.low <= allowed:
        yield (
            f"{n_runs} runs cannot tell it from chance: 95% lie between {found.low:.3f} and {found.high:.3f}"
            f" {what}."
        )


def _lost(group: GroupFindings, track: Track) -> Bool[np.ndarray, " R"]:
    """Whether each run ends without the target, at some node."""
    limit = Results(group.group.scenario_run).lost_error
    return np.array([any(is_lost(node, limit) for node in run) for run in group.scored(track)])


def _apart_from(worse: GroupFindings, better: GroupFindings) -> int | None:
    """The frame from which on one group's median error is always `APART` times another's; None if none."""
    one, other = (np.nanmedian(group.errors("dcpf"), axis=(0, 1)) for group in (worse, better))
    near = np.flatnonzero(one <= APART * other)
    first = 1 + (int(near[-1]) + 1 if near.size else 0)  # errors begin with frame 1
    return first if first <= len(one) else None


def _at(group: GroupFindings) -> str:
    return ", ".join(f"{name} = {value}" for name, value in group.group.settings)
