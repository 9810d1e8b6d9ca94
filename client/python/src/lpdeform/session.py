"""Sessions as programs use them."""

from __future__ import annotations

import atexit
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterator, Mapping
from numbers import Real
from types import TracebackType
from typing import Any, TypeVar

import numpy.typing as npt

from lpdeform._checks import typed
from lpdeform._groups import chosen
from lpdeform._opened import Opened
from lpdeform._progress import told_by
from lpdeform._solving import SolveOptions, checked_positions
from lpdeform.errors import LpdeformError, invalid, session_closed
from lpdeform.frames import Frame
from lpdeform.types import (
    BetterShape,
    Change,
    Connection,
    Field,
    Group,
    Handle,
    Hold,
    Exact,
    Fixed,
    MeshReport,
    Motion,
    Notice,
    Removal,
    Resize,
    RigidMotion,
    Settings,
    SolveProgress,
    SolveResult,
    SolverSettings,
    SurfacePoints,
    Targets,
    Update,
    Vector3,
)

Self = TypeVar("Self", bound="Live")
_no_motion = Fixed()
_links: weakref.WeakSet[Opened] = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    for link in list(_links):
        link.close()
    core = sys.modules.get("lpdeform._core")
    if core is not None:
        core.end_threads()


def _abandon(link: Opened) -> None:
    """Closes the link of a session without references. The garbage collector may run on any thread, so it must not wait here."""
    threading.Thread(target=link.close, daemon=True).start()


class Live:
    """The functions of sessions that do not wait. Changes that come faster than the connection takes them are coalesced: the
    newest value of each handle and each setting wins."""

    def __init__(self, link: Opened) -> None:
        self._link = link
        _links.add(link)
        finalizer: Any = weakref.finalize(self, _abandon, link)
        finalizer.atexit = False

    @property
    def name(self) -> str:
        """"sessions/<32 hexadecimal digits>"; it changes when the session has to be recreated."""
        return self._link.name

    @property
    def address(self) -> str:
        """The server's address, or "this process"."""
        return self._link.address

    @property
    def mesh_report(self) -> MeshReport:
        """What was found of the mesh when the session was opened."""
        return self._link.report

    @property
    def connection(self) -> Connection:
        """"idle" before the first update or frame; "reconnecting" while the server is away; "closed" at the end."""
        return self._link.connection

    @property
    def interruption(self) -> LpdeformError | None:
        """Why the session is "reconnecting", or was the last time: DRAINING if the server shuts down."""
        return self._link.interruption

    @property
    def notice(self) -> Notice | None:
        """The notice of a better shape for as long as it applies: until it is taken, a frame for a later update comes, or a
        solve() ends. Otherwise the last notice of the server about itself on the present stream; None if there was none. Each is also logged, by
        the logger "lpdeform": as a warning if the server is overloaded."""
        return self._link.notice

    @property
    def newest_input(self) -> int:
        """The newest update that was not refused; 0 if there is none."""
        with self._link.changed:
            return self._link.ledger.newest

    def update(
        self,
        handles: Mapping[str, Change] | None = None,
        settings: Settings | None = None,
        resize: Resize | None = None,
        begins_step: bool = False,
    ) -> int:
        """Sends a change, which the server accepts or refuses as a whole, and returns its number. A frame whose input_seq is at
        least that number takes the change into account. `begins_step`: its effect on handles is undone separately, see Update.

        If the server refuses the change, the next call that takes frames raises the error, once. The session goes on without the
        change, and without changes that were coalesced with it. Raises at once if the session is closed (SESSION_CLOSED), for a
        reader (NOT_THE_WRITER), and for arrays of the wrong type or shape.
        """
        typed(handles, Mapping, "handles")
        typed(settings, Settings, "settings")
        typed(resize, Resize, "resize")
        changes = {name: chosen(change, self._link.vertices) for name, change in (handles or {}).items()}
        return self._link.update(Update(changes, settings or Settings(), resize, begins_step))

    def set_handles(self, handles: Mapping[str, Handle]) -> int:
        """Adds handles, or replaces those with the same names. Raises as update()."""
        return self.update(handles)

    def set_handle(
        self,
        name: str,
        vertices: Group = (),
        motion: Motion = _no_motion,
        *,
        hold: Hold = Exact(),
        points: SurfacePoints | None = None,
        footprint: float = 0.0,
    ) -> int:
        """Adds a handle, or replaces the one with this name. `vertices`: indices, a boolean mask over all n vertices, or a
        function that gets the n x 3 rest vertices and returns either. Raises as update()."""
        return self.update({name: Handle(vertices, motion, hold, points, footprint)})

    def drag(
        self,
        name: str,
        motion: Motion | None = None,
        *,
        translation: Vector3 | None = None,
        axis: Vector3 | None = None,
        angle: float | None = None,
        center: Vector3 | None = None,
        targets: npt.ArrayLike | None = None,
    ) -> int:
        """Moves a handle without waiting for the surface. Raises as update(); the motion is given as in move()."""
        return self.update({name: motion_of(motion, translation, axis, angle, center, targets)})

    def remove(self, name: str) -> int:
        """Removes a handle. Raises as update()."""
        return self.update({name: Removal()})

    def set(
        self,
        *,
        p: Field | None = None,
        stiffness: Field | None = None,
        length_unit: float | None = None,
        solver: SolverSettings | None = None,
        region: npt.ArrayLike | None = None,
    ) -> int:
        """Changes the given settings. Raises as update()."""
        return self.update(settings=Settings(p, stiffness, length_unit, solver, region))

    def poll(self) -> Frame | None:
        """The newest frame that was not taken, or None; does not wait.

        Taking a frame lets the server send more, so a reader that stops asking costs a bounded number of frames. Raises the
        server's error about an update, once; when nothing more comes, raises the reason.
        """
        return self._link.take()

    def _solve_options(
        self,
        certify: bool,
        trace: bool,
        with_normals: bool,
        initial_positions: npt.ArrayLike | None,
        on_progress: Callable[[SolveProgress], None] | None,
        timeout: float | None,
    ) -> SolveOptions:
        if self._link.is_closing:
            raise session_closed()
        if timeout is not None:
            deadline_after(timeout)
        positions = checked_positions(initial_positions, self.mesh_report.vertices)
        return SolveOptions(bool(certify), bool(trace), bool(with_normals), positions, on_progress, timeout)


