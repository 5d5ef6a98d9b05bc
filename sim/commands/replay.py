"""`dcpf replay`: plays a recorded run through the keys that it had."""

import threading
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from sim.commands.shared import progress_bar


def replay(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="Folder of a run, or a recording (.mcap).", show_default=False),
    ],
    speed: Annotated[
        float, typer.Option(help="How many times faster than the run's own time.", min=0.01)
    ] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Begin again at the end.")] = False,
    listen: Annotated[
        str | None,
        typer.Option(
            metavar="ENDPOINT", help="Zenoh endpoint to listen on.", show_default="the run's router"
        ),
    ] = None,
) -> None:
    """Play a recorded run over Zenoh: estimates, truth, pictures, nodes that come and go."""
    # Zenoh and the formats of recordings take their time to import.
    from sim.recording.opening import open_recording
    from sim.recording.playback import Playback
    from sim.recording.replay import Replay

    recording = open_recording(run)
    endpoint = listen or recording.scenario.network.router
    playback = Playback(recording.frames, recording.scenario.rate_hz, loop=loop, speed=speed)
    player = Replay(recording, endpoint, playback)
    try:
        where = f"{recording.scenario.name}: {recording.frames} frames at {endpoint}; Ctrl-C ends"
        Console(stderr=True).print(where, highlight=False, markup=False, soft_wrap=True)
        with progress_bar(f"{recording.scenario.name}: frames", recording.frames) as bar:
            player.run(threading.Event(), bar, stay=False)
    finally:
        player.close()
