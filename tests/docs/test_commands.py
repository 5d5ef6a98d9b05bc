"""The commands of the pages: all can be parsed, and those that can run here do, with few frames and seeds."""

import re
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
import typer

from sim.commands.app import app
from sim.scenario.complaints import validate
from sim.scenario.document import Document, merge_defaults, read_document
from sim.scenario.model import Scenario
from sim.scenario.presets import preset_defaults

ROOT = Path(__file__).parents[2]
PAGES = sorted(path for name in ("tutorial", "howto") for path in (ROOT / "docs" / name).glob("*.md"))
PAGES += [ROOT / "docs" / "reproduce.md"]

_FENCE = re.compile(r"^```(?P<info>[^\n`]+)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
_CAPTION = re.compile(r"\A:caption: (\S+)\n\n")


@dataclass(frozen=True)
class Block:
    """A fenced block of a page.

    Attributes:
        kind: `sh` or `yaml`.
        marker: Of commands: nothing where they shall end well; `fails` where they shall be refused as wrong;
            `beside` where they go on in another terminal; `elsewhere` where they need what is not
            here, or another page has them too.
        name: The file that it is, of a block with a caption.
        text: What is in it.
    """

    kind: str
    marker: str
    name: str
    text: str


def blocks(path):
    """The commands and the YAML of a page, in its order."""
    for fence in _FENCE.finditer(path.read_text(encoding="utf-8")):
        words, text = fence["info"].replace("{code-block}", "").split(), fence["text"]
        if words[0] in ("sh", "yaml"):
            caption = _CAPTION.match(text)
            name = caption[1] if caption else ""
            yield Block(words[0], " ".join(words[1:]), name, _CAPTION.sub("", text))


def commands(text):
    """The calls of dcpf in some lines of a shell, without the rest of their lines."""
    for line in text.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        while "dcpf" in words:
            words = words[words.index("dcpf") + 1 :]
            ends = [index for index, word in enumerate(words) if word in ("&&", "|", "&")]
            yield words[: ends[0] if ends else None]


@pytest.mark.processes
@pytest.mark.timeout(180)
@pytest.mark.skipif(sys.platform == "win32", reason="the pages are written for a POSIX shell")
@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_what_a_page_says_can_be_done(page, terminals):
    for block in blocks(page):
        if block.name:
            (terminals.folder / block.name).write_text(block.text, encoding="utf-8")
        elif block.kind == "sh" and block.marker == "beside":
            terminals.beside(block.text)
        elif block.kind == "sh" and block.marker != "elsewhere":
            code, printed = terminals.run(block.text)
            assert code == (2 if block.marker == "fails" else 0), f"{block.text}\n{printed}"
    for text, code, stdout, stderr in terminals.close():
        assert code in (0, 130), stderr
        assert stdout or "watch" not in text, "nobody was heard"


def readme_commands():
    """The commands of the README: its indented lines."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return commands("\n".join(re.findall(r"^ {4}(?:\$ )?(dcpf (?:.*\\\n)*.*)$", text, re.MULTILINE)))


CALLS = [
    *(
        call
        for page in PAGES
        for block in blocks(page)
        if block.kind == "sh"
        for call in commands(block.text)
    ),
    *readme_commands(),
]


@pytest.mark.parametrize("call", CALLS, ids=" ".join)
def test_every_command_and_option_exists(call):
    command, arguments = typer.main.get_command(app), call
    while hasattr(command, "commands"):
        name, *arguments = arguments
        command = command.commands[name]
    assert command.make_context(command.name, arguments).params


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_yaml_is_what_a_scenario_may_hold(page, tmp_path):
    """Fragments are read in scene 1's place; whole files are tested by the commands that read them."""
    for block in blocks(page):
        if block.kind == "yaml" and not block.name:
            part = tmp_path / "part.yaml"
            part.write_text(block.text, encoding="utf-8")
            told = read_document(part).data
            scene = read_document(ROOT / "scenarios" / "scene1.yaml").data
            whole = {key: value for key, value in scene.items() if key != "world" or "footage" not in told}
            document = Document(page, whole | told, {(): page.name})
            validate(merge_defaults(document, preset_defaults(document.data)), Scenario)
