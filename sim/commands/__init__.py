"""The command line: what a person runs. Each command is a module; the work is done elsewhere."""

from sim.commands.app import main

__all__ = ["main"]
