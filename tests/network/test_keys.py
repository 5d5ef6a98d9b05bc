"""Keys are built and read the same way, and names that would break them are refused."""

import pytest

from network.wire import keys


@pytest.mark.parametrize(
    "build", [keys.estimate, keys.consensus, keys.pixels, keys.confirm, keys.status, keys.preview, keys.alive]
)
def test_keys_of_a_node_name_it(build):
    key = build("scene1", "C3")
    assert key == f"dcpf/scene1/C3/{build.__name__}"
    assert keys.node_of(key) == "C3"


def test_keys_of_a_run():
    assert keys.truth("scene1") == "dcpf/scene1/truth"
    assert keys.control("scene1") == "dcpf/scene1/control"


def test_wildcards():
    assert keys.estimate(keys.ANY) == "dcpf/*/*/estimate"
    assert keys.alive("scene1") == "dcpf/scene1/*/alive"


@pytest.mark.parametrize("name", ["C1", "central", "node_2", "north-east.1", "7", "a" * 60])
def test_names_that_are_safe(name):
    assert keys.check_name(name) == name


@pytest.mark.parametrize(
    "name", ["", "a/b", "*", "**", "$x", "a?", "a#", "@a", ".", "..", "-a", "a b", "ö", "a\n"]
)
def test_names_that_are_not(name):
    with pytest.raises(ValueError, match="cannot name a run or node"):
        keys.check_name(name)


@pytest.mark.parametrize("key", ["", "dcpf/a", "dcpf/a/truth", "dcpf/a/b/c/d", "other/a/b/c", "dcpf/a/*/c"])
def test_keys_of_no_node(key):
    with pytest.raises(ValueError, match=r"is not the key|cannot name"):
        keys.node_of(key)
