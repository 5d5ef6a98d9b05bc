"""YAML to plain data, with the place of every key. Everything about YAML's syntax lives here.

The composed nodes carry line and column; keys that stand twice, aliases without end and foreign tags are
refused rather than guessed at.
"""

from dataclasses import dataclass
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

KeyPath = tuple[str | int, ...]

_MAX_NODES = 10_000  # a few lines of aliases of aliases unfold without end


class ScenarioError(Exception):
    """Something in a scenario is wrong; the text says where and what to do, one line for each problem."""


def dotted(at: KeyPath) -> str:
    """A key as messages name it: ``cameras[2].focal_px``."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in at).removeprefix(".")


def parse_yaml(text: str, source: str, places: dict[KeyPath, str], *, numbered: bool) -> Any:
    """Plain data from YAML; notes the place of every key in ``places``.

    Args:
        text: The YAML.
        source: What the text comes from, as errors shall call it.
        places: Filled with the place of each key and list item.
        numbered: Whether lines and columns of the text mean something to the reader.

    Raises:
        ScenarioError: The text is not YAML, has a key twice, or holds what no scenario needs.
    """
    try:
        yaml = YAML(typ="safe", pure=True)
        node = yaml.compose(text)
        return None if node is None else _Unfolding(yaml, source, places, numbered).plain(node, ())
    except MarkedYAMLError as error:
        place = _place(source, error.problem_mark if numbered else None)
        problem = ", ".join(filter(None, [error.context, error.problem]))
        remedy = "check indentation, colons, brackets and quotes here"
        raise ScenarioError(f"{place}: {problem}: {remedy}") from None
    except RecursionError:
        raise ScenarioError(f"{source}: is nested without end: take some levels out") from None
    except YAMLError as error:
        problem = str(error).splitlines()[0]
        raise ScenarioError(f"{source}: is not YAML: {problem}: remove what is not plain text") from None


@dataclass(frozen=True, slots=True, eq=False)
class _Unfolding:
    """Turns composed YAML nodes into plain data, noting where each stands."""

    yaml: YAML
    source: str
    places: dict[KeyPath, str]
    numbered: bool

    def plain(self, node: Node, at: KeyPath) -> Any:
        if len(self.places) > _MAX_NODES:
            raise ScenarioError(f"{self.source}: has more than {_MAX_NODES} values: use fewer aliases")
        if isinstance(node, MappingNode):
            return self.mapping(node, at)
        if isinstance(node, SequenceNode):
            return [self.item(item, item, (*at, index)) for index, item in enumerate(node.value)]
        return self.scalar(node)

    def item(self, node: Node, named_at: Node, at: KeyPath) -> Any:
        self.places[at] = _place(self.source, named_at.start_mark if self.numbered else None)
        return self.plain(node, at)

    def mapping(self, node: MappingNode, at: KeyPath) -> dict[str, Any]:
        mapping: dict[str, Any] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, ScalarNode) or _kind(key_node) == "merge":
                raise self.error(key_node, "keys must be plain words: write each key out")
            key = str(key_node.value)
            if key in mapping:
                where, first = dotted((*at, key)), self.places[(*at, key)]
                raise self.error(key_node, f"{where} is here a second time, after {first}: keep one")
            mapping[key] = self.item(value_node, key_node, (*at, key))
        return mapping

    def scalar(self, node: Node) -> Any:
        kind = _kind(node)
        if kind not in {"str", "int", "float", "bool", "null", "timestamp"}:
            raise self.error(node, f"the tag {node.tag} is not read here: write a plain value without it")
        if kind in {"str", "timestamp"}:  # a scenario has no dates: 2020-01-01 is a name
            return str(node.value)
        try:
            return self.yaml.constructor.construct_object(node)
        except ValueError:
            raise self.error(node, f"{node.value[:20]}... cannot be read as a number: shorten it") from None

    def error(self, node: Node, text: str) -> ScenarioError:
        return ScenarioError(f"{_place(self.source, node.start_mark if self.numbered else None)}: {text}")


def _kind(node: Node) -> str:
    """The last word of a node's tag, such as ``str`` or ``merge``."""
    return str(node.tag).rpartition(":")[2]


def _place(source: str, mark: Any) -> str:
    return source if mark is None else f"{source}:{mark.line + 1}:{mark.column + 1}"
