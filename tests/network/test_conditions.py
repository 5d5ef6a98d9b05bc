"""What links do to messages, against what the options promise: times in closed form, chances by counting."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from network.links.conditions import NS, QUEUE_S, Channel, ConditionsOptions

PARTED = {"groups": [["A", "B"], ["C"]], "first_frame": 3, "frames": 2}


def channel(seed=1, source="A", target="B", **conditions):
    return Channel(ConditionsOptions.model_validate(conditions), seed, source, target)


def fates(each, n=4000, size=64):
    return [each.carry(i * NS, size, 0) for i in range(n)]


def test_a_perfect_link_delivers_at_once():
    assert fates(channel(), 5) == [(i * NS,) for i in range(5)]
    assert ConditionsOptions().are_perfect
    assert not ConditionsOptions(jitter_s=0.1).are_perfect
    assert not ConditionsOptions.model_validate({"partitions": [PARTED]}).are_perfect


@pytest.mark.parametrize("chance", [0.05, 0.3, 1.0])
def test_so_many_are_lost_each_for_itself(chance):
    lost = np.array([not arrivals for arrivals in fates(channel(loss=chance))])
    tolerance = 4 * np.sqrt(chance * (1 - chance) / len(lost))
    assert abs(lost.mean() - chance) <= tolerance
    if chance < 1:
        # the next one is lost as often after a loss as otherwise
        assert abs(lost[1:][lost[:-1]].mean() - chance) <= 2 * tolerance / np.sqrt(chance)


def test_so_many_arrive_twice_and_those_that_are_lost_do_not():
    found = [len(arrivals) for arrivals in fates(channel(loss=0.5, duplicates=0.2))]
    assert found.count(2) / len(found) == pytest.approx(0.5 * 0.2, abs=0.02)
    assert found.count(0) / len(found) == pytest.approx(0.5, abs=0.04)


def test_delay_and_jitter_are_evenly_distributed():
    found = np.array([arrivals[0] for arrivals in fates(channel(delay_s=0.1, jitter_s=0.2))])
    travelled = found / NS - np.arange(len(found))
    assert travelled.min() >= 0.1
    assert travelled.max() <= 0.3
    assert travelled.mean() == pytest.approx(0.2, abs=0.005)
    assert travelled.std() == pytest.approx(0.2 / np.sqrt(12), abs=0.005)


def test_a_line_writes_one_message_after_the_other():
    line = channel(bytes_per_s=1000, delay_s=0.5)
    # 100 bytes take 0.1 s to write: the third has to wait for two others
    assert [line.carry(0, 100, 0)[0] / NS for _ in range(3)] == pytest.approx([0.6, 0.7, 0.8])
    assert line.carry(2 * NS, 100, 0)[0] / NS == pytest.approx(2.6)


def test_a_full_line_loses_what_comes_on_top():
    line = channel(bytes_per_s=1000)
    arrived = [line.carry(0, 100, 0) for _ in range(20)]
    assert [bool(each) for each in arrived] == [True] * 11 + [False] * 9
    assert arrived[10][0] == (QUEUE_S + 0.1) * NS
    # lost messages do not keep it from becoming free again
    assert line.carry(NS, 100, 0)


@given(st.integers(0, 2**32), st.lists(st.floats(0, 0.2), min_size=1, max_size=40))
def test_the_order_stays(seed, gaps):
    line = channel(seed, jitter_s=1.0, delay_s=0.01, duplicates=0.5, loss=0.1, bytes_per_s=1e4)
    sent = [round(NS * each) for each in np.cumsum(gaps)]
    arrived = [at for now in sent for at in line.carry(now, 64, 0)]
    assert arrived == sorted(arrived)


def test_nobody_else_changes_a_link_s_draws():
    """Not the option that is not meant, not another link, not another message's fate."""
    lost = [not each for each in fates(channel(loss=0.3), 300)]
    more = {"jitter_s": 0.1, "duplicates": 0.3, "links": [{"link": ["B", "C"], "loss": 0.9}]}
    assert [not each for each in fates(channel(loss=0.3, **more), 300)] == lost
    parted = channel(loss=0.3, partitions=[{**PARTED, "groups": [["A"]]}])
    assert [not parted.carry(i * NS, 64, 3 if i < 100 else 9) for i in range(300)][100:] == lost[100:]
    assert [not each for each in fates(channel(loss=0.3, target="C"), 300)] != lost
    assert [not each for each in fates(channel(2, loss=0.3), 300)] != lost


def test_links_have_conditions_of_their_own_both_ways_or_one():
    options = ConditionsOptions.model_validate({
        "loss": 0.1,
        "links": [
            {"link": ["A", "B"], "delay_s": 0.2},
            {"link": ["C", "B"], "loss": 0.7, "directed": True},
        ],
    })  # fmt: skip
    assert (options.of("A", "B").loss, options.of("B", "A").delay_s) == (0.0, 0.2)
    assert (options.of("C", "B").loss, options.of("B", "C").loss) == (0.7, 0.1)
    assert options.latest_round_s == 0.2
    assert options.lose


@pytest.mark.parametrize(
    ("source", "target", "parted"),
    [
        ("A", "B", False),
        ("A", "C", True),
        ("C", "A", True),
        ("D", "A", True),
        ("D", "C", True),
        ("D", "E", False),
    ],
)
def test_parts_do_not_hear_each_other_from_frame_to_frame(source, target, parted):
    link = channel(source=source, target=target, partitions=[PARTED])
    assert [bool(link.carry(0, 64, frame)) for frame in (2, 3, 4, 5)] == [True, not parted, not parted, True]


def test_who_is_named_must_be_there():
    options = ConditionsOptions.model_validate({"links": [{"link": ["A", "C"]}], "partitions": [PARTED]})
    with pytest.raises(ValueError, match=r"links names A and C, between which the graph has no link"):
        options.require_possible([("A", "B")], "ABC", 9)
    with pytest.raises(ValueError, match=r"partitions names B, which is no camera: name some of A, C"):
        options.require_possible([("A", "C")], "AC", 9)
    options.require_possible([("A", "C")], "ABC", 9)


def test_a_partition_comes_about_before_the_run_ends():
    options = ConditionsOptions.model_validate({"partitions": [{**PARTED, "first_frame": 8}]})
    options.require_possible([], "ABC", 9)
    with pytest.raises(ValueError, match=r"partitions has one from frame 8 on: the run ends with frame 7"):
        options.require_possible([], "ABC", 8)


def test_a_camera_is_in_one_part():
    with pytest.raises(ValidationError, match="groups has A twice"):
        ConditionsOptions.model_validate({"partitions": [{**PARTED, "groups": [["A"], ["A", "B"]]}]})
