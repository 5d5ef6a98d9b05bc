"""JSON Schemas of our own messages, for readers of a recording that have never heard of us."""

from typing import Any

from pydantic import TypeAdapter

from network.wire.messages import EstimateMessage, StatusMessage, TruthMessage

ALIVE_SCHEMA: dict[str, Any] = {
    "title": "dcpf.alive.v1",
    "description": "A node is heard of, or is not any more.",
    "type": "object",
    "properties": {"alive": {"type": "boolean"}},
    "required": ["alive"],
}


def json_schema(kind: type[EstimateMessage | TruthMessage | StatusMessage]) -> dict[str, Any]:
    """The schema of a public message, named as its encoding on the network is."""
    return {**TypeAdapter(kind).json_schema(), "title": f"dcpf.{kind.kind}.v1"}
