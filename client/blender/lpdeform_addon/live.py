"""Meshes that follow their handles: one session for each, and the timer that updates them."""

from typing import NamedTuple

import bpy
import numpy as np
from bpy.app.handlers import persistent

from . import handles, holds, surface
from .client import NotReady, access, address, lpdeform, require
from .told import Told

_interval = 1 / 30  # seconds between two updates
_running: dict = {}
"""The live meshes, by the names of their objects."""
_showing: set = set()
"""Names of mesh objects that are changing because a frame is shown."""
_messages: dict = {}
"""The last message about a mesh object."""


_painted = ("p", "stiffness", "region")
"""Settings that a vertex group can be chosen for."""
_settings = (*_painted, "solver")
_resize = "resize"
"""This is also the name of the handle that the server makes of it."""
_taken_all_the_same = ("FAILED_PRECONDITION", "ABORTED")
"""Codes of errors about solving: the server has accepted the update."""


class Present:
    """A value to send to the server, compared by its contents."""

    def __init__(self, value, empty=None, held=None, matrix=None, setting=None) -> None:
        self.value, self.empty, self.held, self.matrix, self.setting = value, empty, held, matrix, setting

    def __eq__(self, other) -> bool:
        return isinstance(other, Present) and self.value == other.value


class Held(NamedTuple):
    """What a handle holds, vertices or points inside faces, and where these are at rest."""

    vertices: np.ndarray
    points: object
    places: np.ndarray

    @property
    def value(self) -> tuple:
        points = self.points and (self.points.faces.tobytes(), self.points.barycentric.tobytes())
        return self.vertices.tobytes(), points


