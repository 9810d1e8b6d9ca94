"""Three numbers, checked and copied."""

from __future__ import annotations

from lpdeform._numbers import numbers
from lpdeform.errors import invalid
from lpdeform.types import Vector3


def checked_vector(values: Vector3, what: str) -> Vector3:
    array = numbers(values, what)
    if array.shape != (3,):
        raise invalid(f"The {what} is of shape {array.shape} and not three numbers.", "ARRAY_SHAPE", what, "(3,)")
    x, y, z = (float(value) for value in array)
    return (x, y, z)
