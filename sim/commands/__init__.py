"""The command line: what a person runs. Each command is a module; the work is done elsewhere."""

import signal
import time
from typing import NoReturn

BEGAN_S = time.monotonic()
"""When the user's command began, before the imports that take their time."""


def main() -> NoReturn:
    """The `dcpf` script."""
    # What the commands need takes a second to import: until then, Ctrl-C ends the process without a word.
    interruptible = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if interruptible:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from sim.commands import app

    if interruptible:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    app.main()
