"""Rounding: as near as the bits allow, right in the mean, and done once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from network.wire.quantization import PayloadOptions, Quantizer, half_exponent

payloads = st.lists(st.floats(-1e37, 1e37), min_size=1, max_size=9).map(tuple)


@given(payloads)
def test_single_precision_is_numpys(payload):
    np.testing.assert_array_equal(Quantizer("float32")(payload), np.array(payload, np.float32).astype(float))


@given(payloads)
def test_half_precision_keeps_eleven_bits_however_large_the_numbers(payload):
    rounded, payload = np.array(Quantizer("float16")(payload)), np.array(payload)
    scale = np.abs(payload).max()
    # to the nearest: half a unit of eleven bits, or of the smallest number beside the largest
    assert (np.abs(rounded - payload) <= np.maximum(2.0**-11 * np.abs(payload), 2.0**-38 * scale)).all()


@given(payloads, st.integers(0, 2**32), st.sampled_from(["float32", "float16"]))
def test_rounding_again_changes_nothing(payload, seed, encoding):
    for rng in (None, np.random.default_rng(seed)):
        once = Quantizer(encoding, rng)(payload)
        np.testing.assert_array_equal(Quantizer(encoding)(once), once)
        np.testing.assert_array_equal(Quantizer(encoding, np.random.default_rng(0))(once), once)


def test_full_numbers_are_not_touched():
    payload = (np.pi, 1e149)
    assert Quantizer()(payload) is payload


@pytest.mark.parametrize("encoding", ["float32", "float16"])
def test_rounding_at_random_is_right_in_the_mean(encoding):
    value, n = np.pi, 4000
    quantizer = Quantizer(encoding, np.random.default_rng(3))
    # one at a time, as a node sends them; 4 fixes the scale
    drawn = np.array([quantizer((value, 4.0))[0] for _ in range(n)])
    low, high = np.unique(drawn)
    assert low < value < high
    # a Bernoulli variable's deviation is half the gap at the most
    assert abs(drawn.mean() - value) < 4 * 0.5 * (high - low) / np.sqrt(n)


def test_a_number_rounded_up_to_a_power_of_two_is_written_with_the_next_exponent():
    largest = 2.0**20 - 1
    rounded = Quantizer("float16")((largest, 3.0))
    np.testing.assert_array_equal(rounded, [2.0**20, 3.0])
    assert half_exponent(rounded) == half_exponent((largest,)) + 1


def test_numbers_that_are_too_large_become_the_largest():
    np.testing.assert_array_equal(Quantizer()((1e200, -1e300, 1.0)), [1e150, -1e150, 1.0])
    single = Quantizer("float32")((1e200, 1.0))
    np.testing.assert_array_equal(single, [np.float32(3e38), 1.0])
    # what is not finite is our own mistake, which the codec refuses
    np.testing.assert_array_equal(Quantizer()((np.inf, np.nan)), [np.inf, np.nan])


def test_nodes_round_by_streams_of_their_own():
    options = PayloadOptions(encoding="float16", rounding="stochastic")
    payload = tuple(np.random.default_rng(0).normal(size=100).tolist())
    one, again, other = (options.quantizer(5, name)(payload) for name in ("C1", "C1", "C2"))
    assert one == again
    assert one != other


def test_there_is_nothing_to_round_at_random_in_full_numbers():
    with pytest.raises(ValidationError, match="float64 rounds nothing: take float32 or float16"):
        PayloadOptions(rounding="stochastic")
