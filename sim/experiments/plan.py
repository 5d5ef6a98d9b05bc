"""From an experiment to everything that has to be computed: its studies, groups of runs, and parts."""

import itertools
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from sim.experiments.computing.parts import Kind, Part, cameras_part, central_part
from sim.experiments.options import ExperimentOptions, StudyOptions, read_experiment
from sim.experiments.sweeps import as_text, require_key, texts
from sim.scenario.document import Document, read_document
from sim.scenario.loading import resolve
from sim.scenario.model import Scenario
from sim.scenario.parsing import ScenarioError

Setting = tuple[str, str]
"""A dotted key and its value as text."""


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """The runs of one scenario with one setting, a seed each.

    Attributes:
        study: The study that it belongs to.
        label: Scenario and preset in words, the same for all settings.
        scenario: The scenario's name.
        preset: Its preset.
        settings: The swept keys and their values.
        seeds: Of the runs.
        parts: What each run consists of.
        scenario_run: The resolved scenario of the first run.
    """

    study: str
    label: str
    scenario: str
    preset: str
    settings: tuple[Setting, ...]
    seeds: tuple[int, ...]
    parts: tuple[Mapping[Kind, Part], ...]
    scenario_run: Scenario


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """An experiment, resolved.

    Attributes:
        options: The experiment.
        groups: Its groups of runs, study by study.
    """

    options: ExperimentOptions
    groups: tuple[Group, ...]

    def parts(self) -> list[Part]:
        """Every part once, those that share their pictures side by side."""
        parts = {part.key: part for group in self.groups for run in group.parts for part in run.values()}
        alike: dict[str, list[Part]] = {}
        for part in parts.values():
            alike.setdefault(part.pictures, []).append(part)
        return list(itertools.chain.from_iterable(alike.values()))


def plan_experiment(document: Document, overrides: Sequence[Setting] = (), runs: int | None = None) -> Plan:
    """Resolves an experiment file.

    Args:
        document: The file.
        overrides: Keys and values set in all scenarios, over what the experiment sets.
        runs: Seeds of each setting, in place of the file's.

    Raises:
        ScenarioError: It, a scenario, key or value is not as it must be.
    """
    options = read_experiment(document)
    if runs is not None:
        options = options.model_copy(update={"runs": runs})
    return make_plan(
        options,
        document.path.parent,
        overrides,
        lambda *at: document.place(("studies", at[0], "sweep", at[1])),
    )


def make_plan(
    options: ExperimentOptions,
    folder: Path,
    overrides: Sequence[Setting],
    place: Callable[[str, str], str],
) -> Plan:
    """Resolves an experiment.

    Args:
        options: The experiment.
        folder: What its scenarios' paths are relative to.
        overrides: Keys and values set in all scenarios, over what the experiment sets.
        place: Where a study's swept key was written, for errors.

    Raises:
        ScenarioError: A scenario, key or value is not as it must be.
    """
    groups: list[Group] = []
    for name, study in options.studies.items():
        fixed = [(key, as_text(value)) for key, value in {**options.set, **study.set}.items()]
        labels: dict[str, Path] = {}
        for path, preset in itertools.product(
            study.scenarios or options.scenarios, study.presets or options.presets or (None,)
        ):
            document = read_document(folder / path)
            chosen = [("preset", preset)] if preset else []
            given = [*chosen, *fixed, *overrides]
            _check_keys(name, study, document, given, place)
            for settings in _settings(name, study, place):
                scenarios = _of_seeds(document, [*given, *_in_file(settings, document)], options.runs)
                scenario = scenarios[0]
                label = f"{scenario.name} ({scenario.preset})"
                if labels.setdefault(label, document.path) != document.path:
                    label = f"{document.path} ({scenario.preset})"
                parts = tuple(_parts(each, study) for each in scenarios)
                seeds = tuple(each.seed for each in scenarios)
                groups.append(
                    Group(name, label, scenario.name, scenario.preset, settings, seeds, parts, scenario)
                )
    return Plan(options, tuple(groups))


def _check_keys(
    name: str,
    study: StudyOptions,
    document: Document,
    given: Iterable[Setting],
    place: Callable[[str, str], str],
) -> None:
    resolved = resolve(document, given).model_dump(mode="json")
    for key, value in given:
        document = document.with_value(key, value)
    for key in study.sweep:
        require_key(key, [document.data, resolved], place(name, key))


def _settings(
    name: str, study: StudyOptions, place: Callable[[str, str], str]
) -> Iterator[tuple[Setting, ...]]:
    """Every combination of the values of a study's keys."""
    axes = [
        [(key, value) for value in texts(values, place(name, key))] for key, values in study.sweep.items()
    ]
    return itertools.product(*axes)


def _in_file(settings: Iterable[Setting], document: Document) -> Iterator[Setting]:
    """The settings as the scenario file would have them: so many cameras are the first so many."""
    for key, value in settings:
        if key == "cameras" and value.isdecimal():
            cameras = document.data["cameras"]
            if not 1 <= int(value) <= len(cameras):
                raise ScenarioError(
                    f"{document.path}: has {len(cameras)} cameras, not {value}: sweep cameras up to that"
                )
            yield key, json.dumps(cameras[: int(value)])
        else:
            yield key, value


def _of_seeds(document: Document, overrides: Sequence[Setting], runs: int) -> list[Scenario]:
    """The scenario with its own seed and those after it, resolved."""
    for key, value in overrides:
        document = document.with_value(key, value)
    first = resolve(document)
    seeds = range(first.seed + 1, first.seed + runs)
    network = document.data.get("network")
    if isinstance(network, Mapping) and isinstance(network.get("graph"), Mapping):
        # A graph that is drawn at random is another one for each seed.
        return [first, *(resolve(document, [("seed", str(seed))]) for seed in seeds)]
    # Nothing else that is resolved depends on the seed.
    return [first, *(first.model_copy(update={"seed": seed}) for seed in seeds)]


def _parts(scenario: Scenario, study: StudyOptions) -> dict[Kind, Part]:
    wanted = set(study.estimators)
    with_single = scenario.baselines.single and "single" in wanted
    parts: dict[Kind, Part] = {}
    if wanted & {"dcpf", "single"}:
        parts["cameras"] = cameras_part(scenario, with_single=with_single)
    if scenario.baselines.cpf and "cpf" in wanted:
        parts["central"] = central_part(scenario)
        if study.jpeg_quality is not None:
            parts["coded"] = central_part(scenario, study.jpeg_quality)
    return parts
