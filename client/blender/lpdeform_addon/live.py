"""Meshes that follow their handles: one session each, and the timer that keeps them going."""

import time

import bpy
import numpy as np
from bpy.app.handlers import persistent

from . import handles, surface
from .client import NotReady, address, lpdeform, require

_interval = 1 / 30  # seconds between two looks
_paint_interval = 0.2  # weights are read by a loop, so less often

_running: dict = {}
"""By the names of mesh objects."""
_messages: dict = {}
"""What was last to be said of a mesh object."""


class LiveMesh:
    """One mesh and its session. Everything is looked up by name each time: undo exchanges Blender's data."""

    def __init__(self, ob) -> None:
        self.name = ob.name
        self.frame = None
        self._mode = ob.mode
        self._open(ob)
        self.had_keys = ob.data.shape_keys is not None
        self.muted = surface.add_live_key(ob)

    def _open(self, ob) -> None:
        self._rest = surface.rest_positions(ob)
        self._faces = surface.triangles(ob)
        self._held = surface.held(ob)
        self._told = {}
        self._told_settings = {}
        self._weights = {}
        self._weights_read = 0.0
        self.frame = None
        self.session = lpdeform.open(self._rest, self._faces, address=address(), free_components="stay")

    @property
    def state(self) -> str:
        return self.session.connection

    def close(self) -> None:
        self.session.close()

    def vertices_changed(self, ob) -> None:
        """Of handles."""
        self._held = surface.held(ob)

    def look(self, ob) -> None:
        """Tells the server what is new, and shows what has come."""
        was, self._mode = self._mode, ob.mode
        if ob.mode == "EDIT":
            return
        if was == "EDIT" or len(ob.data.vertices) != len(self._rest):
            self._look_again(ob)
        if was != ob.mode:
            self._weights, self._weights_read = {}, 0.0  # to be read anew
        handles_new, settings_new = self._new_handles(ob), self._new_settings(ob)
        if handles_new or settings_new:
            self.session.update(handles_new, lpdeform.Settings(**settings_new))
        frame = self.session.poll()
        if frame is not None:
            self.frame = frame
            self.show(ob)

    def show(self, ob) -> None:
        surface.show_positions(ob, self.frame.positions)
        if ob.lpdeform.show_distortion:
            surface.show_distortion(ob, self.frame.distortion, ob.lpdeform.distortion_limit)

    def _look_again(self, ob) -> None:
        """Where the mesh at rest may have become another one."""
        is_same = len(ob.data.vertices) == len(self._rest) and np.array_equal(surface.rest_positions(ob), self._rest)
        if is_same and np.array_equal(surface.triangles(ob), self._faces):
            self._held = surface.held(ob)
            return
        self.session.close()
        self._open(ob)

    def _new_handles(self, ob) -> dict:
        changes, present = {}, set()
        for empty in handles.of(ob):
            settings = empty.lpdeform_handle
            vertices = np.flatnonzero(self._held == settings.number)
            if not len(vertices):
                continue
            name = f"handle {settings.number}"
            present.add(name)
            matrix = handles.motion_matrix(ob, empty)
            kind = (settings.kind, settings.weight, settings.footprint, vertices.tobytes())
            place = tuple(value for row in matrix for value in row)
            if self._told.get(name) == (kind, place):
                continue
            motion = handles.motion(matrix, self._rest[vertices], settings.kind == "ORIENTATION")
            is_moved_only = name in self._told and self._told[name][0] == kind
            hold = handles.hold(empty)
            changes[name] = motion if is_moved_only else lpdeform.Handle(vertices, motion, hold, None, settings.footprint)
            self._told[name] = (kind, place)
        for name in set(self._told) - present:
            changes[name] = lpdeform.Removal()
            del self._told[name]
        return changes

    def _new_settings(self, ob) -> dict:
        settings = ob.lpdeform
        is_painting = ob.mode == "WEIGHT_PAINT" and time.monotonic() - self._weights_read >= _paint_interval
        names = (settings.p_group, settings.stiffness_group)
        if is_painting or self._weights.get("names") != names:
            p_weights, stiffness_weights = (surface.group_weights(ob, name) for name in names)
            self._weights = {"names": names, "p": p_weights, "stiffness": stiffness_weights}
            self._weights_read = time.monotonic()
        p = between(settings.p, settings.p_painted, self._weights["p"])
        powers = between(np.log(settings.stiffness), np.log(settings.stiffness_painted), self._weights["stiffness"])
        stiffness = np.exp(powers)
        fields = {"p": np.clip(p, 1.0, 64.0), "stiffness": np.clip(stiffness, 1e-6, 1e6)}
        new = {name: value for name, value in fields.items() if not np.array_equal(value, self._told_settings.get(name))}
        self._told_settings.update(new)
        return new


def between(plain: float, painted: float, weights):
    """One value, or one a vertex where there are weights."""
    return np.float64(plain) if weights is None else plain + weights * (painted - plain)


def of(ob):
    """The LiveMesh of a mesh object, or None."""
    return _running.get(ob.name) if ob is not None else None


def message(ob) -> str:
    return _messages.get(ob.name, "") if ob is not None else ""


def start(ob) -> None:
    """Raises NotReady with what a person has to do first."""
    if of(ob) is not None:
        return
    _messages.pop(ob.name, None)
    require()
    try:
        _running[ob.name] = LiveMesh(ob)
    except lpdeform.Unavailable as error:
        raise NotReady(
            f"No lpdeform server answers at {address()}. Start one with deploy/up, or set its address in the add-on's preferences."
        ) from error
    except lpdeform.LpdeformError as error:
        raise NotReady(f"The mesh cannot be deformed: {error}") from error
    if not bpy.app.timers.is_registered(tick):
        bpy.app.timers.register(tick)


def stop(ob, keep_as: str = "") -> None:
    """Back to the mesh at rest; or the present pose stays, as a shape key of this name."""
    running = _running.pop(ob.name, None)
    if running is None:
        return
    running.close()
    key = surface.live_key(ob)
    if keep_as and key is not None:
        key.name = keep_as
    else:
        surface.drop_live_key(ob, running.muted, running.had_keys)
    ob.data.update_tag()


def tick():
    """Looks after every live mesh; Blender's timer calls it."""
    for name, running in list(_running.items()):
        ob = bpy.data.objects.get(name)
        if ob is None or surface.live_key(ob) is None:
            _forget(name, "Ended: the mesh, or its shape key lpdeform, is gone.")
            continue
        try:
            running.look(ob)
            if _messages.get(name) and running.frame is not None and running.state == "connected":
                _messages.pop(name)
        except lpdeform.LpdeformError as error:
            _messages[name] = str(error)
            if running.state == "closed":
                _forget(name, f"Ended: {error}")
    _redraw()
    return _interval if _running else None


def _forget(name: str, why: str) -> None:
    _messages[name] = why
    running = _running.pop(name, None)
    if running is not None:
        running.close()


def _redraw() -> None:
    for window in bpy.context.window_manager.windows if bpy.context.window_manager else ():
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


@persistent
def _before_another_file(*_) -> None:
    for name in list(_running):
        _running.pop(name).close()
    _messages.clear()


def register() -> None:
    bpy.app.handlers.load_pre.append(_before_another_file)


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(_before_another_file)
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)
    for name in list(_running):
        ob = bpy.data.objects.get(name)
        if ob is not None:
            stop(ob)
        else:
            _running.pop(name).close()
