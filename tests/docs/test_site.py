"""The site: it builds without a warning, needs nothing from elsewhere, and leaves nothing out."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest
import typer

from network.wire.codec import encode
from network.wire.messages import ConsensusMessage
from sim.commands.app import app
from sim.scenario.loading import load_scenario

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built site."""
    folder = tmp_path_factory.mktemp("site")
    strict = ["--fail-on-warning", "--keep-going", "--quiet", "--doctree-dir", folder / "doctrees"]
    command = [sys.executable, "-m", "sphinx", *strict, ROOT / "docs", folder / "html"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "html"


class Links(HTMLParser):
    """What a page loads, and the anchors that it has."""

    def __init__(self, path):
        super().__init__()
        self.loads, self.ids = [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        told = dict(attrs)
        if "id" in told:
            self.ids.add(told["id"])
        if "src" in told:
            self.loads.append(told["src"])
        if tag == "link" and told.get("rel") in {"stylesheet", "icon", "preload"}:
            self.loads.append(told["href"])


def test_pages_load_nothing_from_elsewhere(site):
    for page in site.rglob("*.html"):
        for address in Links(page).loads:
            assert not re.match(r"\w+:|//", address), f"{page}: loads {address}"
    for style in site.rglob("*.css"):
        assert not re.search(r"(url\(|@import)\s*[\"']?(https?:)?//", style.read_text(encoding="utf-8")), (
            style
        )


def keys_of(value, at=""):
    """The dotted keys of a scenario, as the reference writes them."""
    for key, inner in value.items():
        yield at + key
        for each, suffix in (
            (inner, "."),
            *((item, "[].") for item in (inner if isinstance(inner, list) else [])),
        ):
            if isinstance(each, dict):
                yield from keys_of(each, at + key + suffix)


@pytest.mark.parametrize("name", ["scene1", "wica"])
def test_the_reference_has_every_key_of_a_resolved_scenario(site, name):
    ids = Links(site / "reference" / "scenario.html").ids
    scenario = load_scenario(ROOT / "scenarios" / f"{name}.yaml").model_dump(mode="json")
    chosen = f" (algorithm: {scenario['network']['consensus']['algorithm']})"
    for key in set(keys_of(scenario)):
        note = chosen if key.startswith("network.consensus.") else ""
        assert f"confval-{re.sub(r'[^A-Za-z0-9_.]+', '-', key + note).strip('-')}" in ids, key


def calls(command, anchor):
    """Every command that is no group, by its anchor."""
    if not hasattr(command, "commands"):
        yield anchor, command
        return
    for name, each in command.commands.items():
        yield from calls(each, f"{anchor}-{name}")


def test_the_command_reference_has_every_option(site):
    ids = Links(site / "reference" / "commands.html").ids
    found = dict(calls(typer.main.get_command(app), "dcpf"))
    assert {"dcpf-run", "dcpf-bench-parallel"} <= found.keys() <= ids
    for anchor, command in found.items():
        options = [each.opts[0] for each in command.params if each.param_type_name == "option"]
        assert {f"cmdoption-{anchor}-{option.lstrip('-')}" for option in options} <= ids


def test_every_equation_is_mathml(site):
    for page in (site / "mathematics").glob("*.html"):
        text = page.read_text(encoding="utf-8")
        found = re.findall(r"<math.*?</math>", text, re.DOTALL)
        assert found or page.stem == "index"
        # a command that the converter does not know stays as it was written
        assert not [each for each in found if "\\" in each or "merror" in each]


def test_the_page_on_messages_reads_a_message():
    page = (ROOT / "docs" / "reference" / "messages.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    names = {}
    exec(program, names)
    numbers = (1.5, -2.0, 3.25)
    data = encode("scene1", ConsensusMessage("C3", 10, 4, 2, numbers))
    assert names["read_consensus"](data, "scene1", "C3") == (10, 4, 2, numbers)
    with pytest.raises(ValueError, match="another sender"):
        names["read_consensus"](data, "scene1", "C2")
