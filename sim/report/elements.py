"""What a report is made of: tables, plots, and pictures, ready for the page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup


@dataclass(frozen=True, slots=True)
class Table:
    """A table whose first column names the rows.

    Attributes:
        caption: What it is.
        headings: Of the columns, with units.
        rows: Cells as text.
        note: What is said below it.
    """

    caption: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


@dataclass(frozen=True, slots=True)
class Plot:
    """A drawing.

    Attributes:
        drawing: As SVG.
        caption: What it shows.
        wide: Whether it has several panels beside each other: on a narrow screen it is then scrolled.
    """

    drawing: Markup
    caption: str
    wide: bool = False


@dataclass(frozen=True, slots=True)
class Still:
    """A picture of a camera.

    Attributes:
        source: The picture, as a data URI.
        width_px: Its width.
        height_px: Its height.
        text: What it shows, in words.
    """

    source: str
    width_px: int
    height_px: int
    text: str


@dataclass(frozen=True, slots=True)
class Moment:
    """The pictures of all cameras at one frame.

    Attributes:
        frame: The frame.
        why: Why this one.
        stills: The pictures.
    """

    frame: int
    why: str
    stills: Sequence[Still]


@dataclass(frozen=True, slots=True)
class RunReport:
    """What the page of a run shows; what there is nothing to say of is empty.

    Attributes:
        name: Of the run.
        facts: What was run.
        versions: What it was run with.
        notes: What the reader must know first, such as nodes that died.
        figures: The table of figures.
        errors: Errors over the frames.
        places: World and paths.
        moments: Pictures of the cameras.
        shown: What is drawn in them: `dcpf`, `cpf`, `truth`.
        network: Plots of how the cameras agree.
        messages: What became of the messages of the rounds.
        events: Who was lost, and came back.
        links: Bytes and messages of each link.
        timing: How long it took.
        array: What a frame costs on a camera's emulated array.
        scenario: The scenario as run, YAML.
    """

    name: str
    facts: Mapping[str, str]
    versions: Mapping[str, str]
    notes: Sequence[str]
    figures: Table
    errors: Sequence[Plot]
    places: Sequence[Plot]
    moments: Sequence[Moment]
    shown: Sequence[str]
    network: Sequence[Plot]
    messages: Table | None
    events: Table | None
    links: Table | None
    timing: Table | None
    array: Table | None
    scenario: str


@dataclass(frozen=True, slots=True)
class StudyReport:
    """What the page shows of one study.

    Attributes:
        title: What it is about.
        plot: Its figure.
        claims: What it should show: whether it does, and what was measured.
        figures: Its figures as numbers, a table for each scenario and preset.
    """

    title: str
    plot: Plot
    claims: Sequence[tuple[str, str]]
    figures: Sequence[Table]


@dataclass(frozen=True, slots=True)
class ShownRun:
    """One run of an experiment, with its pictures.

    Attributes:
        title: Scenario, preset and seed.
        settings: What is swept in the experiment, and its values here.
        moments: Pictures of the cameras.
        shown: What is drawn in them: `dcpf`, `cpf`, `truth`.
        links: Bytes and messages of each link.
    """

    title: str
    settings: str
    moments: Sequence[Moment]
    shown: Sequence[str]
    links: Table | None


@dataclass(frozen=True, slots=True)
class ExperimentReport:
    """What the page of an experiment shows.

    Attributes:
        name: Of the experiment.
        facts: What was run.
        versions: What it was run with.
        notes: What the reader must know first, such as runs that are missing.
        worlds: Where it takes place.
        studies: What was found.
        runs: One run of each scenario that some study has as it is; else of each.
        fingerprint: What the page is known by.
    """

    name: str
    facts: Mapping[str, str]
    versions: Mapping[str, str]
    notes: Sequence[str]
    worlds: Sequence[Plot]
    studies: Sequence[StudyReport]
    runs: Sequence[ShownRun]
    fingerprint: str
