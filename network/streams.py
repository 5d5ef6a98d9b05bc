"""Random streams: everything random in a run comes from the scenario's seed, by name."""

import hashlib

import numpy as np


def stream(seed: int, *names: str) -> np.random.Generator:
    """The random stream of one thing in a run.

    The stream depends on the seed and on the thing's own name only, so that adding a camera or a filter
    changes nobody else's numbers, in one process or in many.

    Args:
        seed: The scenario's seed, at least 0.
        names: What draws the numbers, from the outside in, such as ``"C1", "fusion"``.
    """
    digest = hashlib.sha256("/".join(names).encode()).digest()
    # the seed and the digest as words of 32 bits, which is what NumPy makes of any numbers
    n_words = max(-(-seed.bit_length() // 32), 1)
    words = np.frombuffer(seed.to_bytes(4 * n_words, "little") + digest[:16], dtype="<u4")
    return np.random.default_rng(words)
