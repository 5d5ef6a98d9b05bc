"""What commands have in common: options that several take, scenarios with their overrides, tables."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from nodes.setup import FilterOptions
from nodes.threads import n_cores, n_shares
from nodes.vision.observation import LEAST_BOXES
from sim.scenario.advice import advice
from sim.scenario.loading import load_scenario
from sim.scenario.model import Scenario
from sim.scenario.parsing import ScenarioError

ScenarioPath = Annotated[
    Path, typer.Argument(metavar="SCENARIO", help="The scenario file.", show_default=False)
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Set any key of the scenario, such as filter.n_particles=300."
    ),
]
Seed = Annotated[int | None, typer.Option(help="Seed in place of the scenario's.", min=0, show_default=False)]
Frames = Annotated[
    int | None, typer.Option(help="Frames in place of the scenario's.", min=2, show_default=False)
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]


def read_scenario(
    path: Path,
    overrides: list[str] | None,
    *,
    seed: int | None = None,
    frames: int | None = None,
    pace: str | None = None,
    name: str | None = None,
    rendered: bool = True,
) -> Scenario:
    """A scenario with what the command line says instead.

    Raises:
        ScenarioError: The file or an override is not as it must be.
        KernelError: It wants the compiled kernel, and this machine cannot have it.
    """
    given = {"seed": seed, "frames": frames, "pace": pace, "name": name}
    chosen = [(key, str(value)) for key, value in given.items() if value is not None]
    scenario = load_scenario(path, [*split_overrides(overrides), *chosen], rendered=rendered)
    if rendered:
        require_backend(scenario)
        _say_of_threads(scenario.filter)
    return scenario


def require_backend(scenario: Scenario) -> None:
    """Fails before anything starts where this machine, or the emulated one, cannot run the filter."""
    if scenario.filter.backend != "fast":
        from sim.assembly import Assembly

        assembly = Assembly(scenario)
        assembly.require_backend()
        if scenario.filter.backend == "simd":
            assembly.try_array()


def _say_of_threads(options: FilterOptions) -> None:
    """Says on stderr where threads would lose, and are not used."""
    n, wanted = options.n_particles, options.threads
    used = n_shares(n, wanted, LEAST_BOXES)
    if used < wanted:
        few = f"fewer than {LEAST_BOXES:,} particles a thread would lose time, and there are {n:,}"
        reason = few if n // LEAST_BOXES < n_cores() else "this process may use no more cores"
        Console(stderr=True).print(
            f"filter.threads is {wanted}, and {used} will be used: {reason}",
            highlight=False,
            soft_wrap=True,
        )


def split_overrides(overrides: list[str] | None) -> list[tuple[str, str]]:
    """Keys and values of `--set` options.

    Raises:
        ScenarioError: One has no `=`.
    """
    for each in overrides or []:
        if "=" not in each:
            raise ScenarioError(f"--set {each}: has no =: write it like filter.n_particles=300")
    return [(key, value) for key, _, value in (each.partition("=") for each in overrides or [])]


@contextmanager
def progress_bar(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """A bar on stderr for long work, with the time left; it is told how much is done."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(what, total=total)
        yield lambda done: progress.update(task, completed=done)


def tell_advice(scenario: Scenario) -> None:
    """Says on stderr what the scenario may not be meant to say."""
    console = Console(stderr=True, highlight=False)
    for sentence in advice(scenario):
        console.print(f"dcpf: {scenario.name}: {sentence}", markup=False, soft_wrap=True)


def length_text(value: float | None, unit: str) -> str:
    """A length for a table: to a millimetre, or to a tenth of a pixel."""
    return "–" if value is None else f"{value:.{1 if unit == 'px' else 3}f} {unit}"


def yes_no(value: bool | None) -> str:
    """A fact for a table."""
    return "–" if value is None else "yes" if value else "no"
