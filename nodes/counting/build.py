"""Builds the compiled kernel once, on the machine that runs it, and keeps it in the user's cache."""

import ctypes
import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path

SOURCE = Path(__file__).with_name("count.c")
FLAGS = (
    *("-O3", "-march=native", "-shared", "-fPIC", "-lm"),
    # sums of roots may be taken in any order, several at a time; NaN stays NaN
    *("-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-fassociative-math"),
)
BUILD_LIMIT_S = 120.0


class KernelError(Exception):
    """The compiled kernel cannot be had; the text says why and what to do."""


@lru_cache(maxsize=1)
def load_kernel() -> ctypes.CDLL:
    """The compiled kernel, built first if this machine has not done so yet.

    Raises:
        KernelError: There is no compiler, or it fails.
    """
    compiler = _compiler()
    # Another machine that shares this folder may not have the same instructions.
    told = (SOURCE.read_bytes(), " ".join([*compiler, *FLAGS]).encode(), platform.node().encode())
    digest = hashlib.sha256(b"\0".join(told)).hexdigest()[:16]
    library = _cache() / f"count-{digest}.so"
    try:
        if not library.is_file():
            library.parent.mkdir(parents=True, exist_ok=True)
            _build(compiler, library)
        return ctypes.CDLL(str(library))
    except OSError as error:
        raise KernelError(f"the compiled kernel cannot be kept in {library.parent}: {error}") from error


def _compiler() -> list[str]:
    """The machine's own compiler, or the one in a wheel."""
    own = shutil.which(os.environ.get("CC", "cc"))
    if own:
        return [own]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise KernelError(
        "filter.backend compiled needs a C compiler: install one, or the extra with one in it"
        " (pip install 'dcpf[compiled]'), or take filter.backend: fast"
    )


def _cache() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "dcpf" / "kernels"


def _build(compiler: list[str], library: Path) -> None:
    """The library appears in its place whole or not at all."""
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        made = Path(folder) / library.name
        try:
            done = subprocess.run(  # noqa: S603 - the compiler, with a file of ours
                [*compiler, str(SOURCE), "-o", str(made), *FLAGS],
                capture_output=True,
                text=True,
                timeout=BUILD_LIMIT_S,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise KernelError(f"{compiler[0]} took longer than {BUILD_LIMIT_S:.0f} s: try again") from error
        if done.returncode:
            raise KernelError(
                f"filter.backend compiled: {compiler[0]} could not compile {SOURCE.name}:"
                f" {done.stderr.strip()[-300:]}: name another in CC, or take filter.backend: fast"
            )
        made.replace(library)