class Session(Live):
    """A mesh that is deformed, in this process or on a server; open() and join() make sessions. Every function may be called from any thread.

    Frames come over a stream. If it breaks, the session reconnects with growing pauses: to the same session if the server still
    has it, otherwise to a new one that it creates from its own copy of mesh, handles and settings. Frames of an older epoch or an
    older update than an earlier frame are dropped.

    Iterating gives frames as they come, the newest first.
    """

    def move(
        self,
        name: str,
        motion: Motion | None = None,
        *,
        translation: Vector3 | None = None,
        axis: Vector3 | None = None,
        angle: float | None = None,
        center: Vector3 | None = None,
        targets: npt.ArrayLike | None = None,
        timeout: float = 60.0,
    ) -> Frame:
        """Moves a handle and waits for the finished result.

        Give a motion; or its parts, x = R (p - center) + center + translation with the rotation by `angle` radians about `axis`;
        or `targets`, one position per vertex. The motion is always relative to the rest mesh: calling twice has the same effect
        as once.
        """
        deadline_after(timeout)
        self.drag(name, motion, translation=translation, axis=axis, angle=angle, center=center, targets=targets)
        return self.settle(timeout)

    def next_frame(self, timeout: float = 60.0) -> Frame:
        """Waits for the newest frame that was not taken. Raises as poll(), and Timeout (NO_FRAME); at once if the timeout is
        0."""
        return self._wait_for(self._link.take, deadline_after(timeout))

    def settle(self, timeout: float = 60.0) -> Frame:
        """The finished result of the newest update. Takes frames until it comes.

        Returns at once, even with a timeout of 0 or without a connection, if the last frame taken, here or by next_frame() or
        poll(), is that result. Does not wait for its optimality_gap, which the next frame has. Raises as next_frame().
        """
        return self._wait_for(self._link.take_result, deadline_after(timeout))

    def _wait_for(self, ask: Callable[[], Frame | None], deadline: float) -> Frame:
        while True:
            takes = self._link.box.takes
            frame = ask()
            if frame is not None:
                return frame
            if not self._link.box.wait(deadline, takes):
                raise self._link.no_frame()

    def __iter__(self) -> Iterator[Frame]:
        """Ends when the session is closed; if it ended otherwise, raises the reason."""
        while not self._link.is_closing:
            try:
                yield self._wait_for(self._link.take, time.monotonic() + 3600)
            except LpdeformError as error:
                if error.reason == "SESSION_CLOSED":
                    return
                if error.reason != "NO_FRAME":
                    raise

    def solve(
        self,
        *,
        certify: bool = False,
        trace: bool = False,
        with_normals: bool = False,
        initial_positions: npt.ArrayLike | None = None,
        on_progress: Callable[[SolveProgress], None] | None = None,
        progress: bool | Callable[[SolveProgress], None] | None = None,
        timeout: float | None = None,
    ) -> SolveResult:
        """Solves for the present handles and settings, and returns the finished result in float64.

        `progress`: a function that is called at most ten times per second, or True for a bar, by tqdm if it is installed; `on_progress`
        is the same for a function. If the server goes away, the solve starts again, for as long as the
        stream would. `timeout`: seconds in all, including the wait for another solve; None is without limit; with 0 nothing is
        sent. Changes made during the solve wait and are sent after it. Raises the server's errors, and Timeout: SOLVE_UNDER_WAY
        if the time was spent waiting, SOLVE_TIME_PASSED if the solve was not finished in time. Raises SESSION_CLOSED (FAILED_PRECONDITION)
        if close() is called meanwhile.
        """
        with told_by(progress if progress is not None else on_progress) as told:
            options = self._solve_options(certify, trace, with_normals, initial_positions, told, timeout)
            return self._link.solve(options, self._link.stop)

    def undo(self) -> int:
        """Undoes the newest step of the handles on the server, and returns the number of the update that the undo is.

        A step is what a person sees as one change: updates that move the same handles, none of them more than a second after the
        one before; or any other update that changes handles. `begins_step` of update() always begins a new step. Settings are not
        part of a step. The undo is sent after all earlier changes; it waits for the answer, and settle() waits for the frame.
        Raises FAILED_PRECONDITION NOTHING_TO_UNDO (also for steps before the session had to be recreated), NOT_THE_WRITER for a
        reader, the server's error about an earlier change, Timeout.
        """
        return self._link.undo(False, self._link.stop)

    def redo(self) -> int:
        """Redoes the step that was undone last. Raises as undo(), and NOTHING_TO_REDO."""
        return self._link.undo(True, self._link.stop)

    def take_better_shape(self) -> BetterShape:
        """Shows the better shape that the notice "better_shape" has announced, as a new final frame for the same update.

        The shape is not part of the steps of undo(). The call is not repeated: after Unavailable or Timeout the shape may have been
        taken, which a frame then shows. Raises FAILED_PRECONDITION NO_BETTER_SHAPE if none is known for the newest update, as
        after solve(), which makes the session forget it and search again; NOT_THE_WRITER for a reader.
        """
        return self._link.take_better_shape(self._link.stop)

    def snapshot(self) -> bytes:
        """The session as a file for restore(): mesh, handles, settings, steps to undo, and the present surface.

        The file includes all earlier changes. Waits until all its parts have come; changes made meanwhile are sent afterwards.
        Raises the server's error about an earlier change, RESOURCE_EXHAUSTED, Timeout.
        """
        return self._link.snapshot(self._link.stop)

    def take_over(self) -> None:
        """Becomes the writer in place of the present one, as a reader or after a WRITER_REPLACED."""
        self._link.take_over()

    def close(self) -> None:
        """Ends the stream and every waiting call. Deletes the session on the server if open() created it; if no server
        answers, the session expires there by itself."""
        self._link.close()

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._link.close()

    def __repr__(self) -> str:
        return f"<Session at {self.address}: {self.mesh_report.vertices} vertices, {self.connection}>"


def deadline_after(timeout: float) -> float:
    """On the clock of time.monotonic()."""
    given: object = timeout  # of callers without a type checker
    if not isinstance(given, Real) or not timeout >= 0:
        raise invalid(f"The timeout is {timeout} seconds.", "SECONDS_OUT_OF_RANGE", "timeout", "0 <= timeout")
    return time.monotonic() + timeout


def motion_of(
    motion: Motion | None,
    translation: Vector3 | None,
    axis: Vector3 | None,
    angle: float | None,
    center: Vector3 | None,
    targets: npt.ArrayLike | None,
) -> Motion:
    parts = {"translation": translation, "axis": axis, "angle": angle, "center": center}
    given = {name: value for name, value in parts.items() if value is not None}
    if (motion is not None) + (targets is not None) + bool(given) > 1:
        raise invalid("A motion, its parts and targets exclude each other.", "MOTION_TWICE")
    if motion is not None:
        return motion
    if targets is not None:
        return Targets(targets)
    if not given:
        raise invalid("There is no motion: give translation, axis and angle, targets, or a motion.", "MOTION_MISSING")
    return RigidMotion(**given)  # type: ignore[arg-type]
