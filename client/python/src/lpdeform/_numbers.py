"""Checks and copies numbers and arrays from callers, and packs them as bytes. The server checks the ranges of numbers."""

from __future__ import annotations

from operator import index
from typing import Any

import numpy as np
import numpy.typing as npt

from lpdeform.errors import invalid

Copied = npt.NDArray[Any]
_most_index = 2**32 - 1


def _array(values: npt.ArrayLike, what: str) -> Copied:
    try:
        array = np.asarray(values)
    except (TypeError, ValueError) as cause:
        raise invalid(f"{_capital(what)}: no array: {cause}.", "ARRAY", what) from cause
    if np.ma.is_masked(values):
        raise invalid(f"{_capital(what)}: some entries are masked.", "ARRAY_TYPE", what, "no masked entries")
    return array


def _capital(what: str) -> str:
    return what[:1].upper() + what[1:]


def numbers(values: npt.ArrayLike, what: str, width: int = 1, copies: bool = True) -> Copied:
    """A copy of shape (k,) or (k, width): float32 if the values are float32, otherwise float64. `copies`: False if the values may be
    used as they are where their type and order allow it."""
    array = _array(values, what)
    if array.dtype.kind not in "fiu":
        raise invalid(f"{_capital(what)}: of type {array.dtype} and not numbers.", "ARRAY_TYPE", what, "float32 or float64")
    kind = "<f4" if array.dtype.itemsize == 4 and array.dtype.kind == "f" else "<f8"
    taken = np.array(array, dtype=kind, order="C") if copies else np.asarray(array, dtype=kind, order="C")
    return _shaped(taken, what, width)


def indices(
    values: npt.ArrayLike, what: str, width: int = 1, mask_length: int | None = None, below: int | None = None
) -> Copied:
    """A copy as uint32. A boolean mask of `mask_length` becomes the indices where it is true; None: no mask is allowed. `below`: how
    many there are to choose from, for the text of an error."""
    array = _array(values, what)
    if array.dtype.kind == "b" and array.ndim == 1 and mask_length is not None:
        if array.size != mask_length:
            text = f"{_capital(what)}: a mask of {array.size} and not {mask_length}."
            raise invalid(text, "MASK_SIZE", what, f"length = {mask_length}")
        array = np.flatnonzero(array)
    elif mask_length is not None and array.dtype.kind in "iu" and array.shape == (mask_length,) and _is_mask(array):
        raise invalid(f"{_capital(what)}: 0 and 1 for all {mask_length}; a mask has booleans.", "ARRAY_TYPE", what, "booleans, or indices")
    if array.size == 0:
        array = array.astype(np.int64)
    if array.dtype.kind not in "iu":
        raise invalid(f"{_capital(what)}: of type {array.dtype} and not integers.", "ARRAY_TYPE", what, "integers")
    array = np.require(array, requirements="A")  # NumPy 2.1 crashes where it compares others with a number beyond their type
    outside = (array < 0) | (array > _most_index)
    if outside.any():
        first = int(np.flatnonzero(outside.reshape(-1))[0])
        element = f"{what}, number {first}" if width == 1 else f"{what}, row {first // width}"
        limit = f"0 <= index <= {_most_index}" if below is None else f"0 <= index < {below}"
        text = f"{_capital(element)} has {array.reshape(-1)[first]}, which is no index."
        raise invalid(text, "INDEX_OUT_OF_RANGE", element, limit)
    return _shaped(np.array(array, dtype="<u4", order="C"), what, width)


def _is_mask(array: Copied) -> bool:
    """Three or more indices that are all 0 or 1 would repeat one."""
    return array.size > 2 and bool(((array == 0) | (array == 1)).all())


def number(value: float, what: str) -> float:
    if not isinstance(value, (str, bytes, bool, np.bool_)):
        try:
            return float(value)
        except (TypeError, ValueError, OverflowError):
            pass
    raise invalid(f"The {what} is {value!r} and not a number.", "ARRAY_TYPE", what, "a number")


