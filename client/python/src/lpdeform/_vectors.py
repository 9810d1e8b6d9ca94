"""Three numbers: checked and copied, as a message, and back."""

from __future__ import annotations

from lpdeform._numbers import numbers
from lpdeform.errors import invalid
from lpdeform.types import Vector3
from lpdeform.v1 import data_pb2


def checked_vector(values: Vector3, what: str) -> Vector3:
    array = numbers(values, what)
    if array.shape != (3,):
        raise invalid(f"The {what} is of shape {array.shape} and not three numbers.", "ARRAY_SHAPE", what, "(3,)")
    x, y, z = (float(value) for value in array)
    return (x, y, z)


def vector_to_wire(vector: Vector3) -> data_pb2.Vector3:
    x, y, z = (float(value) for value in vector)
    return data_pb2.Vector3(x=x, y=y, z=z)


def vector_from_wire(vector: data_pb2.Vector3) -> Vector3:
    return (vector.x, vector.y, vector.z)
