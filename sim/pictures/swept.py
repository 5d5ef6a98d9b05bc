"""What is swept, on paper: which lines a panel has, and what axes, ticks and legends call keys and values."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from sim.experiments.found.findings import GroupFindings, Track

AXES = {
    "filter.model_update.alpha": "model update α (Eq. 4)",
    "network.iterations": "rounds of consensus t",
    "filter.n_particles": "particles n",
    "network.graph": "communication graph",
    "network.conditions.loss": "probability that a message is lost",
    "cameras": "cameras",
}
"""What axes call the keys that are swept most; others go by their own name."""
_SHORT = {"filter.n_particles": "n", "network.iterations": "t", "filter.model_update.alpha": "α"}
_NEED_NAMES = ("true", "false", "null")
_LEAST_APART = 0.06  # of the axis: labels of ticks that are nearer run into each other


def lines_of(groups: Sequence[GroupFindings], track: Track) -> dict[str, list[GroupFindings]]:
    """The lines of an estimator by their labels: one without a label if the other keys do not concern it."""
    lines = {label: line for label, line in _by_other_keys(groups).items() if line[0].has(track)}
    found = [{g.group.settings[0]: tuple(g.rmse(track)) for g in line} for line in lines.values()]
    whole = max(found, key=len, default={})
    if len(lines) > 1 and all(each.items() <= whole.items() for each in found):
        return {"": list(lines.values())[found.index(whole)]}
    return lines


def from_to(groups: Sequence[GroupFindings]) -> str:
    """What a line goes along, for legends: from the first to the last value of the first swept key."""
    (name, first), (_, last) = (groups[end].group.settings[0] for end in (0, -1))
    return f"\n{_short(name)} = {first} to {last}"


def tick_labels(places: Float[np.ndarray, " S"], values: Sequence[str]) -> list[str]:
    """The labels of ticks, none where one would run into the one before."""
    labels, last = [], -np.inf
    for place, value in zip(places, values, strict=True):
        is_free = place - last >= _LEAST_APART * np.ptp(places)
        labels.append(value if is_free else "")
        last = place if is_free else last
    return labels


def places_of(values: Sequence[str]) -> tuple[Float[np.ndarray, " S"], bool]:
    """The values as numbers, or their places where they are words."""
    try:
        return np.array([float(value) for value in values]), True
    except ValueError:
        return np.arange(len(values), dtype=float), False


def _by_other_keys(groups: Sequence[GroupFindings]) -> dict[str, list[GroupFindings]]:
    """The groups with the same values of all swept keys but the first, by what legends call these values."""
    lines: dict[str, list[GroupFindings]] = {}
    for group in groups:
        label = "".join(f", {_in_words(name, value)}" for name, value in group.group.settings[1:])
        lines.setdefault(label, []).append(group)
    return lines


def _in_words(key: str, value: str) -> str:
    """A setting for a legend: words speak for themselves, numbers and yes or no need their name."""
    is_word = not places_of([value])[1] and value not in _NEED_NAMES
    return value.replace("_", " ") if is_word else f"{_short(key)} = {value}"


def _short(key: str) -> str:
    return _SHORT.get(key, key.rpartition(".")[2].replace("_", " "))
