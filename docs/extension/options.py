"""The references of scenario and experiment files, from the schemas that the program itself reads them by.

A group of keys is a section; a key has an anchor of its own, its type, default, unit, and the docstring under
its field. Where a group can be one of several, such as an averaging algorithm, each has a section.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from extension.schema import default_text, one_line, type_text, unit_of, variants
from sim.commands.inspect import experiment_schema, scenario_schema
from sim.scenario.presets import (
    LOSSY,
    ONE_CAMERA,
    ONE_CAMERA_PAPER,
    ONE_CAMERA_ROBUST,
    PAPER,
    PAPER_ON_ARRAY,
    PERSON_PARTS,
    ROBUST,
)


@dataclass(frozen=True)
class Section:
    """A group of keys.

    Attributes:
        path: Dotted, with `[]` for each item of a list and `<name>` for each name; empty at the top.
        choice: What makes it this one of several, such as `algorithm: ratio`; else empty.
        model: Its part of the schema.
    """

    path: str
    choice: str
    model: Mapping[str, Any]

    @property
    def label(self) -> str:
        """Its anchor."""
        return _slug(f"{self.path}-{self.choice}") if self.choice else _slug(self.path)


def scenario_reference() -> str:
    """Every key of scenario files."""
    presets = {"paper": dict(_flat(PAPER)), "robust": dict(_flat(ROBUST))}
    return _reference(scenario_schema(), "scenario", presets)


def experiment_reference() -> str:
    """Every key of experiment files."""
    return _reference(experiment_schema(), "experiment", {})


def preset_reference() -> str:
    """What the presets fill in, side by side."""
    columns = [dict(_flat(PAPER)), dict(_flat(ROBUST))]
    special = [
        ("both, in the image plane", dict(_flat(ONE_CAMERA))),
        ("`paper`, in the image plane", dict(_flat(ONE_CAMERA_PAPER))),
        ("`robust`, in the image plane", dict(_flat(ONE_CAMERA_ROBUST))),
        ("`paper`, with `filter.backend` `simd`", dict(_flat(PAPER_ON_ARRAY))),
        ("`robust`, of a person on a plane", dict(_flat(PERSON_PARTS))),
        ("`robust`, where links lose messages", dict(_flat(LOSSY))),
    ]
    keys = sorted({key for column in columns for key in column})
    lines = ["| key | `paper` | `robust` |", "|---|---|---|"]
    lines += [f"| `{key}` | {' | '.join(_cell(column, key) for column in columns)} |" for key in keys]
    lines += ["", "| besides | key | value |", "|---|---|---|"]
    lines += [f"| {who} | `{key}` | {_cell(each, key)} |" for who, each in special for key in each]
    return "\n".join(lines)


def _cell(column: Mapping[str, Any], key: str) -> str:
    return f"`{default_text(column[key])}`" if key in column else ""


def _reference(schema: dict[str, Any], root: str, presets: Mapping[str, Mapping[str, Any]]) -> str:
    return "\n".join(
        line
        for section in sections(schema, Section("", "", schema))
        for line in _section(section, schema, root, presets)
    )


def sections(schema: Mapping[str, Any], here: Section) -> Iterator[Section]:
    """A section and all those below it, depth first."""
    yield here
    for key, field in here.model.get("properties", {}).items():
        path = f"{here.path}.{key}" if here.path else key
        for suffix, choice, model in variants(field, schema):
            yield from sections(schema, Section(path + suffix, choice, model))


def _section(
    section: Section, schema: Mapping[str, Any], root: str, presets: Mapping[str, Mapping[str, Any]]
) -> Iterator[str]:
    title = f"`{section.path}`" if section.path else f"The {root} itself"
    yield f"({root}-{section.label})="
    yield f"## {title}{f' with `{section.choice}`' if section.choice else ''}\n"
    yield f"{section.model.get('description', '')}\n"
    required = section.model.get("required", [])
    for key, field in section.model.get("properties", {}).items():
        path = f"{section.path}.{key}" if section.path else key
        note = section.choice or ("experiment" if root == "experiment" else "")
        yield f":::{{confval}} {path}{f' ({note})' if note else ''}"
        links = ", ".join(_link(root, path + suffix, choice) for suffix, choice, _ in variants(field, schema))
        yield f":type: {type_text(field, schema)}"
        if "default" in field and not (links and isinstance(field["default"], dict | list)):
            yield f":default: {_defaults(path, field['default'], presets)}"
        elif key in required:
            yield ":default: none, it must be given"
        yield ""
        if unit := unit_of(key, field):
            yield f":Unit: {unit}\n"
        yield one_line(field.get("description", ""))
        if links:
            yield f"See {links}."
        yield ":::\n"


def _defaults(path: str, default: Any, presets: Mapping[str, Mapping[str, Any]]) -> str:
    """The default, and what the presets have instead."""
    told = {name: values[path] for name, values in presets.items() if values.get(path, default) != default}
    others = [f"`{name}` preset: `{default_text(value)}`" for name, value in told.items()]
    return ", ".join([f"`{default_text(default)}`", *others])


def _link(root: str, path: str, choice: str) -> str:
    label = f"{root}-{Section(path, choice, {}).label}"
    return f"[`{choice or path}`](#{label})"


def _slug(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", text.lower().replace("[]", "-each")).strip("-")


def _flat(group: Mapping[str, Any], at: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys with their values."""
    for key, value in group.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{at}{key}.")
        else:
            yield f"{at}{key}", value
