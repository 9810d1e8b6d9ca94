"""Checks and copies what callers give, at once; the ranges of numbers are for the solver to refuse."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import cast, get_args

import numpy as np
import numpy.typing as npt

from lpdeform import types
from lpdeform._holds import checked_hold
from lpdeform._numbers import Copied, count, indices, number, numbers
from lpdeform._vectors import checked_vector
from lpdeform.errors import invalid


def named(known: Collection[str], name: object, what: str) -> None:
    """Raises NAME_UNKNOWN unless `name` is one of them."""
    if name not in known:
        names = ", ".join(known)
        raise invalid(f"There is no {what} {name!r}: there are {names}.", "NAME_UNKNOWN", what, names)


def typed(value: object, kind: type[object], what: str) -> None:
    """Raises ARRAY_TYPE unless `value` is of this kind, or None."""
    if value is not None and not isinstance(value, kind):
        names = {"Mapping": "a dict"}.get(kind.__name__, kind.__name__)
        raise invalid(f"The {what} argument is of type {type(value).__name__} and not {names}.", "ARRAY_TYPE", what, names)


def checked_update(update: types.Update, vertices: int, faces: int) -> types.Update:
    """For a mesh with this many vertices and faces."""
    handles = {
        _checked_name(name): _checked_change(str(name), change, vertices, faces) for name, change in update.handles.items()
    }
    resize = None if update.resize is None else _checked_resize(update.resize)
    return types.Update(handles, checked_settings(update.settings, vertices), resize, bool(update.begins_step))


def _checked_resize(resize: types.Resize) -> types.Resize:
    scale = checked_vector(resize.scale, "resize.scale")
    origin = None if resize.origin is None else checked_vector(resize.origin, "resize.origin")
    if resize.axes is None:
        return types.Resize(scale, origin)
    first, second = resize.axes
    return types.Resize(scale, origin, (checked_vector(first, "resize.axes[0]"), checked_vector(second, "resize.axes[1]")))


def _checked_name(name: object) -> str:
    """Raises an error for half a surrogate pair, "\\ud800": a message with it could not be parsed."""
    text = str(name)
    try:
        text.encode()
    except UnicodeEncodeError:
        what = f"handle {text!r}"
        raise invalid(f"The name of {what} cannot be said in UTF-8.", "NAME_ENCODING", what, "UTF-8") from None
    return text


def _checked_change(name: str, change: types.Change, vertices: int, faces: int) -> types.Change:
    what = f"handle {name!r}"
    if isinstance(change, types.Handle):
        points = change.points
        if points is not None:
            points = types.SurfacePoints(
                indices(points.faces, f"faces of the points of {what}", mask_length=faces),
                numbers(points.barycentric, f"barycentric coordinates of {what}", 3),
            )
        return replace(
            change,
            vertices=indices(cast(npt.ArrayLike, change.vertices), f"vertices of {what}", mask_length=vertices),
            points=points,
            motion=_checked_motion(change.motion, what),
            hold=checked_hold(change.hold, what),
            footprint=number(change.footprint, f"footprint of {what}"),
        )
    if isinstance(change, types.Removal):
        return change
    return _checked_motion(change, what)


def _checked_motion(motion: types.Motion, what: str) -> types.Motion:
    if isinstance(motion, types.Targets):
        return types.Targets(numbers(motion.positions, f"targets of {what}", 3))
    if isinstance(motion, types.RigidMotion):
        return types.RigidMotion(
            checked_vector(motion.axis, f"axis of {what}"),
            number(motion.angle, f"angle of {what}"),
            checked_vector(motion.center, f"center of {what}"),
            checked_vector(motion.translation, f"translation of {what}"),
        )
    if isinstance(motion, types.Fixed):
        return motion
    raise invalid(f"The motion of {what} is of type {type(motion).__name__}.", "MOTION_TYPE", what)


def checked_settings(settings: types.Settings, vertices: int) -> types.Settings:
    """For a mesh with this many vertices."""
    return replace(
        settings,
        length_unit=None if settings.length_unit is None else number(settings.length_unit, "length_unit"),
        solver=None if settings.solver is None else _checked_solver(settings.solver),
        p=_checked_field(settings.p, "p", vertices),
        stiffness=_checked_field(settings.stiffness, "stiffness", vertices),
        region=None if settings.region is None else _checked_region(settings.region, vertices),
    )


def _checked_region(region: npt.ArrayLike, vertices: int) -> Copied:
    """No indices at all mean the whole mesh. A mask without a vertex means nothing that could be meant."""
    chosen = indices(region, "region", mask_length=vertices)
    if chosen.size == 0 and np.asarray(region).dtype.kind == "b" and np.size(region) > 0:
        raise invalid("The region is a mask that holds no vertex.", "REGION_EMPTY", "region", "at least one vertex")
    return chosen


def _checked_solver(solver: types.SolverSettings) -> types.SolverSettings:
    typed(solver, types.SolverSettings, "solver")
    typed(solver.search, types.MinimaSearch, "search")
    named(get_args(types.Method), solver.method, "method")
    named(get_args(types.InitialGuess), solver.initial, "initial guess")
    return replace(
        solver,
        tolerance=number(solver.tolerance, "tolerance"),
        max_iterations=count(solver.max_iterations, "max_iterations", 2**31 - 1),
        time_limit=number(solver.time_limit, "time_limit"),
        search=None if solver.search is None else _checked_search(solver.search),
    )


def _checked_search(search: types.MinimaSearch) -> types.MinimaSearch:
    return types.MinimaSearch(
        None if search.effort is None else count(search.effort, "effort", 1000),
        bool(search.show),
        number(search.least_share, "least_share"),
    )


def _checked_field(value: types.Field | None, what: str, vertices: int) -> types.Field | None:
    if value is None:
        return None
    if isinstance(value, types.Automatic):
        return types.Automatic(number(value.strength, f"strength of {what}"))
    if np.ndim(value) == 0 and not isinstance(value, (str, bytes, bool, np.bool_)):
        try:
            return float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError):
            raise invalid(f"{what} is of type {type(value).__name__}.", "ARRAY_TYPE", what) from None
    array = numbers(value, what)
    if array.size == 1:
        return float(array[0])
    if array.size != vertices:
        text = f"{what} has {array.size} values, neither one nor {vertices}, one for each vertex."
        raise invalid(text, "FIELD_SIZE", what, f"values = {vertices}")
    return array
