"""`dcpf replay`: plays a recorded run through the keys that it had."""

from contextlib import ExitStack, closing
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from sim.assembly import Assembly
from sim.commands.live import DEFAULT_PORT, LOOPBACK, Bind, Live, Port, page, say
from sim.commands.shared import progress_bar
from sim.replay.playback import MAX_SPEED, Playback
from sim.results.recorder import RecordingError


def replay(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="Folder of a run, or a recording (.mcap).", show_default=False),
    ],
    speed: Annotated[float, typer.Option(help="Times the run's own time.", min=0.01, max=MAX_SPEED)] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Begin again at the end.")] = False,
    listen: Annotated[
        str | None,
        typer.Option(
            metavar="ENDPOINT", help="Zenoh endpoint to listen on.", show_default="the run's router"
        ),
    ] = None,
    rerun: Annotated[
        bool, typer.Option("--rerun", help="Open it in Rerun instead (extra: pip install 'dcpf[rerun]').")
    ] = False,
    live: Live = False,
    port: Port = DEFAULT_PORT,
    bind: Bind = LOOPBACK,
) -> None:
    """Play a recorded run over Zenoh: estimates, truth, pictures, nodes that come and go."""
    if rerun:
        _open_in_rerun(run)
        return
    # Zenoh and the formats of recordings take their time to import.
    from sim.replay.opening import open_recording
    from sim.replay.player import Replay

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
        player.run(bar, audience)


def _open_in_rerun(run: Path) -> None:
    if find_spec("rerun") is None:
        raise RecordingError("Rerun is not installed: pip install 'dcpf[rerun]'")
    from sim.recording.rerun_viewer import view
    from sim.replay.opening import film_of

    view(film_of(run))
