"""What a model does not like about a scenario, in the words of the person who wrote it.

Pydantic's errors know the model; the document knows file, line and column. Here the two become sentences.
"""

import difflib
import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from sim.scenario.document import Document
from sim.scenario.parsing import KeyPath, ScenarioError, dotted

Model = TypeVar("Model", bound=BaseModel)

_MAX_LINES = 10

_KINDS = {
    "int_type": "a whole number",
    "float_type": "a number",
    "string_type": "text",
    "bool_type": "true or false",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "a group of keys",
    "model_type": "a group of keys",
}


def validate(document: Document, model: type[Model]) -> Model:
    """Reads a document as a model.

    Values are taken strictly: text is no number, 1 is not true, and nothing is rounded.

    Raises:
        ScenarioError: Something does not fit; one line for each problem, with its place and the remedy.
    """
    try:
        # By way of JSON, lists become tuples and words enumerations, however strict the rest is.
        return model.model_validate_json(json.dumps(document.data), strict=True)
    except ValidationError as error:
        found = [
            _finding(details, document.data)
            for details in error.errors(include_url=False)
            if not _counts_the_good_only(details)
        ]
    lines = list(dict.fromkeys(_lines(found, document, model.model_json_schema())))
    if len(lines) > _MAX_LINES:
        lines[_MAX_LINES - 1 :] = [f"{document.path}: and {len(lines) - _MAX_LINES + 1} more like these"]
    raise ScenarioError("\n".join(lines))


@dataclass(frozen=True, slots=True, eq=False)
class _Finding:
    """One of pydantic's errors, placed in the document.

    Attributes:
        at: The key that it is about.
        union_at: The value around it that may take several forms, if there is one.
        form: The form of that value which pydantic tried.
        kind: Pydantic's name of the error.
        message: Pydantic's own words.
        value: What the document holds there.
        context: Bounds, choices and the like, by pydantic's names.
    """

    at: KeyPath
    union_at: KeyPath | None
    form: str
    kind: str
    message: str
    value: Any
    context: dict[str, Any]


def _finding(error: ErrorDetails, data: Any) -> _Finding:
    """Follows an error's location into the data; what is no key there names a union's form."""
    kind, location = error["type"], error["loc"]
    at: KeyPath = ()
    union_at, form, here = None, "", data
    for step in location[:-1] if kind == "missing" else location:
        known = range(len(here)) if isinstance(here, list) else here if isinstance(here, dict) else ()
        if step in known:
            at, here = (*at, step), here[step]
        elif union_at is None:
            union_at, form = at, str(step)
    if kind == "missing":
        at = (*at, location[-1])
    return _Finding(at, union_at, form, kind, error["msg"], error["input"], error.get("ctx", {}))


def _counts_the_good_only(error: ErrorDetails) -> bool:
    """Whether a list is called too short only because some of its items, complained of already, are wrong."""
    return error["type"] == "too_short" and len(error["input"]) >= error["ctx"]["min_length"]


def _lines(found: Iterable[_Finding], document: Document, schema: dict[str, Any]) -> Iterator[str]:
    for union_at, group in groupby(found, key=lambda finding: finding.union_at):
        findings = list(group)
        if union_at is not None:
            findings = _nearest_form(findings)
        if union_at is not None and len(findings) > 1 and all(finding.at == union_at for finding in findings):
            # The value has none of the forms: one line names them all.
            needs = [_requirement(finding).removeprefix("must be ") for finding in findings]
            text = f"{dotted(union_at)} must be {' or '.join(dict.fromkeys(needs))}{_got(findings[0].value)}"
            yield f"{document.place(union_at)}: {text}"
        else:
            for finding in findings:
                yield f"{document.place(finding.at)}: {_sentence(finding, schema)}"


def _nearest_form(findings: list[_Finding]) -> list[_Finding]:
    """The errors of the form that a union's value was probably meant to have.

    That is the form with the fewest errors among those that found the right kind of value, if any did.
    """
    forms = [list(group) for _, group in groupby(findings, key=lambda finding: finding.form)]
    inside = [
        form
        for form in forms
        if all(finding.at != finding.union_at or finding.kind.startswith("union_tag") for finding in form)
    ]
    return min(inside, key=len) if inside else [finding for form in forms for finding in form]


