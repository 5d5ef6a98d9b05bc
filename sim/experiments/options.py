"""The experiment file: which scenarios, what is swept, what is drawn, and what the figure should show."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PositiveInt, model_validator

from network.options import Options
from network.wire.keys import check_name
from sim.scenario.complaints import validate
from sim.scenario.document import Document
from sim.scenario.presets import PresetName

Name = Annotated[str, AfterValidator(check_name)]
Estimator = Literal["dcpf", "cpf", "single"]
Values = str | tuple[Any, ...]


class FlatClaim(Options):
    """DCPF hardly depends on the swept key, where the single camera does."""

    kind: Literal["flat"]


class WithinClaim(Options):
    """DCPF's error is within some per cent of CPF's, from a value of the swept key on."""

    kind: Literal["within"]
    percent: float = Field(default=5.0, gt=0)
    """The per cent."""
    from_value: float
    """The value of the study's first key from which it holds."""


class NoisierClaim(Options):
    """DCPF's error varies more between runs with the first value of the second swept key than the last."""

    kind: Literal["noisier"]


Claim = Annotated[FlatClaim | WithinClaim | NoisierClaim, Field(discriminator="kind")]


class StudyOptions(Options):
    """One figure: some scenarios, swept over some keys."""

    title: str = ""
    """What the figure shows, in a few words."""
    plot: Literal["error", "paths", "frames", "bytes", "time", "strips"] = "error"
    """`error`: RMSE over the first swept key, a line for each value of the others; `paths`: trajectories on
    the ground; `frames`: the error over time; `bytes`: RMSE over the bytes sent a frame, with such lines;
    `time`: RMSE over processor time; `strips`: a point a run."""
    sweep: Mapping[str, Values] = Field(default={}, max_length=3)
    """Dotted keys of the scenario with their values: `0:0.5:0.1`, `1:20` (the last included), `a,b,c`, or a
    list. A number as the value of `cameras` takes the first so many."""
    set: Mapping[str, Any] = Field(default={})
    """Dotted keys of the scenario that this study sets, after the experiment's own."""
    estimators: tuple[Estimator, ...] = Field(default=("dcpf", "cpf", "single"), min_length=1)
    """Whom to run."""
    scenarios: tuple[str, ...] = ()
    """Other scenarios than the experiment's, relative to this file."""
    presets: tuple[PresetName, ...] = ()
    """Other presets than the experiment's."""
    jpeg_quality: int | None = Field(default=None, ge=1, le=100)
    """If given, CPF also runs on pictures that were sent as JPEG of this quality; the bytes of these, and of
    the pictures as bin indices in PNG, are counted too."""
    claims: tuple[Claim, ...] = ()
    """What the figure should show; said beside it with the figures measured, and whether it does."""

    @model_validator(mode="after")
    def _plot_has_its_axis(self) -> "StudyOptions":
        if self.plot in {"error", "bytes", "time"} and not self.sweep:
            raise ValueError(
                f"the plot {self.plot} is over a swept key: give sweep one, such as network.iterations"
            )
        if self.plot in {"paths", "frames"} and self.sweep:
            raise ValueError(
                f"the plot {self.plot} shows one setting: take sweep out, and set the keys instead"
            )
        return self

    @model_validator(mode="after")
    def _claims_can_be_judged(self) -> "StudyOptions":
        for claim in self.claims:
            needed = 2 if claim.kind == "noisier" else 1
            others = {"flat": {"dcpf", "single"}, "within": {"dcpf", "cpf"}, "noisier": {"dcpf"}}[claim.kind]
            if len(self.sweep) < needed or not others <= set(self.estimators):
                names = " and ".join(sorted(others))
                raise ValueError(
                    f"the claim {claim.kind} needs {needed} swept keys and the estimators {names}"
                )
        return self


class ExperimentOptions(Options):
    """An experiment for `dcpf compare`: studies over scenarios, several seeds each."""

    name: Name
    """Name of the experiment, and of its main figure."""
    runs: PositiveInt = 10
    """Seeds of each setting, from the scenario's own on; the same for all estimators."""
    scenarios: tuple[str, ...] = Field(min_length=1)
    """Scenario files, relative to this file."""
    presets: tuple[PresetName, ...] = ()
    """Presets to run each scenario with; the scenario's own if none is named."""
    set: Mapping[str, Any] = Field(default={})
    """Dotted keys of the scenario to set in all studies."""
    page: tuple[str, ...] = ()
    """Studies that make one figure together: a row each, a column a scenario, a file a preset."""
    studies: Mapping[Name, StudyOptions] = Field(min_length=1)
    """What to find out, by name."""

    @model_validator(mode="after")
    def _page_of_studies(self) -> "ExperimentOptions":
        for name in self.page:
            if name not in self.studies:
                raise ValueError(
                    f"page names {name}, which is no study: take some of {', '.join(self.studies)}"
                )
        return self


def is_experiment(document: Document) -> bool:
    """Whether a file is an experiment; else it is a scenario."""
    return "studies" in document.data


def read_experiment(document: Document) -> ExperimentOptions:
    """The experiment that a file holds.

    Raises:
        ScenarioError: It is not as it must be; one line for each problem, with its place and the remedy.
    """
    return validate(document, ExperimentOptions)