class LiveMesh:
    """One mesh and its session. Objects are looked up by name each time, because undo exchanges Blender's data."""

    def __init__(self, ob) -> None:
        self.name = ob.name
        self._mode = ob.mode
        self._open(ob)
        self.had_keys = ob.data.shape_keys is not None
        self.is_baked = False
        """Whether this is turned frame by frame; the timer leaves it alone then."""
        self.muted = surface.add_live_key(ob)

    def _open(self, ob) -> None:
        """Raises NotReady, and then changes nothing."""
        rest, faces = surface.rest_positions(ob), surface.triangles(ob)
        self.session = _open_session(ob, rest, faces)
        self._rest, self._faces, self._weld = rest, faces, ob.lpdeform.weld
        self.vertices_changed(ob)
        self._told = Told()
        self.fields = {}
        self._weights = {}
        self._is_touched = False
        self._operator = 0
        """The newest operator when the mesh was last seen untouched, or its weights were read."""
        self.frame = self.result = None

    @property
    def state(self) -> str:
        return self.session.connection

    @property
    def notice(self) -> str:
        """That of a better shape, or the server's last one about itself, unless it says that all is well again."""
        notice = self.session.notice
        is_past = notice is None or notice.reason == "recovered" or (notice.reason == "better_shape" and not self.has_better)
        return "" if is_past else notice.text

    @property
    def has_better(self) -> bool:
        """Whether the server knows a shape of lower energy, and nothing newer was sent."""
        notice = self.session.notice
        return notice is not None and notice.reason == "better_shape" and notice.input_seq >= self.session.newest_input

    @property
    def proof(self) -> list:
        """What the certificate says of what is shown, and what is known of other minima, of which it says nothing. A line each. A
        better shape that is known is in `notice`."""
        gap = self.shown.optimality_gap if self.shown is not None else None
        if gap is None:
            return []
        # The server says 1 if it has found no bound in time.
        lines = [f"Optimal to {100 * gap:.2g} % for its rotations" if gap < 1 else "No bound was found"]
        if self.result is not None:
            lines.append(self.result.searched[0].upper() + self.result.searched[1:])
        elif gap > 0 and not self.has_better:  # 0 is also what a shape without distortion has
            lines.append("Another minimum may be lower")
        return lines

    @property
    def mesh_notices(self) -> tuple:
        """What users should know of the mesh: that it comes apart where it is split."""
        return self.session.mesh_report.notices

    @property
    def has_refusals(self) -> bool:
        """Whether the server has refused something that still stands."""
        return self._told.has_refusals

    def close(self) -> None:
        self.session.close()

    def vertices_changed(self, ob) -> None:
        """By the names of handles."""
        self._held = {}
        by_vertex, by_face = surface.held(ob), surface.held_faces(ob)
        for number in np.unique(by_face[by_face > 0]):
            faces, barycentric, places = surface.middles(ob, np.flatnonzero(by_face == number), self._rest)
            self._held[int(number)] = Held(np.zeros(0, np.int64), lpdeform.SurfacePoints(faces, barycentric), places)
        for number in np.unique(by_vertex[by_vertex > 0]):
            vertices = np.flatnonzero(by_vertex == number)
            self._held[int(number)] = Held(vertices, None, self._rest[vertices])

    def look(self, ob) -> None:
        """Sends changes to the server, and shows what has come."""
        was, self._mode = self._mode, ob.mode
        if ob.mode == "EDIT":
            return
        if was == "EDIT" or len(ob.data.vertices) != len(self._rest) or ob.lpdeform.weld != self._weld:
            self._look_again(ob)
        if was != ob.mode:
            self._weights = {}  # read again
        self._tell(ob)
        self._take(ob, self.session.poll)

    def finished(self, ob, seconds: float):
        """The finished result for all that was sent, and shows it; None if it has not come in this time. Raises the server's
        errors."""
        try:
            return self._take(ob, lambda: self.session.settle(seconds))
        except lpdeform.Timeout:
            return None

    def _take(self, ob, ask):
        """Shows the frame that `ask` returns, if it is a new one."""
        try:
            frame = ask()
        except lpdeform.LpdeformError as error:
            if error.code.name not in _taken_all_the_same:
                self._told.refused()
            raise
        if frame is not None and frame is not self.frame:
            self._told.answered(frame.input_seq)
            self.frame = frame
            if self.result is None or _is_past(self.result, frame):
                self.result = None
                self.show(ob)
        return frame

    def solve(self, ob, on_progress, timeout: float) -> None:
        """Solves to the end, with a bound, and shows the result. Raises the server's errors, Timeout, and NotReady."""
        self.look(ob)
        try:
            self.result = self.session.solve(certify=True, on_progress=on_progress, timeout=timeout)
        except lpdeform.InvalidInput:
            self._told.refused()
            raise
        self._told.answered(self.result.input_seq)
        self.show(ob)

    @property
    def shown(self):
        """The last frame or the result of a solve; None if nothing has come yet."""
        return self.result or self.frame

    def _tell(self, ob) -> None:
        present = {**self._present_handles(ob), **self._present_settings(ob)}
        news = self._told.news(present)
        if not news:
            return
        resize = present[_resize].setting if _resize in news and _resize in present else None
        changes = {key: self._change(key, present.get(key)) for key in news if key not in _settings and (key != _resize or not resize)}
        settings = {key: present[key].setting for key in news if key in _settings}
        values = {key: present.get(key) for key in news}
        try:
            self._told.tell(values, self.session.update(changes, lpdeform.Settings(**settings), resize))
        except lpdeform.LpdeformError:  # not even sent
            self._told.tell(values, 0)
            self._told.refused()
            raise

    def undone(self, ob) -> None:
        """Called after an undo or redo of Blender: handles may have changed, and the shown positions are older than the last
        frame."""
        self.vertices_changed(ob)
        self._weights = {}  # read again
        if self.shown is not None and len(ob.data.vertices) == len(self._rest):
            self.show(ob)

    def show(self, ob) -> None:
        bpy.context.view_layer.update()  # changes by others are not ours
        surface.show_positions(ob, self.shown.positions)
        if ob.lpdeform.show_distortion:
            surface.show_distortion(ob, self.shown.distortion, ob.lpdeform.distortion_limit)
        _showing.add(self.name)
        bpy.context.view_layer.update()
        _showing.discard(self.name)

    def mesh_changed(self) -> None:
        """Called when the mesh was changed by others, as by each dab of a brush."""
        self._is_touched = True

    def _look_again(self, ob) -> None:
        """Called when the mesh at rest may have changed, or welding was switched."""
        is_same = len(ob.data.vertices) == len(self._rest) and np.array_equal(surface.rest_positions(ob), self._rest)
        if is_same and np.array_equal(surface.triangles(ob), self._faces) and ob.lpdeform.weld == self._weld:
            self.vertices_changed(ob)
            return
        before = self.session
        self._open(ob)
        before.close()

    def _present_handles(self, ob) -> dict:
        """For each handle its empty, what it holds and how, and where it is."""
        present = {}
        for empty in handles.of(ob):
            settings = empty.lpdeform_handle
            held = self._held.get(settings.number)
            if held is None:
                continue
            matrix = handles.motion_matrix(ob, empty)
            kind = (settings.kind, settings.weight, settings.footprint, held.value)
            place = tuple(value for row in matrix for value in row)
            present[f"handle {settings.number}"] = Present((kind, place), empty, held, matrix)
        return present

    def _change(self, key: str, present):
        """Restores the empty's settings from what the server has of the handle."""
        if present is None:
            return lpdeform.Removal()
        settings = present.empty.lpdeform_handle
        held = present.held
        motion = handles.motion(present.matrix, held.places, holds.KINDS[settings.kind].is_turned_only)
        last = self._told.last(key)
        if last is not None and last.value[0] == present.value[0]:
            return motion
        return lpdeform.Handle(held.vertices, motion, handles.hold(present.empty), held.points, settings.footprint)

    def _present_settings(self, ob) -> dict:
        settings = ob.lpdeform
        self._read_weights(ob)
        p = between(settings.p, settings.p_painted, self._weights["p"])
        powers = between(np.log(settings.stiffness), np.log(settings.stiffness_painted), self._weights["stiffness"])
        self.fields = {"p": np.clip(p, 1.0, 64.0), "stiffness": np.clip(np.exp(powers), 1e-6, 1e6)}
        present = {}
        scale = tuple(settings.resize)
        if scale != (1.0, 1.0, 1.0):
            present[_resize] = Present(scale, setting=lpdeform.Resize(scale))
        for name, field in self.fields.items():
            strength = getattr(settings, f"{name}_automatic")
            if _resize in present:
                present[name] = Present("of the resizing")
            elif strength > 0:
                present[name] = Present(("automatic", strength), setting=lpdeform.Automatic(strength))
            else:
                present[name] = Present(field.tobytes(), setting=field)
        effort = settings.search_effort if settings.search_effort >= 0 else None
        search = (effort, settings.search_shows, settings.search_percent / 100)
        present["solver"] = Present(search, setting=lpdeform.SolverSettings(search=lpdeform.MinimaSearch(*search)))
        region = self._weights["region"]
        may_move = np.flatnonzero(region > 0.5) if region is not None else np.zeros(0, int)
        if len(may_move) or self._told.last("region") is not None:
            present["region"] = Present(may_move.tobytes(), setting=may_move)
        return present

    def _read_weights(self, ob) -> None:
        """Reading loops over all vertices. So it is done when an operator that has touched the mesh ends: a stroke is one."""
        settings = ob.lpdeform
        names = {name: getattr(settings, f"{name}_group") for name in _painted}
        operator = _newest_operator()
        is_painted = self._is_touched and operator != self._operator
        if is_painted or self._weights.get("names") != names:
            self._weights = {name: surface.group_weights(ob, group) for name, group in names.items()}
            self._weights["names"] = names
            self._is_touched = False
        if not self._is_touched:
            self._operator = operator


