"""What a handle holds, as callers say it: indices, a mask, or a function of the vertices."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeVar, Union

import numpy as np
import numpy.typing as npt

from lpdeform import types
from lpdeform._numbers import Copied
from lpdeform.errors import invalid

Given = Union[types.Handle, types.Group, tuple[types.Group, Union[types.Motion, npt.ArrayLike]]]
"""A handle of deform(): a Handle, a group that stays, or a group with its motion or its target positions."""
Changed = TypeVar("Changed", bound=types.Change)


def handles_of(given: Mapping[str, Given], vertices: Copied) -> dict[str, types.Handle]:
    wanted: object = given  # of callers without a type checker
    if not isinstance(wanted, Mapping):
        text = f"The handles are of type {type(wanted).__name__} and not a dict of names."
        raise invalid(text, "ARRAY_TYPE", "handles", "a dict")
    return {str(name): _handle_of(str(name), one, vertices) for name, one in given.items()}


def _handle_of(name: str, given: Any, vertices: Copied) -> types.Handle:
    if isinstance(given, types.Handle):
        return chosen(given, vertices)
    if _is_pair(given):
        group, motion = given
        return chosen(types.Handle(group, _motion_of(name, motion)), vertices)
    return chosen(types.Handle(given), vertices)


def _is_pair(given: Any) -> bool:
    """A tuple whose first part is a group by itself. A tuple of two indices is a group."""
    return isinstance(given, tuple) and len(given) == 2 and (callable(given[0]) or not np.isscalar(given[0]))


def _motion_of(name: str, motion: Any) -> types.Motion:
    if isinstance(motion, (types.Fixed, types.RigidMotion, types.Targets)):
        return motion
    try:
        positions = np.asarray(motion, dtype=np.float64)
    except (TypeError, ValueError):
        positions = np.zeros(0)
    if positions.ndim != 2:
        text = f"The motion of handle {name!r} is neither a RigidMotion, Fixed or Targets, nor k x 3 target positions."
        raise invalid(text, "MOTION_TYPE", f"handle {name!r}", "a motion, or k x 3 numbers")
    return types.Targets(motion)


def chosen(change: Changed, vertices: Copied | None) -> Changed:
    """The change, whose group is what its function returns for the vertices. None: they are not known here."""
    if not isinstance(change, types.Handle) or not callable(change.vertices):
        return change
    if vertices is None:
        text = "A function cannot choose vertices in a session that was joined or restored: they are not known here."
        raise invalid(text, "ARRAY_TYPE", "vertices", "indices or a mask")
    function: Callable[[Copied], npt.ArrayLike] = change.vertices
    return replace(change, vertices=function(vertices.copy()))
