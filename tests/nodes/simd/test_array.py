"""The array: statements against Python integers, loops at once against one by one, memory, counts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.simd.array import ProcessorArray
from nodes.simd.memory import ExternalMemory, LineMemoryError
from nodes.simd.options import SimdOptions

P = 16
SMALL = SimdOptions(processing_elements=P)
BOTH_WAYS = pytest.mark.parametrize("batching", [True, False])


def loaded(array, values, n_words=1, *, signed=False):
    word = array.word(n_words=n_words, signed=signed)
    array.input(word, np.asarray(values))
    return word


@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.booleans())
def test_sums_and_differences_wrap_in_the_bits_of_their_words(seed, n_words, signed):
    rng, bits = np.random.default_rng(seed), 10 * n_words
    low, high = (-(1 << bits - 1), 1 << bits - 1) if signed else (0, 1 << bits)
    a, b = rng.integers(low, high, (2, P))
    array = ProcessorArray(SMALL)
    x, y = loaded(array, a, n_words, signed=signed), loaded(array, b, n_words, signed=signed)
    target = array.word(n_words=n_words, signed=signed)
    for statement, expected in ((array.add, a + b), (array.subtract, a - b)):
        statement(target, x, y)
        np.testing.assert_array_equal(target.value, (expected - low) % (high - low) + low)


@given(st.integers(0, 2**32 - 1), st.integers(1, 2), st.integers(0, 3))
def test_a_product_keeps_the_words_that_are_asked_for(seed, n_words, drop):
    a, b = np.random.default_rng(seed).integers(0, 1 << 10 * n_words, (2, P))
    array = ProcessorArray(SMALL)
    target = array.word(n_words=n_words)
    array.multiply(target, loaded(array, a, n_words), loaded(array, b, n_words), drop=drop)
    expected = [(int(x) * int(y) >> 10 * drop) % (1 << 10 * n_words) for x, y in zip(a, b, strict=True)]
    np.testing.assert_array_equal(target.value, expected)


def test_a_store_may_depend_on_the_flag():
    array = ProcessorArray(SMALL)
    x = loaded(array, np.arange(P))
    array.subtract(x, x, 3, when=array.at_least(x, 3))
    np.testing.assert_array_equal(x.value, [0, 1, 2, *range(P - 3)])


def test_neighbours_and_the_ends_of_the_array():
    array = ProcessorArray(SMALL)
    x = loaded(array, np.arange(1, P + 1))
    np.testing.assert_array_equal(array.neighbour(x, +1), [*range(2, P + 1), 0])
    np.testing.assert_array_equal(array.neighbour(x, -1), [0, *range(1, P)])


def test_instructions_are_counted_by_class_and_by_step():
    array = ProcessorArray(SMALL)
    one, two = array.word(), array.word(n_words=2)
    with array.step("sums") as cost:
        array.add(one, one, 1)
        array.add(two, two, one)
    assert cost.instructions == {"load": 3, "operate": 3, "store": 3}
    with array.step("loop") as cost:
        for _ in array.repeat(5):
            array.accumulate(one, 1, when=array.equal(two, 0))
    assert cost.instructions == {"load": 15, "operate": 15, "store": 5}
    assert cost.cycles == 35
    assert cost.microseconds(80.0) == pytest.approx(35 / 80)


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.sampled_from([-1, +1]))
def test_all_iterations_at_once_leave_the_same_words_and_counts_as_one_by_one(seed, n, offset):
    rng = np.random.default_rng(seed)
    values, limits = rng.integers(0, 1 << 10, (2, P))
    steps, table = rng.integers(0, 1 << 10, (2, n))

    def program(array):
        moving, limit = loaded(array, values), loaded(array, limits)
        total, kept, count, last = array.word(), array.word(), array.word(), array.word()
        with array.step("program") as cost:
            for k in array.repeat(n):
                array.shift(moving, offset)
                array.accumulate(total, moving)
                array.add(last, moving, steps[k])
                mine = array.less(last, limit)
                array.keep(kept, last, mine)
                array.accumulate(count, 1, when=mine)
                array.accumulate(count, table[k], when=array.neither(mine))
        return [word.value for word in (moving, limit, total, kept, count, last)], cost

    words, cost = program(ProcessorArray(SMALL))
    expected, expected_cost = program(ProcessorArray(SMALL, batching=False))
    np.testing.assert_array_equal(words, expected)
    assert cost == expected_cost


@given(st.integers(0, 2**32 - 1), st.integers(1, 7), st.integers(1, 9))
def test_loops_in_loops_leave_the_same_words_and_counts_as_one_by_one(seed, n_around, n_inside):
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 1 << 10, P)
    rows, columns = rng.integers(0, 1 << 10, n_around), rng.integers(0, 1 << 10, n_inside)

    def program(array):
        start, total = loaded(array, values), array.word(n_words=2)
        flagged, around, row, both, last = (array.word() for _ in range(5))
        with array.step("program") as cost:
            for r in array.repeat(n_around):
                array.add(row, start, rows[r])
                array.accumulate(around, row)
                for c in array.repeat(n_inside):
                    array.add(both, row, columns[c])
                    array.accumulate(total, both)
                    array.accumulate(flagged, 1, when=array.less(both, start))
                array.copy(last, both)
        return [word.value for word in (start, total, flagged, around, row, both, last)], cost

    words, cost = program(ProcessorArray(SMALL))
    expected, expected_cost = program(ProcessorArray(SMALL, batching=False))
    np.testing.assert_array_equal(words, expected)
    assert cost == expected_cost


def test_lanes_of_several_passes_cost_all_of_them_and_have_no_neighbours():
    def summed(array):
        total = array.word()
        with array.step("sums") as cost:
            for _ in array.repeat(5):
                array.accumulate(total, 3)
        return total.value, cost

    array = ProcessorArray(SMALL, lanes=2 * P + 1)
    total, cost = summed(array)
    assert total.tolist() == [15] * (2 * P + 1)
    once = summed(ProcessorArray(SMALL))[1]
    assert cost.cycles == 3 * once.cycles
    with pytest.raises(ValueError, match="none has a neighbour"):
        array.neighbour(array.word(), 1)


def test_what_one_iteration_leaves_to_the_next_in_another_way_is_refused():
    array = ProcessorArray(SMALL)
    x, y = array.word(), array.word()

    def counted_up():
        for _ in array.repeat(3):
            array.add(x, x, 1)

    def read_too_early():
        for _ in array.repeat(3):
            array.accumulate(x, 1)
            array.copy(y, x)

    def nested():
        for _ in array.repeat(3):
            for _ in array.repeat(2):
                array.shift(x, 1)

    with pytest.raises(ValueError, match="is carried from one iteration to the next"):
        counted_up()
    with pytest.raises(ValueError, match="read it afterwards"):
        read_too_early()
    with pytest.raises(ValueError, match="in a loop inside of another only sums go on"):
        nested()


@BOTH_WAYS
def test_lines_go_out_and_samples_come_in_from_anywhere(batching):
    array, memory = ProcessorArray(SMALL, batching=batching), ExternalMemory(4, 6)
    picture = np.arange(24).reshape(4, 6)
    word, column, row, pixel, total = (array.word(n_words=n) for n in (1, 1, 1, 1, 2))
    with array.step("store") as cost:
        for line in array.repeat(4):
            array.input(word, picture[np.squeeze(line)])
            array.output(word, memory, np.squeeze(line))
    np.testing.assert_array_equal(memory.pixels, picture)
    assert cost.external_writes == 24
    assert cost.cycles == 0  # the input and output processors work beside the array
    array.input(column, np.arange(P))
    with array.step("read") as cost:
        for k in array.repeat(3):
            array.add(row, 0, np.array([0, 1, 3])[k])
            array.fetch(pixel, memory, column, row, slice(0, 8))
            array.accumulate(total, pixel)
    assert cost.external_reads == 3 * 8
    inside = picture[[0, 1, 3]].sum(axis=0)
    np.testing.assert_array_equal(total.value[:6], inside)
    assert (total.value[6:] == (1 << 20) - 3).all()  # three times -1: no pixel


def test_a_program_that_needs_too_many_words_is_refused_with_what_uses_them():
    array = ProcessorArray(SimdOptions(words=8))
    array.word("Histograms", 5)
    with array.using(array.word(n_words=2)):
        assert array.line_memory.used == 7
    with pytest.raises(LineMemoryError, match=r"has 8 words, 5 are in use \(Histograms 5\) and 4 more"):
        array.word("Line buffers", 4)
    assert array.line_memory.high_water == 7
    assert array.line_memory.table == {"Histograms": 5, "Temporary variables": 2}


def test_only_real_numbers_have_a_unit_for_functions():
    array = ProcessorArray(SMALL)
    with pytest.raises(ValueError, match="only arithmetic float"):
        array.real(array.number(), np.sqrt, 2)
