"""Checks of arguments, before a server sees them."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from lpdeform import Handle, InvalidInput, Settings, SurfacePoints, Targets, Update
from lpdeform._numbers import crc32c, indices, numbers
from lpdeform._rpc import Packer
from lpdeform._wire import checked_update, settings_to_wire
from lpdeform.opening import _weld_of
from lpdeform.types import Field
from lpdeform.v1 import data_pb2, handle_pb2


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
    assert indices(np.array([False, True, True]), "vertices", mask_length=3).tolist() == [1, 2]
    assert indices([False, True, True], "vertices", mask_length=3).tolist() == [1, 2]
    assert indices([], "vertices", mask_length=3).tolist() == []


@pytest.mark.parametrize("length", [0, 2, 4])
def test_a_mask_of_another_length_is_refused_with_both(length: int) -> None:
    with pytest.raises(InvalidInput) as caught:
        indices(np.ones(length, bool), "vertices of handle 'tip'", mask_length=3)
    assert (caught.value.reason, caught.value.element) == ("MASK_SIZE", "vertices of handle 'tip'")
    assert caught.value.limit == "length = 3"
    assert f"a mask of {length} and not 3" in str(caught.value)


SHORT = np.ones(41, bool)
MANY = np.ones(43)


@pytest.mark.parametrize(
    ("update", "reason", "element"),
    [
        (Update({"tip": Handle(SHORT)}), "MASK_SIZE", "vertices of handle 'tip'"),
        (Update({"tip": Handle(points=SurfacePoints(SHORT, []))}), "MASK_SIZE", "faces of the points of handle 'tip'"),
        (Update(settings=Settings(region=SHORT)), "MASK_SIZE", "region"),
        (Update(settings=Settings(p=MANY)), "FIELD_SIZE", "p"),
        (Update(settings=Settings(stiffness=MANY)), "FIELD_SIZE", "stiffness"),
        (Update(settings=Settings(p=np.ones(42, bool))), "ARRAY_TYPE", "p"),
        (Update(settings=Settings(stiffness=True)), "ARRAY_TYPE", "stiffness"),
        (Update({"tip": Handle(np.ones(42))}), "ARRAY_TYPE", "vertices of handle 'tip'"),
        (Update({"tip": Handle([0, -1])}), "INDEX_OUT_OF_RANGE", "vertices of handle 'tip', number 1"),
        (Update({"tip": Targets(np.ones((2, 3), bool))}), "ARRAY_TYPE", "targets of handle 'tip'"),
    ],
)
def test_what_cannot_be_of_this_mesh_is_refused_before_it_is_sent(update: Update, reason: str, element: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        checked_update(update, 42, 40)
    assert (caught.value.reason, caught.value.element) == (reason, element)


@pytest.mark.parametrize("one", [2.0, 2, np.float32(2), [2], [2.0], np.array([2.0], np.float32), np.array(2.0)])
def test_one_value_is_that_of_every_vertex(one: Field) -> None:
    settings = checked_update(Update(settings=Settings(p=one, stiffness=one)), 42, 40).settings
    assert settings_to_wire(settings, cast(Packer, None)) == handle_pb2.SettingsUpdate(
        p=data_pb2.Field(uniform=2), stiffness=data_pb2.Field(uniform=2)
    )


@pytest.mark.parametrize("size", [0, 2, 41, 43])
def test_a_field_of_another_size_is_refused_with_both(size: int) -> None:
    with pytest.raises(InvalidInput) as caught:
        checked_update(Update(settings=Settings(p=np.ones(size))), 42, 40)
    assert (caught.value.reason, caught.value.limit) == ("FIELD_SIZE", "values = 42")
    assert f"p has {size} values, neither one nor 42" in str(caught.value)


@pytest.mark.parametrize(
    ("weld", "tolerance"),
    [(True, 0.0), (np.True_, 0.0), (False, None), (np.False_, None), (0, 0.0), (0.0, 0.0), (1e-6, 1e-6), (np.float32(0.5), 0.5)],
)
def test_a_weld_by_position_is_a_yes_or_a_tolerance(weld: float, tolerance: float | None) -> None:
    assert _weld_of(weld) == tolerance


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
        ([True, False], 1, "ARRAY_TYPE", "vertices"),  # as numbers of vertices to be welded to
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
