"""The compiled kernel's interface: pictures, references and boxes as C sees them (`count.c`)."""

import ctypes
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int, UInt8, UInt16

from nodes.counting.build import load_kernel
from nodes.counting.codebook import Codebook
from nodes.counting.grid import rows_of_parts, sample_positions

_int32, _pointer = ctypes.c_int32, ctypes.c_void_p


class _Picture(ctypes.Structure):
    _fields_ = (
        ("pixels", _pointer),
        ("stride", ctypes.c_int64),
        ("height", _int32),
        ("width", _int32),
        ("index", _pointer),
        ("hue_bins", _int32),
        ("grey_chroma", _int32),
        ("grey_saturation", _int32),
    )


class _Reference(ctypes.Structure):
    _fields_ = (
        ("parts", _int32),
        ("codes", _int32),
        ("joints", _int32),
        ("first", _pointer),
        ("edges", _pointer),
        ("marks", _pointer),
        ("scale", _pointer),
    )


class _Sampling(ctypes.Structure):
    _fields_ = (
        ("columns", _int32),
        ("rows", _int32),
        ("x", _pointer),
        ("y", _pointer),
        ("part", _pointer),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Coding:
    """How a pixel gets its joint index.

    Attributes:
        tables: What blue, green and red add to it.
        hue_bins: If above 0, the index is the bin of the hue instead.
        grey_chroma, grey_saturation: Which pixels have no hue; see `nodes.filtering.color.hue_bins`.
    """

    tables: UInt16[np.ndarray, "3 256"]
    hue_bins: int = 0
    grey_chroma: int = 0
    grey_saturation: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Marks:
    """The codes that a pixel of each joint index counts for.

    Attributes:
        book: The colours that are told apart.
        of_joint: 1 where a pixel of joint index j counts for code k.
        first: Where each part's codes begin, and where the last one's end.
    """

    book: Codebook
    of_joint: UInt8[np.ndarray, "J K"]
    first: Int[np.ndarray, " P1"]


@lru_cache(maxsize=64)
def marks_of(book: Codebook) -> Marks:
    """The marks of a codebook: of its bins, or of all combinations of bins where there are three channels."""
    n_codes, (n_parts, n_channels, n_bins) = len(book.part), book.codes.shape
    joint = np.arange(n_bins**n_channels)
    marks = np.zeros((len(joint), n_codes + 1), np.uint8)
    for channel in range(n_channels):
        # red, green, blue are the digits of the joint index, red the first
        digit = joint // n_bins ** (n_channels - 1 - channel) % n_bins
        for codes in book.codes[:, channel]:
            marks[joint, codes[digit]] = 1
    first = np.searchsorted(book.part, np.arange(n_parts + 1)).astype(np.int32)
    return Marks(book, np.ascontiguousarray(marks[:, :n_codes]), first)


@lru_cache
def _samples(
    grid: tuple[int, int] | None, kernel: str, part_heights: tuple[float, ...]
) -> tuple[_Sampling, object]:
    if grid is None:
        return _Sampling(0, 0, None, None, None), None
    x, y = sample_positions(grid[0], kernel, 1.0), sample_positions(grid[1], kernel, 0.5)
    part = np.empty(grid[1], np.int32)
    for number, rows in enumerate(rows_of_parts(grid[1], kernel, part_heights)):
        part[rows] = number
    x, y = np.ascontiguousarray(x), np.ascontiguousarray(y)
    return _Sampling(grid[0], grid[1], x.ctypes.data, y.ctypes.data, part.ctypes.data), (x, y, part)


def count_compiled(
    image: UInt8[np.ndarray, "H W 3"],
    coding: Coding,
    boxes: Float[np.ndarray, "N 4"],
    marks: Marks,
    scale: Float[np.ndarray, " K"],
    grid: tuple[int, int] | None,
    kernel: str,
) -> tuple[Int[np.ndarray, "N K"], Int[np.ndarray, "N P"], Float[np.ndarray, " N"]]:
    """Counts the colours in boxes, as `nodes.counting.histogram.count` does, and sums their roots up.

    Args:
        image: The picture, blue, green, red.
        coding: From pixels to joint indices.
        boxes: left, top, right, bottom in pixels; NaN where there is none.
        marks: From joint indices to codes.
        scale: What the root of each code's count is worth.
        grid: Columns and rows of the samples, or None for every pixel.
        kernel: The density of the samples.

    Returns:
        Counts, pixels in each part, and Σ_p (Σ_k scale √count) / √pixels, the Bhattacharyya coefficient.

    Raises:
        KernelError: There is no compiled kernel.
        MemoryError: The boxes cover more than fits into memory.
    """
    n, n_parts, n_codes = len(boxes), len(marks.first) - 1, marks.of_joint.shape[1]
    if image.strides[1:] != (3, 1):
        image = np.ascontiguousarray(image)
    boxes, scale, edges = (np.ascontiguousarray(values) for values in (boxes, scale, marks.book.part_edges))
    counts, pixels = np.zeros((n, n_codes), np.int32), np.zeros((n, n_parts), np.int32)
    coefficients = np.empty(n)
    samples, _kept = _samples(grid, kernel, marks.book.part_heights)
    picture = _Picture(
        image.ctypes.data,
        image.strides[0],
        *image.shape[:2],
        coding.tables.ctypes.data,
        coding.hue_bins,
        coding.grey_chroma,
        coding.grey_saturation,
    )
    reference = _Reference(
        n_parts,
        n_codes,
        len(marks.of_joint),
        marks.first.ctypes.data,
        edges.ctypes.data,
        marks.of_joint.ctypes.data,
        scale.ctypes.data,
    )
    failed = load_kernel().dcpf_count(
        ctypes.byref(picture),
        ctypes.byref(reference),
        ctypes.byref(samples),
        _pointer(boxes.ctypes.data),
        _int32(n),
        _pointer(counts.ctypes.data),
        _pointer(pixels.ctypes.data),
        _pointer(coefficients.ctypes.data),
    )
    if failed:
        raise MemoryError(
            f"the boxes cover too much of a picture of {image.shape[1]} x {image.shape[0]} pixels"
        )
    return counts, pixels, coefficients
