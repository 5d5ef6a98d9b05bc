"""Key expressions: every name under which something of a run is heard is built and read here.

What a node says is under ``dcpf/{run}/{node}/...``, what concerns the whole run under ``dcpf/{run}/...``.
Each name is one chunk of a key; ``ANY`` in its place makes the wildcard form.
"""

import re

ANY = "*"
"""Stands for any run or any node."""

NAME_PATTERN = "[A-Za-z0-9][A-Za-z0-9_.-]*"
"""What a name may be: one chunk of a key, and safe as a file's name."""

_ROOT = "dcpf"


def check_name(name: str) -> str:
    """Returns the name of a run or node if it is safe in keys and as a file's name.

    Raises:
        ValueError: It is not.
    """
    if not re.fullmatch(NAME_PATTERN, name):
        raise ValueError(
            f"{name!r} cannot name a run or node: use letters, digits, '_', '-' and '.',"
            " and begin with a letter or digit"
        )
    return name


def estimate(run: str, node: str = ANY) -> str:
    """Where a node publishes its estimates, and answers with the latest."""
    return _of_node(run, node, "estimate")


def consensus(run: str, node: str) -> str:
    """Where a node sends the messages of its consensus rounds."""
    return _of_node(run, node, "consensus")


def pixels(run: str, node: str) -> str:
    """Where a camera sends its pictures."""
    return _of_node(run, node, "pixels")


def confirm(run: str, node: str) -> str:
    """Where a sink of pictures confirms the frames that it has used."""
    return _of_node(run, node, "confirm")


def status(run: str, node: str = ANY) -> str:
    """Where a node publishes how it is, and answers with the latest."""
    return _of_node(run, node, "status")


def state(run: str, node: str) -> str:
    """Where a node answers a neighbour that was away with what it knows of the target."""
    return _of_node(run, node, "state")


def preview(run: str, node: str = ANY) -> str:
    """Where a camera shows its pictures, while somebody looks."""
    return _of_node(run, node, "preview")


def alive(run: str, node: str = ANY) -> str:
    """The liveliness token of a node: it stands while the node can hear."""
    return _of_node(run, node, "alive")


def truth(run: str) -> str:
    """Where the world tells the true state."""
    return _of_run(run, "truth")


def control(run: str) -> str:
    """Where a run is started and stopped."""
    return _of_run(run, "control")


def of_run(run: str) -> str:
    """What all keys of a run begin with."""
    return f"{_ROOT}/{_chunk(run)}/"


def node_of(key: str) -> str:
    """The node that a key belongs to.

    Raises:
        ValueError: The key is not one of a node.
    """
    match key.split("/"):
        case [root, _, node, _] if root == _ROOT:
            return check_name(node)
    raise ValueError(f"{key!r} is not the key of a node: expected {_ROOT}/RUN/NODE/KIND")


def _of_node(run: str, node: str, kind: str) -> str:
    return f"{of_run(run)}{_chunk(node)}/{kind}"


def _of_run(run: str, kind: str) -> str:
    return of_run(run) + kind


def _chunk(name: str) -> str:
    return name if name == ANY else check_name(name)
