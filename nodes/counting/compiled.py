"""The compiled kernel's interface: pictures, references and boxes as C sees them (`count.c`)."""

import ctypes
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float, Int, UInt8, UInt16

from nodes.counting.build import load_kernel
from nodes.counting.codebook import Codebook
from nodes.counting.grid import rows_of_parts, sample_positions

_int32, _pointer = ctypes.c_int32, ctypes.c_void_p
_ROOTS = np.sqrt(np.arange(16384.0))


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
        ("full_saturation", _int32),
    )


class _Reference(ctypes.Structure):
    _fields_ = (
        ("parts", _int32),
        ("codes", _int32),
        ("joints", _int32),
        ("channels", _int32),
        ("first", _pointer),
        ("edges", _pointer),
        ("table", _pointer),
        ("scale", _pointer),
        ("perfect", _pointer),
        ("roots", _pointer),
        ("known_roots", _int32),
    )


class _Sampling(ctypes.Structure):
    _fields_ = (
        ("columns", _int32),
        ("rows", _int32),
        ("x", _pointer),
        ("y", _pointer),
        ("part", _pointer),
    )


@dataclass(frozen=True, eq=False)
class Coding:
    """How a pixel gets its joint index.

    Attributes:
        tables: What blue, green and red add to it.
        hue_bins: If above 0, the index is the bin of the hue instead.
        grey: Which pixels have no hue: the chroma and the saturation below which they have none, and full
            saturation; see `nodes.vision.hue.hue_bins`.
    """

    tables: UInt16[np.ndarray, "3 256"]
    hue_bins: int = 0
    grey: tuple[int, int, int] = (0, 0, 0)

    @cached_property
    def address(self) -> int:
        """Where the tables are."""
        return int(self.tables.ctypes.data)


@dataclass(frozen=True, slots=True, eq=False)
class Compiled:
    """A reference as C sees it.

    Attributes:
        book: The colours that are told apart.
        structure: The codes of each joint index, and what the root of a count is worth.
        kept: The arrays that the structure points to.
    """

    book: Codebook
    structure: _Reference
    kept: tuple[np.ndarray, ...]


def compile_reference(
    book: Codebook, scale: Float[np.ndarray, " K"], perfect: Float[np.ndarray, " P"]
) -> Compiled:
    """Makes a reference ready: joint indices are its bins, or all combinations of bins of three channels.

    Args:
        book: The colours that are told apart.
        scale: What the root of each code's count is worth.
        perfect: The most that each part can contribute.
    """
    codes, edges = _joint_codes(book), book.part_edges
    scale, perfect = np.ascontiguousarray(scale), np.ascontiguousarray(perfect)
    n_parts, n_joints, n_channels = codes.shape
    first = np.searchsorted(book.part, np.arange(n_parts + 1)).astype(np.int32)
    structure = _Reference(
        *(n_parts, len(book.part), n_joints, n_channels),
        *(array.ctypes.data for array in (first, edges, codes, scale, perfect, _ROOTS)),
        len(_ROOTS),
    )
    return Compiled(book, structure, (first, edges, codes, scale, perfect))


@lru_cache(maxsize=64)
def _joint_codes(book: Codebook) -> UInt16[np.ndarray, "P J C"]:
    """The codes of each joint index in each part and channel; K where the colour is not told apart."""
    n_channels, n_bins = book.codes.shape[1:]
    joint = np.arange(n_bins**n_channels)
    # red, green, blue are the digits of the joint index, red the first
    digits = [joint // n_bins ** (n_channels - 1 - channel) % n_bins for channel in range(n_channels)]
    codes = np.stack([book.codes[:, channel, digit] for channel, digit in enumerate(digits)], axis=2)
    return np.ascontiguousarray(codes, dtype=np.uint16)


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


def distances_compiled(
    image: UInt8[np.ndarray, "H W 3"],
    coding: Coding,
    boxes: Float[np.ndarray, "N 4"],
    reference: Compiled,
    grid: tuple[int, int] | None,
    kernel: str,
) -> Float[np.ndarray, " N"]:
    """Finds d² of each box to the reference, as `nodes.vision.pattern.squared_distances` defines it.

    Args:
        image: The picture, blue, green, red.
        coding: From pixels to joint indices.
        boxes: left, top, right, bottom in pixels; NaN where there is none.
        reference: From joint indices to codes, and what they are worth.
        grid: Columns and rows of the samples, or None for every pixel.
        kernel: The density of the samples.

    Raises:
        KernelError: There is no compiled kernel.
        MemoryError: The boxes cover more than fits into memory.
    """
    return _run(image, coding, boxes, reference, grid, kernel)[: 8 * len(boxes)].view(float)


def counts_compiled(
    image: UInt8[np.ndarray, "H W 3"],
    coding: Coding,
    boxes: Float[np.ndarray, "N 4"],
    reference: Compiled,
    grid: tuple[int, int] | None,
    kernel: str,
) -> tuple[Int[np.ndarray, "N K"], Int[np.ndarray, "N P"]]:
    """Counts, and pixels in each part, as `nodes.counting.histogram.count` does; see `distances_compiled`."""
    n, n_codes = len(boxes), len(reference.book.part)
    found = _run(image, coding, boxes, reference, grid, kernel)[8 * n :].view(np.int32)
    return found[: n * n_codes].reshape(n, n_codes), found[n * n_codes :].reshape(n, -1)


def _run(
    image: UInt8[np.ndarray, "H W 3"],
    coding: Coding,
    boxes: Float[np.ndarray, "N 4"],
    reference: Compiled,
    grid: tuple[int, int] | None,
    kernel: str,
) -> UInt8[np.ndarray, " bytes"]:
    """Distances, counts and pixels one after the other, in one array: asking for its address takes time.

    What it is told, the boxes, stands before them.
    """
    (n, sides), book = boxes.shape, reference.book
    if image.strides[1:] != (3, 1):
        image = np.ascontiguousarray(image)
    at_found = boxes.itemsize * sides * n
    at_counts = at_found + 8 * n
    at_pixels = at_counts + 4 * n * len(book.part)
    memory = np.zeros(at_pixels + 4 * n * len(book.part_heights), np.uint8)
    memory[:at_found].view(float).reshape(n, sides)[:] = boxes
    samples, _kept = _samples(grid, kernel, book.part_heights)
    picture = _Picture(
        *(_address(image), image.strides[0], *image.shape[:2]),
        *(coding.address, coding.hue_bins, *coding.grey),
    )
    address = _address(memory)
    failed = load_kernel().dcpf_count(
        *(ctypes.byref(picture), ctypes.byref(reference.structure), ctypes.byref(samples)),
        *(_pointer(address), _int32(n), _pointer(address + at_found)),
        *(_pointer(address + at_counts), _pointer(address + at_pixels)),
    )
    if failed:
        raise MemoryError(
            f"the boxes cover too much of a picture of {image.shape[1]} x {image.shape[0]} pixels"
        )
    return memory[at_found:]


def _address(array: np.ndarray) -> int:
    """Where an array's numbers are; `array.ctypes` takes longer."""
    return int(array.__array_interface__["data"][0])
