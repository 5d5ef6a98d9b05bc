"""The line intervals of a frame."""

from collections import Counter

import pytest

from nodes.simd.cost import Cost
from nodes.simd.pipeline import pipeline


def frame(*, reads=225 * 240, writes=240 * 256, n_active=240, lines=240, rest_cycles=28_000, binning=240_000):
    costs = {
        "store": Cost(Counter(load=binning), 0, writes),
        "read": Cost(Counter(load=48_000), reads, 0),
        "rest": Cost(Counter(load=rest_cycles)),
    }
    return pipeline(costs, "store", "read", n_active, lines, 80.0)


def test_the_papers_frame_fits():
    laid_out = frame()
    assert (laid_out.storing_lines, laid_out.reading_lines, laid_out.elements) == (240, 225, 240)
    assert laid_out.rest_lines == 6  # 350 µs of 69.5
    assert laid_out.holds
    assert laid_out.busy_us == pytest.approx((240_000 + 48_000 + 28_000) / 80)
    assert laid_out.share_of_frame == pytest.approx(laid_out.busy_us / (1e6 / 30))


def test_more_samples_than_line_intervals_are_read_several_at_a_time():
    laid_out = frame(reads=450 * 240)
    assert 240 < laid_out.elements <= 640
    assert laid_out.holds


def test_more_than_the_external_memory_can_move_costs_frames():
    laid_out = frame(reads=900 * 240)
    assert laid_out.elements == 640
    assert not laid_out.holds
    assert laid_out.rate_hz == pytest.approx(30 * 480 / laid_out.lines)


def test_a_picture_of_all_lines_leaves_no_time():
    assert not frame(lines=480, writes=480 * 640).holds


def test_a_line_that_takes_longer_than_its_interval_costs_frames():
    laid_out = frame(binning=240 * 80 * 139)  # two line intervals a line
    assert laid_out.rate_hz == pytest.approx(15)
