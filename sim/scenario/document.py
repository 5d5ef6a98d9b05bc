"""Scenario files as plain data that remembers where each key was written.

Reading, ``--set KEY=VALUE``, presets and writing live here. What the keys mean is the model's business;
:mod:`sim.scenario.complaints` says what a model did not like.
"""

import copy
import re
from collections.abc import Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedSeq
from ruamel.yaml.scalarstring import DoubleQuotedScalarString

from sim.scenario.parsing import KeyPath, ScenarioError, dotted, parse_yaml


@dataclass(frozen=True, slots=True, eq=False)
class Document:
    """A scenario as its author wrote it, before any model has judged it.

    Attributes:
        path: The file.
        data: Mappings, lists, text, numbers, true, false and None.
        places: Where each key and list item comes from: ``file:line:column``, or the option that set it.
    """

    path: Path
    data: dict[str, Any]
    places: Mapping[KeyPath, str]

    def place(self, at: KeyPath) -> str:
        """Where a key comes from, or the nearest key around it."""
        while at not in self.places:
            at = at[:-1]
        return self.places[at]

    def with_value(self, key: str, text: str) -> "Document":
        """The document with one value replaced, as ``--set KEY=VALUE`` does.

        Args:
            key: Dotted key; items of a list by number or by their ``name``, such as ``cameras.C2.focal_px``.
            text: The value, as it would stand in the file.

        Raises:
            ScenarioError: The value is not YAML, or a list or value on the way has no such part.
        """
        option = f"--set {key}={text}"
        data, places = copy.deepcopy(self.data), dict(self.places)
        *groups, last = re.sub(r"\[(\w+)\]", r".\1", key).split(".")

        # Walk down; groups that the file leaves to their defaults begin empty.
        here: Any = data
        at: KeyPath = ()
        for name in groups:
            step = _step(here, name, at, option)
            at = (*at, step)
            if isinstance(here, dict) and here.get(name) is None:
                here[name] = {}
                places[at] = option
            here = here[step]

        step = _step(here, last, at, option)
        at = (*at, step)
        here[step] = parse_yaml(text, option, {}, numbered=False)
        replaced = {old: place for old, place in places.items() if old[: len(at)] != at}
        return Document(self.path, data, {**replaced, at: option})


def read_document(path: Path) -> Document:
    """Reads a scenario file (YAML 1.2, UTF-8).

    Raises:
        ScenarioError: The file cannot be read, is not YAML, has a key twice, or is no mapping of keys.
    """
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        raise ScenarioError(f"{path}: there is no such file: check the path") from None
    except IsADirectoryError:
        raise ScenarioError(f"{path}: is a folder: name the scenario file in it") from None
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read: {error.strerror}") from error
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise ScenarioError(f"{path}:{line}: is not UTF-8 text: save the file as UTF-8") from None
    places: dict[KeyPath, str] = {(): str(path)}
    data = parse_yaml(text, str(path), places, numbered=True)
    if data is None:
        raise ScenarioError(f"{path}: is empty: write the scenario's keys into it, such as cameras:")
    if not isinstance(data, dict):
        raise ScenarioError(f"{path}: must hold keys with values at the top level, such as cameras:")
    return Document(path, data, places)


def merge_defaults(document: Document, defaults: Mapping[str, Any]) -> Document:
    """The document with what it leaves unsaid filled in, group by group.

    Its own keys win, and its own lists stay as they are.
    """
    return Document(document.path, _merged(document.data, defaults), document.places)


def _merged(own: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
    merged = {**copy.deepcopy(dict(defaults)), **own}
    for key in own.keys() & defaults.keys():
        if isinstance(own[key], dict) and isinstance(defaults[key], dict):
            merged[key] = _merged(own[key], defaults[key])
    return merged


def dump(content: BaseModel | Mapping[str, Any], path: Path) -> None:
    """Writes a scenario that :func:`read_document` reads back to the same values.

    Args:
        content: A model, or plain data; keys keep their order.
        path: The file, replaced if it exists.
    """
    path.write_text(as_yaml(content), encoding="utf-8")


def as_yaml(content: BaseModel | Mapping[str, Any]) -> str:
    """The text of the same."""
    plain = content.model_dump(mode="json") if isinstance(content, BaseModel) else dict(content)
    yaml = YAML()
    yaml.width = 110
    yaml.indent(mapping=2, sequence=4, offset=2)
    text = StringIO()
    yaml.dump(_laid_out(plain), text)
    return text.getvalue()


def _laid_out(value: Any) -> Any:
    """Data with lists of plain values on one line each, such as a matrix's rows, and odd texts quoted."""
    if isinstance(value, Mapping):
        return {key: _laid_out(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        items = CommentedSeq(_laid_out(item) for item in value)
        if not any(isinstance(item, dict | list) for item in items):
            items.fa.set_flow_style()
        return items
    if isinstance(value, str) and not re.fullmatch(r"[\w./ -]*", value):
        return DoubleQuotedScalarString(value)  # the library writes some texts bare that it reads otherwise
    return value


def _step(here: Any, name: str, at: KeyPath, option: str) -> str | int:
    """The key or index that a part of a dotted key means in a group or list."""
    where = dotted(at)
    if not name:
        raise ScenarioError(f"{option}: the key has an empty part: write it like filter.n_particles")
    if isinstance(here, dict):
        return name
    if not isinstance(here, list):
        raise ScenarioError(f"{option}: {where} is a single value and has no {name}: set {where} itself")
    names = [item.get("name") if isinstance(item, dict) else None for item in here]
    if name in names:
        return names.index(name)
    if name.isdecimal() and int(name) < len(here):
        return int(name)
    known = (
        ", ".join(str(index if own is None else own) for index, own in enumerate(names))
        or "none: it is empty"
    )
    raise ScenarioError(f"{option}: {where} has no item {name}: its items are {known}")
