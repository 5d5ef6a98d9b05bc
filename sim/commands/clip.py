"""`dcpf clip`: a moving picture of a run."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from sim.assembly import Assembly
from sim.commands.shared import progress_bar
from sim.running.recorder import RecordingError, read_run


def clip(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option(help="The file, .webp or .gif.", show_default="clip.webp in the folder")
    ] = None,
    width: Annotated[int, typer.Option(help="Width in pixels.", min=320, max=3840)] = 960,
    fps: Annotated[float, typer.Option(help="Pictures a second.", min=1, max=50)] = 10,
) -> None:
    """Make a moving picture of a run: what each camera saw, the map, and the error."""
    results = read_run(run)
    # OpenCV's encoders and the drawing are for this command only.
    from sim.pictures.clip import make_clip

    path = out or run / "clip.webp"
    with progress_bar("clip: frames", results.scenario.frames) as bar:
        try:
            make_clip(
                results,
                Assembly(results.scenario),
                path,
                width_px=width,
                fps=fps,
                progress=lambda done, _: bar(done),
            )
        except (OSError, ValueError) as error:
            raise RecordingError(f"{path}: the clip cannot be written: {error}") from error
    Console(highlight=False).print(str(path), soft_wrap=True)
