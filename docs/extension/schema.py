"""JSON Schema in words: what a value may be, its default, its unit, and the groups that it holds."""

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

_SUFFIXES = {"s": "s", "m": "m", "px": "px", "hz": "Hz", "k": "K", "mhz": "MHz", "ms": "ms", "deg": "°"}
_UNIT_WORDS = {"metres": "m", "kelvin": "K", "pixels": "px", "grey levels": "grey levels", "Seconds": "s"}
_UNIT = re.compile(
    r"\bin (m²|m/s²|m/s|\(m/s\)²|px²|px/s|px|m|s|ms|Hz|pixels)(?![\w²/])"
    r"|\b(metres|kelvin|grey levels|Seconds)\b"
)
_KINDS = {
    "number": "number",
    "integer": "whole number",
    "string": "text",
    "boolean": "`true` or `false`",
    "null": "`null`",
}
_PLURALS = {
    "number": "numbers",
    "whole number": "whole numbers",
    "text": "texts",
    "list": "lists",
    "group": "groups",
}
_LIMITS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}

Schema = Mapping[str, Any]


def resolve(field: Schema, schema: Schema) -> Schema:
    """The model that a field refers to, or the field itself."""
    return schema["$defs"][field["$ref"].rpartition("/")[2]] if "$ref" in field else field


def variants(field: Schema, schema: Schema) -> Iterator[tuple[str, str, Schema]]:
    """The groups that a value can be: `[]` or `.<name>` for one of several, what chooses it, its model."""
    if "discriminator" in field:
        key = field["discriminator"]["propertyName"]
        for value, reference in field["discriminator"]["mapping"].items():
            yield "", f"{key}: {value}", resolve({"$ref": reference}, schema)
    elif "$ref" in field:
        model = resolve(field, schema)
        if "properties" in model:
            yield "", "", model
    else:
        for each in field.get("anyOf", []):
            yield from variants(each, schema)
        for inner, suffix in (("items", "[]"), ("additionalProperties", ".<name>")):
            if isinstance(field.get(inner), Mapping):
                yield from (
                    (suffix + more, choice, model) for more, choice, model in variants(field[inner], schema)
                )


def type_text(field: Schema, schema: Schema) -> str:  # noqa: PLR0911 - a case for each kind of value
    """What a value may be."""
    match resolve(field, schema):
        case {"properties": _} | {"discriminator": _}:
            return "group"
        case {"anyOf": several}:
            return ", or ".join(dict.fromkeys(type_text(each, schema) for each in several))
        case {"const": value}:
            return f"`{value}`"
        case {"enum": values}:
            return "one of " + ", ".join(f"`{each}`" for each in values)
        case {"type": "array"} as array:
            return _list_text(array, schema)
        case {"type": "object", "additionalProperties": dict() as inner}:
            return f"names, each with {type_text(inner, schema)}"
        case {"type": "object", "patternProperties": patterns}:
            return f"names, each with {', or '.join(type_text(inner, schema) for inner in patterns.values())}"
        case {"pattern": _, "examples": [example, *_]}:
            return f'text such as `"{example}"`'
        case plain:
            limits = [f"{sign} {plain[key]:,}" for key, sign in _LIMITS.items() if key in plain]
            return " ".join([_KINDS.get(plain.get("type", ""), "any value"), " and ".join(limits)]).strip()


def _list_text(field: Schema, schema: Schema) -> str:
    places = field.get("prefixItems")
    if places:
        kinds = list(dict.fromkeys(type_text(each, schema) for each in places))
        return f"list of {len(places)}: {', '.join(kinds)}"
    inner = field.get("items")
    return f"list of {_several(type_text(inner, schema))}" if inner else "list"


def _several(kind: str) -> str:
    """A type in the plural, where it has one."""
    word = next((word for word in _PLURALS if re.match(rf"{word}\b", kind)), "")
    return kind.replace(word, _PLURALS[word], 1) if word else f"items, each {kind}"


def default_text(value: Any) -> str:
    """A value as YAML's flow style has it."""
    return value if isinstance(value, str) and value else json.dumps(value).replace('"#', "'#")


def unit_of(key: str, field: Schema) -> str:
    """The unit of a value: that of its name, or that of its description."""
    suffix = key.rpartition("_")[2]
    if "_" in key and suffix in _SUFFIXES:
        return _SUFFIXES[suffix]
    found = _UNIT.search(field.get("description", ""))
    if not found or field.get("type") in ("string", "boolean"):
        return ""
    word = found[1] or found[2]
    return _UNIT_WORDS.get(word, word)


def one_line(text: str) -> str:
    """A docstring without its line breaks."""
    return " ".join(text.split())