def _is_past(result, frame) -> bool:
    """Whether the frame is of a newer input than the result of a solve, or of a better shape, which comes for the same input."""
    is_better = frame.input_seq == result.input_seq and frame.energy < result.energy * (1 - 1e-9)
    return frame.input_seq > result.input_seq or is_better


def _newest_operator() -> int:
    """Names the operator that was the last to make a step for undo. Blender keeps the last 32 of them."""
    ended = bpy.context.window_manager.operators
    return ended[-1].as_pointer() if len(ended) else 0


def between(plain: float, painted: float, weights):
    """One value, or one per vertex if there are weights."""
    return np.float64(plain) if weights is None else plain + weights * (painted - plain)


def of(ob):
    """The LiveMesh of a mesh object, or None."""
    return _running.get(ob.name) if ob is not None else None


def message(ob) -> str:
    return _messages.get(ob.name, "") if ob is not None else ""


def start(ob) -> None:
    """Raises NotReady with what the user has to do first."""
    if of(ob) is not None:
        return
    _messages.pop(ob.name, None)
    require()
    _running[ob.name] = LiveMesh(ob)
    if not bpy.app.timers.is_registered(tick):
        bpy.app.timers.register(tick)


def _open_session(ob, rest, faces):
    """Raises NotReady."""
    try:
        how = access()
    except OSError as error:
        raise NotReady(f"A file of the add-on's preferences cannot be read: {error}") from error
    try:
        settings = ob.lpdeform
        return lpdeform.open(
            rest, faces, address=address(), free_components="stay", weld=settings.weld, certify=settings.certify, **how
        )
    except lpdeform.Unavailable as error:
        over_tls = ", or its certificates, since TLS is on" if how["tls"] else ""
        raise NotReady(
            f"No lpdeform server answers at {address()}. Start one with deploy/up, or set its address in the add-on's preferences"
            f"{over_tls}."
        ) from error
    except lpdeform.LpdeformError as error:
        is_about_us = error.code in (lpdeform.Code.UNAUTHENTICATED, lpdeform.Code.PERMISSION_DENIED)
        what = "The server does not let us in" if is_about_us else "The mesh cannot be deformed"
        raise NotReady(f"{what}: {error}") from error


