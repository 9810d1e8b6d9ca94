"""Kinds of holds as messages: a new kind is under test as soon as it is one of types.Hold."""

from __future__ import annotations

from typing import get_args

import lpdeform
import pytest
from lpdeform._holds import checked_hold
from lpdeform._wire_holds import hold_from_wire, hold_to_wire
from lpdeform.types import Hold
from lpdeform.v1.handle_pb2 import Handle

KINDS: tuple[type[Hold], ...] = get_args(Hold)


@pytest.mark.parametrize("kind", KINDS)
def test_a_hold_comes_back_from_the_wire_as_it_went(kind: type[Hold]) -> None:
    message = Handle()
    hold_to_wire(checked_hold(kind(), "it"), message)
    assert hold_from_wire(message) == kind()


def test_each_kind_has_a_field_of_its_own_and_a_name_in_the_package() -> None:
    fields = set()
    for kind in KINDS:
        message = Handle()
        hold_to_wire(kind(), message)
        fields.add(message.WhichOneof("hold"))
        assert getattr(lpdeform, kind.__name__) is kind
        assert kind.__name__ in lpdeform.__all__
    assert fields == {None, *(field.name for field in Handle.DESCRIPTOR.oneofs_by_name["hold"].fields)}


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_is_known_to_the_solver_in_this_process(kind: type[Hold]) -> None:
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    with lpdeform.open(corners, [[0, 1, 2]]) as session:
        session.set_handle("base", [0])
        session.set_handle("it", [1, 2], hold=kind())
        session.solve()


def test_what_is_no_hold_is_refused() -> None:
    with pytest.raises(lpdeform.InvalidInput) as refused:
        checked_hold(7, "handle 'tip'")  # type: ignore[arg-type]
    assert refused.value.reason == "HOLD_TYPE"
