"""What `--live` of `dcpf run` and `dcpf replay` have in common: the page, its address, and who looks."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from sim.assembly import Assembly

if TYPE_CHECKING:
    from sim.live.server import LiveServer, Steer

AUDIENCE_S = 15.0
"""How long a run waits for somebody to open its page."""

DEFAULT_PORT = 8080
LOOPBACK = "127.0.0.1"
Live = Annotated[bool, typer.Option("--live", help="Show it in a browser, on a page of this machine.")]
Port = Annotated[int, typer.Option(help="Port of the page; 0 takes a free one.", min=0, max=65535)]
Bind = Annotated[
    str, typer.Option(metavar="ADDRESS", help="Address of the page; 0.0.0.0 shows it to others.")
]


@contextmanager
def page(
    assembly: Assembly, endpoint: str, address: tuple[str, int], steer: "Steer | None" = None
) -> Iterator["LiveServer"]:
    """Serves the page of a run.

    Raises:
        NetworkError: The port cannot be had.
    """
    # A web server and Zenoh are for those who look.
    from sim.live.server import LiveServer
    from sim.live.story import Story

    server = LiveServer(Story(assembly, recorded=steer is not None), address, steer)
    try:
        server.start(endpoint, assembly.scenario.name)
        say(f"live at {server.url}")
        yield server
    finally:
        server.close()


def say(words: str) -> None:
    """A line for people, on stderr."""
    Console(stderr=True).print(words, highlight=False, markup=False, soft_wrap=True)


def wait_for_audience(server: "LiveServer") -> None:
    """Waits for a browser; after some seconds the run goes on without."""
    say(f"the frames start when the page is open, or in {AUDIENCE_S:.0f} s")
    server.wait_for_audience(AUDIENCE_S)