def count(value: int, what: str, most: int) -> int:
    """Refuses what no message can hold. Of the rest, the server refuses what is over `most`."""
    limit = f"0 <= {what} <= {most}"
    if not isinstance(value, (bool, np.bool_)):
        try:
            if 0 <= (given := index(value)) <= _most_index:
                return given
        except TypeError:
            pass
    raise invalid(f"The {what} is {value!r} and not an integer with {limit}.", "ARRAY_TYPE", what, limit)


def _shaped(array: Copied, what: str, width: int) -> Copied:
    """Converts to shape (k,) or (k, width); a flat array of width * k numbers is accepted, too."""
    if width == 1 and array.ndim == 1:
        return array
    if width > 1 and array.ndim == 2 and array.shape[1] == width:
        return array
    if width > 1 and array.ndim == 1 and array.size % width == 0:
        return array.reshape(-1, width)
    wanted = "(k,)" if width == 1 else f"(k, {width})"
    raise invalid(f"{_capital(what)}: of shape {array.shape} and not {wanted}.", "ARRAY_SHAPE", what, wanted)


def is_single_precision(array: Copied) -> bool:
    return array.dtype.itemsize == 4


# CRC-32C over many lanes at once. The bytes are cut into runs of the same length, and each step of the usual
# table works on all runs together. The sums are then joined in pairs: sum(ab) = advance(sum(a), length of b)
# ^ sum(b).

_polynomial = 0x82F63B78
_lane_bytes = 2048


def _make_table() -> npt.NDArray[np.uint32]:
    table = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        table = np.where(table & 1, (table >> 1) ^ np.uint32(_polynomial), table >> 1).astype(np.uint32)
    return table


_table = _make_table()


def _apply(matrix: npt.NDArray[np.uint32], sums: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Applies a linear map over bits, given by the image of each bit, to many sums."""
    out = np.zeros_like(sums)
    for bit in range(32):
        out ^= np.where((sums >> np.uint32(bit)) & np.uint32(1), matrix[bit], np.uint32(0)).astype(np.uint32)
    return out


def _advance_by_lane() -> npt.NDArray[np.uint32]:
    matrix = np.uint32(1) << np.arange(32, dtype=np.uint32)
    for _ in range(_lane_bytes):
        matrix = (matrix >> 8) ^ _table[matrix & 0xFF]
    return matrix


def crc32c(data: bytes) -> int:
    """CRC-32C (Castagnoli).

    >>> hex(crc32c(b"123456789"))
    '0xe3069283'
    """
    if len(data) < 4:
        return _crc32c_short(data)
    lanes = 1 << (-(-len(data) // _lane_bytes) - 1).bit_length()
    # Zeros in front change nothing if the register begins as zero. Its true initial value, all ones, goes
    # into the first bytes.
    runs = np.zeros(lanes * _lane_bytes, np.uint8)
    runs[runs.size - len(data) :] = np.frombuffer(data, np.uint8)
    runs[runs.size - len(data) :][:4] ^= np.uint8(0xFF)
    columns = np.ascontiguousarray(runs.reshape(lanes, _lane_bytes).T)
    sums = np.zeros(lanes, np.uint32)
    for column in columns:
        sums = (sums >> np.uint32(8)) ^ _table[(sums ^ column) & np.uint32(0xFF)]
    matrix = _advance_by_lane()
    while sums.size > 1:
        sums = _apply(matrix, sums[0::2]) ^ sums[1::2]
        matrix = _apply(matrix, matrix)
    return int(sums[0]) ^ 0xFFFFFFFF


def _crc32c_short(data: bytes) -> int:
    rest = 0xFFFFFFFF
    for octet in data:
        rest = (rest >> 8) ^ int(_table[(rest ^ octet) & 0xFF])
    return rest ^ 0xFFFFFFFF