def stop(ob, keep_as: str = "", stay_muted: bool = False) -> None:
    """Ends live deformation. The mesh returns to rest, or keeps the present pose as a shape key of this name. `stay_muted`: the basis
    is kept, and other shape keys stay as they are while it is live."""
    running = _running.pop(ob.name, None)
    if running is None:
        return
    running.close()
    key = surface.live_key(ob)
    if keep_as and key is not None:
        key.name = keep_as
    else:
        surface.drop_live_key(ob, [] if stay_muted else running.muted, running.had_keys or stay_muted)
    ob.data.update_tag()


def tick():
    """Updates every live mesh; Blender's timer calls it."""
    for name, running in list(_running.items()):
        if running.is_baked:
            continue
        ob = bpy.data.objects.get(name)
        if ob is None or surface.live_key(ob) is None:
            _forget(name, "Ended: the mesh, or its shape key lpdeform, is gone.")
            continue
        try:
            running.look(ob)
            if running.frame is not None and running.state == "connected" and not running.has_refusals:
                _messages.pop(name, None)
        except NotReady as error:  # the mesh was edited, and no session can be made for it
            _forget(name, f"Ended: {error}")
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
def _after_undo(*_) -> None:
    for name, running in _running.items():
        ob = bpy.data.objects.get(name)
        if ob is not None and surface.live_key(ob) is not None and ob.mode != "EDIT":
            running.undone(ob)


@persistent
def _after_changes(_scene, graph) -> None:
    for update in graph.updates:
        one = update.id.original
        running = _running.get(one.name) if isinstance(one, bpy.types.Object) and update.is_updated_geometry else None
        if running is not None and one.name not in _showing:
            running.mesh_changed()


@persistent
def _before_another_file(*_) -> None:
    for name in list(_running):
        _running.pop(name).close()
    _messages.clear()


def register() -> None:
    bpy.app.handlers.load_pre.append(_before_another_file)
    for after in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        after.append(_after_undo)
    bpy.app.handlers.depsgraph_update_post.append(_after_changes)


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(_before_another_file)
    for after in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        after.remove(_after_undo)
    bpy.app.handlers.depsgraph_update_post.remove(_after_changes)
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)
    for name in list(_running):
        ob = bpy.data.objects.get(name)
        if ob is not None:
            stop(ob)
        else:
            _running.pop(name).close()
