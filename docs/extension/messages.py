"""The message reference: keys, JSON messages and bytes, from the code that writes and reads them."""

import inspect
import json
import re
import textwrap
from dataclasses import fields
from typing import Any, get_args

import numpy as np
from pydantic import TypeAdapter

from extension.schema import one_line, type_text
from network.wire import codec, keys
from network.wire.codec import encode
from network.wire.messages import (
    ConfirmMessage,
    ConsensusMessage,
    ControlMessage,
    EstimateMessage,
    PreviewMessage,
    PublicMessage,
    StatusMessage,
    TruthMessage,
    Visibility,
)
from network.wire.quantization import Encoding

EXAMPLES: tuple[PublicMessage, ...] = (
    EstimateMessage(
        run="scene1",
        node="C3",
        estimator="dcpf",
        frame=10,
        time_s=1.0,
        mean=np.array([0.076, 2.181, 0.125, 1.453]),
        covariance=np.diag([0.0008, 0.0004, 0.038, 0.038]),
        visible=False,
        lost=False,
        ess=197.2,
        iterations=12,
        members=("C1", "C2", "C3", "C4"),
    ),
    TruthMessage(
        run="scene1",
        frame=10,
        time_s=1.0,
        mean=np.array([0.093, 2.148, 0.141, 1.502]),
        visibility={"C1": Visibility(in_view=1.0, occluded=0.0), "C3": Visibility(in_view=0.0, occluded=0.0)},
    ),
    StatusMessage(
        node="C3",
        state="running",
        frame=10,
        counters={"late": 0, "sent": {"consensus": 264}},
        timing={"local_filter_ms_p50": 1.4},
    ),
    ControlMessage(action="start", start_time_s=None),
)
"""One of each public message; their bytes are written by the program's own codec."""


def key_reference() -> str:
    """Every key under which something is heard, with what is said there."""
    lines = ["| key | what |", "|---|---|"]
    for name, function in inspect.getmembers(keys, inspect.isfunction):
        parameters = list(inspect.signature(function).parameters)
        if function.__module__ == keys.__name__ and not name.startswith("_") and parameters[0] == "run":
            key = function(*(each.upper() for each in parameters))
            lines.append(f"| `{key}` | {inspect.getdoc(function)} |")
    return "\n".join(lines)


def message_reference() -> str:
    """The fields of every JSON message, and an example of each."""
    return "\n".join(_message(type(example), example) for example in EXAMPLES) + _message(
        PreviewMessage, None
    )


def _message(kind: Any, example: PublicMessage | None) -> str:
    told = attributes(kind)
    schema = TypeAdapter(kind).json_schema()
    lines = [
        f"### {kind.kind}",
        "",
        (inspect.getdoc(kind) or "").partition("\n")[0],
        "",
        "| field | type | what |",
        "|---|---|---|",
    ]
    for each in fields(kind):
        if each.name in schema["properties"]:
            kind_text = type_text(schema["properties"][each.name], schema)
            lines.append(f"| `{each.name}` | {kind_text} | {told.get(each.name, '')} |")
    if example is not None:
        line = json.dumps(json.loads(encode("scene1", example)), ensure_ascii=False)
        lines += ["", "```json", textwrap.fill(line, 90, subsequent_indent=" "), "```"]
    return "\n".join([*lines, "", ""])


def attributes(kind: type) -> dict[str, str]:
    """What the docstring of a message says of its fields."""
    text = (inspect.getdoc(kind) or "").partition("Attributes:")[2].partition("Raises:")[0]
    found = re.findall(r"^ {4}(\w+): (.*(?:\n {8,}.*)*)", text, re.MULTILINE)
    return {name: one_line(what) for name, what in found}


def binary_reference() -> str:
    """The layout of the bytes between nodes, as its codec states it, with the sizes of some messages."""
    table = (inspect.getdoc(codec) or "").partition("\n\n")[2].rpartition("Reading never trusts")[0]
    sizes = ["| message | bytes |", "|---|---|"]
    for numbers in (5, 9, 28):
        for encoding in get_args(Encoding):
            message = ConsensusMessage("C1", 1, 1, 2, np.zeros(numbers), encoding)
            sizes.append(f"| consensus, {numbers} numbers, {encoding} | {len(encode('scene1', message))} |")
    sizes.append(f"| confirm | {len(encode('scene1', ConfirmMessage('C1', 1)))} |")
    return "\n".join([table, "", *sizes])
