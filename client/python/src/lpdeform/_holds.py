"""How a handle is held: everything that this library knows of each kind beside its class in types.py.

mypy refuses a kind of types.Hold without its case here; what comes from the server, test_holds.py covers.
"""

from __future__ import annotations

from typing import NoReturn

from lpdeform import types
from lpdeform._numbers import number
from lpdeform._vectors import checked_vector, vector_from_wire, vector_to_wire
from lpdeform.errors import invalid
from lpdeform.v1 import handle_pb2


def checked_hold(hold: types.Hold, what: str) -> types.Hold:
    """With copies of its vectors. The ranges of numbers are the server's to refuse."""
    match hold:
        case types.Exact():
            return hold
        case types.Soft():
            return types.Soft(number(hold.weight, f"weight of {what}"))
        case types.Orientation():
            return types.Orientation(number(hold.weight, f"weight of {what}"))
        case types.AxisLock():
            return types.AxisLock(checked_vector(hold.axis, f"axis of {what}"))
        case types.PlaneLock():
            return types.PlaneLock(checked_vector(hold.normal, f"normal of {what}"))
        case _:
            _refuse_type(hold, what)


def hold_to_wire(hold: types.Hold, message: handle_pb2.Handle) -> None:
    """Sets the field of the kind; none for Exact."""
    match hold:
        case types.Exact():
            pass
        case types.Soft():
            message.soft.weight = hold.weight
        case types.Orientation():
            message.orientation.weight = hold.weight
        case types.AxisLock():
            message.axis_lock.axis.CopyFrom(vector_to_wire(hold.axis))
        case types.PlaneLock():
            message.plane_lock.normal.CopyFrom(vector_to_wire(hold.normal))
        case _:
            _refuse_type(hold, "the handle")


def hold_from_wire(message: handle_pb2.Handle) -> types.Hold:
    """Exact where there is none, or one of a newer server."""
    match message.WhichOneof("hold"):
        case "soft":
            return types.Soft(message.soft.weight)
        case "orientation":
            return types.Orientation(message.orientation.weight)
        case "axis_lock":
            return types.AxisLock(vector_from_wire(message.axis_lock.axis))
        case "plane_lock":
            return types.PlaneLock(vector_from_wire(message.plane_lock.normal))
        case _:
            return types.Exact()


def _refuse_type(hold: NoReturn, what: str) -> NoReturn:
    """Of callers without a type checker. To mypy, a kind that gets here is one whose case is missing."""
    raise invalid(f"The hold of {what} is of type {type(hold).__name__}.", "HOLD_TYPE", what)
