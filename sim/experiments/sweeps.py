"""Sweeps: a dotted key of the scenario and the values that it takes, from their text to lists of texts."""

import difflib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Any

from sim.scenario.parsing import ScenarioError

MAX_VALUES = 200
"""Values that one sweep may have: more is a slip of the keyboard."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """A key of the scenario and its values, each as it would stand in the file."""

    key: str
    values: tuple[str, ...]


def parse_sweep(text: str) -> Sweep:
    """A sweep from the command line, such as ``network.iterations=1:20`` or ``network.graph=ring,star``.

    Raises:
        ScenarioError: It is not written like that.
    """
    key, equals, values = text.partition("=")
    if not equals or not key:
        raise ScenarioError(f"--sweep {text}: has no key and =: write it like network.iterations=1:20")
    return Sweep(key, parse_values(values, f"--sweep {text}"))


def parse_values(text: str, source: str) -> tuple[str, ...]:
    """The values of ``first:last``, ``first:last:step`` (the last included) or ``a,b,c``.

    Args:
        text: The values; commas inside brackets, braces and quotes are part of a value.
        source: What errors call it.

    Raises:
        ScenarioError: There is no value, a range is no range, or there are too many.
    """
    if ":" in text and not set(text) & set("[{\"'"):
        return _range(text, source)
    values = tuple(value.strip() for value in _split(text))
    if not all(values):
        raise ScenarioError(f"{source}: has an empty value: write values like 1:20, 0:0.5:0.1 or a,b,c")
    return values


def texts(values: str | Sequence[Any], source: str) -> tuple[str, ...]:
    """The values of a sweep in an experiment file: a text as on the command line, or a list.

    Raises:
        ScenarioError: As `parse_values`.
    """
    if isinstance(values, str):
        return parse_values(values, source)
    return tuple(as_text(value) for value in values)


def as_text(value: Any) -> str:
    """A value as it would stand in a scenario file; JSON is YAML."""
    return value if isinstance(value, str) else json.dumps(value)


def require_key(key: str, scenarios: Sequence[Mapping[str, Any]], source: str) -> None:
    """Checks that a scenario has a key.

    Args:
        key: Dotted; items of a list by number or name.
        scenarios: The scenario as plain data, as its file has it and with every default filled in.
        source: What names the key, for the error.

    Raises:
        ScenarioError: It has not; the text names the nearest that there is.
    """
    known = list(dict.fromkeys(key for each in scenarios for key in _dotted_keys(each)))
    if key in known:
        return
    # The last part says most about what was meant: filter.alpha is filter.model_update.alpha.
    last = key.rpartition(".")[2]
    same_end = [each for each in known if each.rpartition(".")[2] == last]
    near = difflib.get_close_matches(key, same_end or known, n=1, cutoff=0.0 if same_end else 0.6)
    hint = f"did you mean {near[0]}?" if near else "dcpf schema lists the keys"
    raise ScenarioError(f"{source}: {key} is not a key of the scenario: {hint}")


def _dotted_keys(data: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    for key, value in data.items():
        yield prefix + key
        if isinstance(value, Mapping):
            yield from _dotted_keys(value, f"{prefix}{key}.")
        elif isinstance(value, list):
            for index, item in enumerate(value):
                names = [str(index)] + (
                    [str(item["name"])] if isinstance(item, Mapping) and "name" in item else []
                )
                for name in names:
                    yield f"{prefix}{key}.{name}"
                    if isinstance(item, Mapping):
                        yield from _dotted_keys(item, f"{prefix}{key}.{name}.")


def _range(text: str, source: str) -> tuple[str, ...]:
    try:
        first, last, *steps = map(Decimal, text.split(":"))
        step = steps[0] if steps else Decimal(1)
        count = int((last - first) / step) + 1
    except (InvalidOperation, ValueError, ArithmeticError):
        raise ScenarioError(f"{source}: {text} is no range: write it like 1:20 or 0:0.5:0.1") from None
    if len(steps) > 1 or step <= 0 or count < 1:
        raise ScenarioError(f"{source}: {text} is empty or has too many colons: write it like 0:0.5:0.1")
    if count > MAX_VALUES:
        raise ScenarioError(
            f"{source}: {text} has {count} values, at most {MAX_VALUES} do: take a larger step"
        )
    # Decimals, so that 0.3 is 0.3 and not the sum of three tenths.
    return tuple(f"{(first + index * step).normalize():f}" for index in range(count))


def _split(text: str) -> list[str]:
    """Splits at the commas that are in no bracket, brace or quote."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth == 0 and not quote:
            parts.append("")
        else:
            parts[-1] += letter
    return parts
