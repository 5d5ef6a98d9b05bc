"""What becomes of errors: one clear sentence and an exit code for what a user can put right, no traceback."""

import os
import sys
from collections.abc import Callable
from functools import wraps
from typing import Any, NoReturn

import typer
from rich.console import Console

from network.errors import NetworkError
from nodes.counting.build import KernelError
from nodes.imaging.sources import SourceError
from sim.experiments.computing.errors import EngineError
from sim.footage import FootageError
from sim.results.recorder import RecordingError
from sim.running.children import RunFailed
from sim.scenario.parsing import ScenarioError

USERS_ERRORS = (
    *(ScenarioError, NetworkError, SourceError, FootageError, RecordingError, EngineError),
    KernelError,
)
"""What the user can put right: exit code 2."""


def guarded(command: Callable[..., int | None]) -> Callable[..., None]:
    """A command whose result is its exit code and whose errors are sentences."""

    @wraps(command)
    def run(*arguments: Any, **options: Any) -> None:
        try:
            code = command(*arguments, **options)
        except USERS_ERRORS as error:
            _fail(str(error), 2)
        except RunFailed as error:
            _fail(str(error), 1)
        except KeyboardInterrupt:
            _fail("interrupted", 130)
        except BrokenPipeError:
            # Whoever read the output has heard enough; nothing more can be written there.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            code = 0
        except OSError as error:
            _fail(f"{error.filename or 'the output'}: {error.strerror}: make room, or name another place", 2)
        raise typer.Exit(code or 0)

    return run


def _fail(sentence: str, code: int) -> NoReturn:
    Console(stderr=True).print(f"dcpf: {sentence}", markup=False, highlight=False, soft_wrap=True)
    raise typer.Exit(code)
