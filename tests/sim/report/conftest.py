"""For the tests of reports: runs of the small hall in a folder, and a strict reading of their pages."""

import re
from itertools import pairwise

import html5lib
import pytest
from typer.testing import CliRunner

from sim.commands.app import app

LIMIT_BYTES = 3_000_000
HTML = "{http://www.w3.org/1999/xhtml}"


class Page:
    """A page that has been read: what any report must be is checked at once."""

    def __init__(self, path):
        data = path.read_bytes()
        self.source = data.decode()
        # Strict: what is not valid raises.
        self.tree = html5lib.HTMLParser(strict=True).parse(self.source)
        assert len(data) < LIMIT_BYTES
        self._needs_nothing_else()
        self._can_be_used_by_everybody()

    def all(self, tag):
        """The elements of a kind."""
        return list(self.tree.iter(f"{HTML}{tag}"))

    def text(self, tag="body"):
        """What one reads, without pictures and spaces that do not show."""
        return " ".join("".join(self.all(tag)[0].itertext()).split())

    def rows(self, caption):
        """The rows of a table, by their first cell."""
        for table in self.all("table"):
            cells = [["".join(cell.itertext()) for cell in row] for row in table.iter(f"{HTML}tr")]
            if caption in "".join(table.find(f"{HTML}caption").itertext()):
                return {first: rest for first, *rest in cells}
        raise AssertionError(f"there is no table {caption}")

    def _needs_nothing_else(self):
        assert not re.search(r"https?:|url\((?!#)|@import", self.source)
        assert not [each for tag in ("script", "link", "iframe", "object") for each in self.all(tag)]
        assert all(image.get("src").startswith("data:image/webp;base64,") for image in self.all("img"))

    def _can_be_used_by_everybody(self):
        assert self.all("html")[0].get("lang")
        levels = [
            int(each.tag[-1]) for each in self.tree.iter() if re.fullmatch(rf"{HTML}h\d", str(each.tag))
        ]
        assert levels[0] == 1
        assert levels.count(1) == 1
        assert all(below - above <= 1 for above, below in pairwise(levels))
        assert all(image.get("alt") for image in self.all("img"))
        assert all(heading.get("scope") for heading in self.all("th"))
        drawings = [each for each in self.tree.iter() if str(each.tag).endswith("}svg")]
        assert all(each.get("role") == "img" and each.get("aria-label") for each in drawings)
        ids = [each.get("id") for each in self.tree.iter() if each.get("id")]
        assert len(ids) == len(set(ids))
        assert set(re.findall(r'(?:url\(#|href="#)([^)"]+)', self.source)) <= set(ids)


@pytest.fixture
def page():
    """Reads a page."""
    return Page


@pytest.fixture
def dcpf(tmp_path, monkeypatch):
    """Runs a command of `dcpf` in the folder that holds `small.yaml`."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        result = CliRunner().invoke(app, list(map(str, arguments)))
        assert isinstance(result.exception, SystemExit | None), result.exception
        return result

    return run


@pytest.fixture
def ran(dcpf, tmp_path):
    """Runs a scenario file in one process and returns the run's folder."""

    def run(scenario, *arguments):
        result = dcpf("run", scenario, "--in-process", "--out", tmp_path / "run", *arguments)
        assert result.exit_code == 0, result.stderr
        return tmp_path / "run"

    return run
