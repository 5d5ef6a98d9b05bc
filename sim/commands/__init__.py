"""The command line: what a person runs. Each command is a module; the work is done elsewhere."""

import os
import signal
import sys
import time
from typing import NoReturn

from sim.running.head_start import start_host

BEGAN_S = time.monotonic()
"""When the user's command began, before the imports that take their time."""


def main() -> NoReturn:
    """The `dcpf` script."""
    # What the commands need takes a second to import: until then, an interruption ends the process at once.
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number, handler in handlers.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, lambda *_: os._exit(130))
    if sys.argv[1:2] == ["run"] and not {"--in-process", "--help"} & set(sys.argv):
        start_host()
    from sim.commands import app

    for number, handler in handlers.items():
        signal.signal(number, handler)
    app.main()
