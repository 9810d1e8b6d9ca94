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
    return {str(name): _handle_of(one, vertices) for name, one in given.items()}


def _handle_of(given: Any, vertices: Copied) -> types.Handle:
    if isinstance(given, types.Handle):
        return chosen(given, vertices)
    if _is_pair(given):
        group, motion = given
        moved = motion if isinstance(motion, (types.Fixed, types.RigidMotion, types.Targets)) else types.Targets(motion)
        return chosen(types.Handle(group, moved), vertices)
    return chosen(types.Handle(given), vertices)


def _is_pair(given: Any) -> bool:
    if not isinstance(given, tuple) or len(given) != 2:
        return False
    return isinstance(given[1], (types.Fixed, types.RigidMotion, types.Targets)) or np.ndim(given[1]) == 2


def chosen(change: Changed, vertices: Copied | None) -> Changed:
    """The change, whose group is what its function returns for the vertices. None: they are not known here."""
    if not isinstance(change, types.Handle) or not callable(change.vertices):
        return change
    if vertices is None:
        text = "A function cannot choose vertices in a session that was joined or restored: they are not known here."
        raise invalid(text, "ARRAY_TYPE", "vertices", "indices or a mask")
    function: Callable[[Copied], npt.ArrayLike] = change.vertices
    return replace(change, vertices=function(vertices.copy()))
