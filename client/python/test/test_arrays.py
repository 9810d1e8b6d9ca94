"""What is given, before any server sees it."""

import numpy as np
import pytest

from lpdeform import InvalidInput
from lpdeform._numbers import crc32c, indices, numbers


def test_the_checksum_is_that_of_the_published_vectors() -> None:
    # RFC 3720, B.4.
    assert crc32c(bytes(32)) == 0x8A9136AA
    assert crc32c(b"\xff" * 32) == 0x62A8AB43
    assert crc32c(bytes(range(32))) == 0x46DD794E
    assert crc32c(b"123456789") == 0xE3069283
    assert crc32c(b"") == 0


@pytest.mark.parametrize("size", [1, 3, 4, 5, 2047, 2048, 2049, 4096, 100_001])
def test_the_checksum_over_lanes_is_that_byte_by_byte(size: int) -> None:
    data = np.random.default_rng(size).bytes(size)
    rest = 0xFFFFFFFF
    for octet in data:
        rest ^= octet
        for _ in range(8):
            rest = (rest >> 1) ^ (0x82F63B78 if rest & 1 else 0)
    assert crc32c(data) == rest ^ 0xFFFFFFFF


def test_a_mask_means_where_it_is_true() -> None:
    assert indices(np.array([False, True, True]), "vertices").tolist() == [1, 2]
    assert indices([], "vertices").tolist() == []


def test_arrays_are_copied() -> None:
    values = np.zeros(3)
    copied = numbers(values, "values")
    values[0] = 1
    assert copied[0] == 0


def test_single_precision_stays_and_all_else_is_double() -> None:
    assert numbers(np.zeros(3, np.float32), "values").dtype == np.float32
    assert numbers(np.zeros(3, np.float16), "values").dtype == np.float64
    assert numbers([1, 2], "values").dtype == np.float64


def test_strided_arrays_come_out_in_order() -> None:
    columns = np.arange(12.0).reshape(3, 4).T
    assert numbers(columns, "vertices", 3).tolist() == columns.tolist()
    assert numbers(columns, "vertices", 3).flags.c_contiguous


@pytest.mark.parametrize(
    ("values", "width", "reason", "element"),
    [
        ([-1, 2], 1, "INDEX_OUT_OF_RANGE", "vertices, number 0"),
        ([2, 2**32], 1, "INDEX_OUT_OF_RANGE", "vertices, number 1"),
        ([0.5], 1, "ARRAY_TYPE", "vertices"),
        (["a"], 1, "ARRAY_TYPE", "vertices"),
        ([[0, 1]], 1, "ARRAY_SHAPE", "vertices"),
        ([0, 1, 2, 3], 3, "ARRAY_SHAPE", "vertices"),
    ],
)
def test_bad_indices_are_named(values: object, width: int, reason: str, element: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        indices(values, "vertices", width)  # type: ignore[arg-type]
    assert (caught.value.reason, caught.value.element) == (reason, element)


@pytest.mark.parametrize(
    ("values", "reason"),
    [(["a"], "ARRAY_TYPE"), ([1j], "ARRAY_TYPE"), ([[1, 2], [3]], "ARRAY"), ([[1.0, 2.0]], "ARRAY_SHAPE")],
)
def test_bad_numbers_are_named(values: object, reason: str) -> None:
    with pytest.raises(ValueError) as caught:
        numbers(values, "positions", 3)  # type: ignore[arg-type]
    assert isinstance(caught.value, InvalidInput)
    assert caught.value.reason == reason
