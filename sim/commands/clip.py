"""`dcpf clip`: a moving picture of a run."""

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from sim.assembly import Assembly
from sim.commands.shared import progress_bar
from sim.results.recorder import RecordingError, read_run


def clip(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="Folder of a run, or a recording (.mcap).", show_default=False),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="The file, .webp, .gif or .mp4.", show_default="clip.webp beside the run"),
    ] = None,
    width: Annotated[int, typer.Option(help="Width in pixels.", min=320, max=3840)] = 960,
    fps: Annotated[float, typer.Option(help="Pictures a second.", min=1, max=50)] = 10,
) -> None:
    """Make a moving picture of a run: what each camera saw, the map, and the error."""
    # OpenCV's encoders, the drawing, and the formats of recordings are for this command only.
    from sim.pictures.clip import make_clip

    with ExitStack() as stack:
        if run.suffix == ".mcap":
            from sim.recording.filmed import opened

            results, assembly = stack.enter_context(opened(run))
        else:
            results = read_run(run)
            assembly = Assembly(results.scenario)
        path = out or (run.parent if run.suffix == ".mcap" else run) / "clip.webp"
        bar = stack.enter_context(progress_bar("clip: frames", results.scenario.frames))
        try:
            make_clip(results, assembly, path, width_px=width, fps=fps, progress=lambda done, _: bar(done))
        except (OSError, ValueError) as error:
            raise RecordingError(f"{path}: the clip cannot be written: {error}") from error
    Console(highlight=False).print(str(path), soft_wrap=True)
