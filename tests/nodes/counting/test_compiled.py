"""The compiled kernel against the one in NumPy, count by count; that one is held against brute force."""

from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.counting import build, pixels
from nodes.counting.build import KernelError, load_kernel
from nodes.counting.codebook import codebook
from nodes.counting.compiled import compile_reference, counts_compiled, distances_compiled
from nodes.counting.histogram import SamplingOptions, count
from nodes.vision.color import ColorOptions, coding, quantize
from nodes.vision.pattern import Pattern, squared_distances

HEIGHT, WIDTH = 30, 40
BOX_COSTS = [10**9, -(10**9)]
"""What a box costs directly: integral images are always less, or never."""


@pytest.fixture(scope="module", autouse=True)
def _kernel():
    try:
        load_kernel()
    except KernelError as error:
        pytest.skip(str(error))


@st.composite
def boxes_of(draw):
    """Boxes over the borders, empty ones, single pixels, the whole picture, and one that cannot be seen.

    Few boxes, or ones far apart, are counted one by one, many from integral images.
    """
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.sampled_from([1, 3, 60]))
    centers, half = rng.uniform(-20, 60, (n, 2)), rng.uniform(0, draw(st.sampled_from([1, 6, 50])), (n, 2))
    boxes = np.hstack([centers - half, centers + half])
    left, top = float(rng.integers(0, WIDTH)), float(rng.integers(0, HEIGHT))
    boxes[-1] = draw(
        st.sampled_from(
            [
                boxes[-1],
                [left, top, left + 1, top + 1],  # one pixel
                [left, top, left, top + 9],  # empty
                [0, 0, WIDTH, HEIGHT],  # the whole picture
                [-1e6, -1e6, 1e6, 1e6],  # more than the whole picture
            ]
        )
    )
    if draw(st.booleans()):
        boxes[0] = np.nan
    return boxes


@given(
    st.integers(0, 2**32 - 1),
    boxes_of(),
    st.sampled_from([("rgb", 8), ("rgb", 3), ("joint_rgb", 6), ("joint_rgb", 8), ("hue", 40)]),
    st.sampled_from([(1.0,), (0.2, 0.5, 0.3)]),
    st.sampled_from([None, (15, 15), (4, 9)]),
    st.sampled_from([0.0, 0.1, 1.0]),
    st.sampled_from(BOX_COSTS),
)
def test_counts_are_equal_to_the_last_one(seed, boxes, colors, parts, grid, share, box_cost):
    rng = np.random.default_rng(seed)
    space, n_bins = colors
    options = ColorOptions(space=space, bins_per_channel=n_bins, parts=parts, part_weights=parts)
    image = rng.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)
    gain = rng.uniform(0.8, 1.25, 3) if space != "hue" else np.ones(3)
    book = codebook(rng.random((len(parts), options.n_channels, options.n_bins)) < share, parts)
    scale, perfect = rng.random(len(book.part)), rng.random(len(parts))
    sampling = SamplingOptions(grid=grid, kernel="epanechnikov")
    bins = quantize(image, options, gain)
    with patch.object(pixels, "BOX_COST", box_cost):
        expected, in_parts = count(bins, boxes, book, sampling)
    reference = compile_reference(book, scale, perfect)
    asked = image, coding(options, gain), boxes, reference, grid, sampling.kernel
    counts, found = counts_compiled(*asked)
    np.testing.assert_array_equal(counts, expected)
    np.testing.assert_array_equal(found, in_parts)
    pattern = Pattern(
        book, scale, tuple(np.searchsorted(book.part, np.arange(len(parts) + 1)).tolist()), perfect
    )
    distances = squared_distances(counts, found, pattern)
    np.testing.assert_allclose(distances_compiled(*asked), distances, atol=1e-12)


def test_without_a_compiler_it_says_what_to_do(monkeypatch):
    monkeypatch.setattr(build.shutil, "which", lambda _: None)
    monkeypatch.setattr(build.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(KernelError, match="needs a C compiler: install one, or the extra"):
        load_kernel.__wrapped__()


def test_a_compiler_that_fails_is_quoted(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    broken = tmp_path / "count.c"
    broken.write_text("int main(void) { return nonsense; }")
    monkeypatch.setattr(build, "SOURCE", broken)
    with pytest.raises(KernelError, match=r"could not compile count\.c: (.|\n)*nonsense"):
        load_kernel.__wrapped__()
    assert not list((tmp_path / "dcpf/kernels").iterdir())