def _sentence(finding: _Finding, schema: dict[str, Any]) -> str:
    where = dotted(finding.at)
    match finding.kind:
        case "missing":
            return f"{where} is missing: add it"
        case "extra_forbidden":
            return f"{where} is not a key here: {_other_key(finding, schema)}"
        case "union_tag_not_found" | "union_tag_invalid":
            return _wrong_choice(finding)
        case "value_error" | "assertion_error":
            return f"{where}: {_requirement(finding)}".removeprefix(": ")
    guess = _nearly(finding.value, finding.context.get("expected", ""))
    return f"{where} {_requirement(finding)}{_got(finding.value)}{guess}"


def _other_key(finding: _Finding, schema: dict[str, Any]) -> str:
    known = _known_keys(schema, finding)
    return _did_you_mean(str(finding.at[-1]), known) or f"the keys are {', '.join(known)}"


def _wrong_choice(finding: _Finding) -> str:
    """About the key that chooses a group's form, such as its ``kind``."""
    where = dotted((*finding.at, finding.context["discriminator"].strip("'")))
    if finding.kind == "union_tag_not_found":
        return f"{where} is missing: add it"
    choices, chosen = finding.context["expected_tags"], finding.context["tag"]
    return f"{where} must be one of {choices}{_got(chosen)}{_nearly(chosen, choices)}"


def _requirement(finding: _Finding) -> str:
    """What a value must be, such as ``must be greater than 0``."""
    if finding.kind in {"value_error", "assertion_error"}:
        return str(finding.context["error"])
    if finding.kind in _KINDS:
        return f"must be {_KINDS[finding.kind]}"
    return re.sub(r"^\w+ should ", "must ", finding.message).split(" after validation")[0]


def _got(value: Any) -> str:
    if value is None:
        return ", got nothing"
    if isinstance(value, list):
        return f", got a list of {len(value)}"
    if isinstance(value, dict):
        return ", got a group of keys"
    return f", got {json.dumps(value, ensure_ascii=False)}"


def _nearly(value: Any, choices: str) -> str:
    guess = _did_you_mean(str(value), re.findall(r"'([^']*)'", choices))
    return f": {guess}" if guess else ""


def _did_you_mean(word: str, known: list[str]) -> str:
    by_lower = {name.lower(): name for name in known}
    near = difflib.get_close_matches(word.lower(), by_lower, n=1)
    return f"did you mean {by_lower[near[0]]}?" if near else ""


def _known_keys(schema: dict[str, Any], finding: _Finding) -> list[str]:
    """The keys that the schema knows beside an unknown one."""
    group = finding.at[:-1]
    places = _forms(schema, schema)
    for depth, step in enumerate(group):
        places = [form for place in places for part in _parts(place, step) for form in _forms(part, schema)]
        if group[: depth + 1] == finding.union_at:
            places = [place for place in places if _is_form(place, finding.form)] or places
    return list(dict.fromkeys(key for place in places for key in place.get("properties", {})))


def _forms(part: dict[str, Any], schema: dict[str, Any]) -> list[dict[str, Any]]:
    """A part of a JSON Schema with references followed, one entry for each form that it allows."""
    if "$ref" in part:
        return _forms(schema["$defs"][part["$ref"].rpartition("/")[2]], schema)
    options = part.get("anyOf") or part.get("oneOf")
    return [form for option in options for form in _forms(option, schema)] if options else [part]


def _parts(form: dict[str, Any], step: str | int) -> list[dict[str, Any]]:
    """The schema of a key or list item."""
    if isinstance(step, str):
        part = form.get("properties", {}).get(step, form.get("additionalProperties"))
    else:
        part = dict(enumerate(form.get("prefixItems", []))).get(step, form.get("items"))
    return [part] if isinstance(part, dict) else []


def _is_form(place: dict[str, Any], form: str) -> bool:
    """Whether pydantic's name of a union's form, a class or a discriminator's value, means this schema."""
    return place.get("title") == form or any(
        key.get("const") == form for key in place.get("properties", {}).values()
    )
