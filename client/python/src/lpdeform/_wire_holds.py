"""How a handle is held, and three numbers, as messages and back."""

from __future__ import annotations

from lpdeform import types
from lpdeform._holds import refuse_type
from lpdeform.types import Vector3
from lpdeform.v1 import data_pb2, handle_pb2


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
            refuse_type(hold, "the handle")


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


def vector_to_wire(vector: Vector3) -> data_pb2.Vector3:
    x, y, z = (float(value) for value in vector)
    return data_pb2.Vector3(x=x, y=y, z=z)


def vector_from_wire(vector: data_pb2.Vector3) -> Vector3:
    return (vector.x, vector.y, vector.z)
