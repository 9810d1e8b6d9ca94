"""How a handle is held: what is checked of each kind. Its class is in types.py, its message in _wire_holds.py.

mypy refuses a kind of types.Hold without its case here; what comes from the server, test_holds.py covers.
"""

from __future__ import annotations

from typing import NoReturn

from lpdeform import types
from lpdeform._numbers import number
from lpdeform._vectors import checked_vector
from lpdeform.errors import invalid


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
            refuse_type(hold, what)


def refuse_type(hold: NoReturn, what: str) -> NoReturn:
    """Of callers without a type checker. To mypy, a kind that gets here is one whose case is missing."""
    raise invalid(f"The hold of {what} is of type {type(hold).__name__}.", "HOLD_TYPE", what)
