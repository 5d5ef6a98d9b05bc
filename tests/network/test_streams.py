"""Random streams: what they depend on, and that they stay what they are from version to version."""

import hashlib

import numpy as np
import pytest

from network.streams import stream


@pytest.mark.parametrize("seed", [0, 7, 2**32 - 1, 2**32, 2**70 + 5])
def test_a_stream_is_that_of_the_seed_and_the_names_digest(seed):
    words = np.frombuffer(hashlib.sha256(b"C1/fusion").digest()[:16], dtype="<u4")
    expected = np.random.default_rng([seed, *words.tolist()])
    assert np.array_equal(stream(seed, "C1", "fusion").random(5), expected.random(5))


def test_another_name_or_seed_is_another_stream():
    draws = [stream(*which).random() for which in ((0, "a"), (1, "a"), (0, "b"), (0, "a", "b"))]
    assert len(set(draws)) == 4
