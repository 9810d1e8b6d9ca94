"""The kinds of holds: what the user chooses from, and what the server is told. There is one for each of lpdeform.types.Hold."""

from collections.abc import Callable
from typing import NamedTuple

from .client import lpdeform


class Kind(NamedTuple):
    """The first three are an item of an EnumProperty."""

    identifier: str
    name: str
    description: str
    make: Callable
    """The package's hold, of a weight and of the empty's Z axis at rest."""
    has_weight: bool = False
    is_turned_only: bool = False
    """It takes no target positions."""


# Files keep the place in this list: a new kind goes at its end.
_all = (
    Kind("EXACT", "Exact", "The vertices go exactly where the empty takes them", lambda weight, axis: lpdeform.Exact()),
    Kind(
        "SOFT", "Soft", "The vertices are drawn to where the empty takes them",
        lambda weight, axis: lpdeform.Soft(weight), has_weight=True,
    ),
    Kind(
        "ORIENTATION", "Orientation", "The surface is turned as the empty is; its position is free",
        lambda weight, axis: lpdeform.Orientation(weight), has_weight=True, is_turned_only=True,
    ),
    Kind(
        "AXIS", "Axis", "The vertices slide along the empty's Z axis as it was at rest",
        lambda weight, axis: lpdeform.AxisLock(axis),
    ),
    Kind(
        "PLANE", "Plane", "The vertices slide across the empty's Z axis as it was at rest",
        lambda weight, axis: lpdeform.PlaneLock(axis),
    ),
)  # fmt: skip

KINDS = {kind.identifier: kind for kind in _all}
ITEMS = tuple(kind[:3] for kind in _all)
