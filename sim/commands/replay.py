"""`dcpf replay`: plays a recorded run through the keys that it had."""

import threading
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Annotated

import typer

from sim.assembly import Assembly
from sim.commands.live import DEFAULT_PORT, LOOPBACK, Bind, Live, Port, page, say
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
    live: Live = False,
    port: Port = DEFAULT_PORT,
    bind: Bind = LOOPBACK,
) -> None:
    """Play a recorded run over Zenoh: estimates, truth, pictures, nodes that come and go."""
    # Zenoh and the formats of recordings take their time to import.
    from sim.recording.opening import open_recording
    from sim.recording.playback import Playback
    from sim.recording.replay import Replay

    with closing(open_recording(run)) as recording, ExitStack() as stack:
        scenario = recording.scenario
        endpoint = listen or scenario.network.router
        playback = Playback(recording.frames, scenario.rate_hz, loop=loop, speed=speed)
        player = stack.enter_context(closing(Replay(recording, endpoint, playback)))
        say(f"{scenario.name}: {recording.frames} frames at {endpoint}; Ctrl-C ends")
        audience = None
        if live:
            server = stack.enter_context(page(Assembly(scenario), endpoint, (bind, port), player.steered))
            audience = server.wait_for_audience
        bar = stack.enter_context(progress_bar(f"{scenario.name}: frames", recording.frames))
        player.run(threading.Event(), bar, audience)
