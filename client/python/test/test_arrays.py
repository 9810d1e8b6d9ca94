"""Checks of arguments, before a server sees them."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from lpdeform import (
    Automatic,
    Handle,
    InvalidInput,
    MinimaSearch,
    Resize,
    RigidMotion,
    Settings,
    Soft,
    SolverSettings,
    SurfacePoints,
    Targets,
    Update,
)
from lpdeform._numbers import crc32c, indices, numbers
from lpdeform._rpc import Packer
from lpdeform._checks import checked_update
from lpdeform._wire import settings_to_wire
from lpdeform.opening import weld_of
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
        (Update({"tip": Handle([0], footprint="wide")}), "ARRAY_TYPE", "footprint of handle 'tip'"),  # type: ignore[arg-type]
        (Update({"tip": Handle([0], hold=Soft("weak"))}), "ARRAY_TYPE", "weight of handle 'tip'"),  # type: ignore[arg-type]
        (Update({"tip": RigidMotion(angle="right")}), "ARRAY_TYPE", "angle of handle 'tip'"),  # type: ignore[arg-type]
        (Update(settings=Settings(length_unit="m")), "ARRAY_TYPE", "length_unit"),  # type: ignore[arg-type]
        (Update(settings=Settings(p=Automatic("high"))), "ARRAY_TYPE", "strength of p"),  # type: ignore[arg-type]
        (Update(resize=Resize((1, 1, 2), origin=(0, 0))), "ARRAY_SHAPE", "resize.origin"),
        (Update(resize=Resize((1, 1, 2), axes=((1, 0, 0), (0, 1)))), "ARRAY_SHAPE", "resize.axes[1]"),
    ],
)
def test_what_cannot_be_of_this_mesh_is_refused_before_it_is_sent(update: Update, reason: str, element: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        checked_update(update, 42, 40)
    assert (caught.value.reason, caught.value.element) == (reason, element)


@pytest.mark.parametrize(
    ("solver", "element", "limit"),
    [
        (SolverSettings(max_iterations=-1), "max_iterations", "0 <= max_iterations <= 2147483647"),
        (SolverSettings(max_iterations=2**32), "max_iterations", "0 <= max_iterations <= 2147483647"),
        (SolverSettings(max_iterations=1.5), "max_iterations", "0 <= max_iterations <= 2147483647"),  # type: ignore[arg-type]
        (SolverSettings(tolerance="small"), "tolerance", "a number"),  # type: ignore[arg-type]
        (SolverSettings(time_limit=10**400), "time_limit", "a number"),
        (SolverSettings(search=MinimaSearch(effort=-1)), "effort", "0 <= effort <= 1000"),
        (SolverSettings(search=MinimaSearch(effort=2**32)), "effort", "0 <= effort <= 1000"),
        (SolverSettings(search=MinimaSearch(effort=True)), "effort", "0 <= effort <= 1000"),
        (SolverSettings(search=MinimaSearch(least_share="all")), "least_share", "a number"),  # type: ignore[arg-type]
    ],
)
def test_what_no_message_can_hold_is_refused_with_its_limit(solver: SolverSettings, element: str, limit: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        checked_update(Update(settings=Settings(solver=solver)), 42, 40)
    assert (caught.value.reason, caught.value.element, caught.value.limit) == ("ARRAY_TYPE", element, limit)
    assert element in str(caught.value)


@pytest.mark.parametrize("effort", [None, 0, np.int64(3)])
def test_an_effort_is_sent_only_if_it_is_given(effort: int | None) -> None:
    search = MinimaSearch(effort=effort, show=True)
    settings = checked_update(Update(settings=Settings(solver=SolverSettings(search=search))), 42, 40).settings
    sent = settings_to_wire(settings, cast(Packer, None)).solver.search
    assert (sent.HasField("effort"), sent.effort, sent.show) == (effort is not None, effort or 0, True)


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
    assert weld_of(weld, []) == tolerance


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
