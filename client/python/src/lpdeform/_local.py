"""A session in this process: the solver of lpdeform._core, with the same rules for updates and frames as on a server."""

from __future__ import annotations

import logging
import os
import threading
import time
import weakref
from collections.abc import Mapping
from typing import Any

import numpy as np

from lpdeform._alone import alone
from lpdeform._box import FrameBox
from lpdeform._core import Session, Stream, create, forget_threads
from lpdeform._following import Following
from lpdeform._ledger import Ledger, NumberedUpdate
from lpdeform._notices import Notices
from lpdeform._numbers import Copied
from lpdeform._opened import Connecting, Given
from lpdeform._solving import SolveOptions, solve_took_too_long
from lpdeform._stop import Stop
from lpdeform.errors import Code, LpdeformError, about, exception, is_taken_all_the_same, make, session_closed
from lpdeform.frames import Frame, FrameHeader, QuantizedSurface, sealed
from lpdeform.types import (
    BetterShape,
    Connection,
    Defect,
    FrameOptions,
    Handle,
    IterationRecord,
    MeshReport,
    Notice,
    SolveProgress,
    SolveResult,
    Update,
    mesh_notices,
)

ADDRESS = "this process"
_closing_seconds = 3.0
_interrupt_seconds = 0.05
"""How often a wait looks for Ctrl-C."""
_log = logging.getLogger("lpdeform")
_sessions_of_parent: list[Session] = []
_sessions: weakref.WeakValueDictionary[str, Session] = weakref.WeakValueDictionary()

_links: weakref.WeakSet[LocalLink] = weakref.WeakSet()


def _forget_parent() -> None:
    """In the child of a fork: neither the threads of the parent's sessions are there, nor those that hold their locks."""
    forget_threads()
    for link in list(_links):
        link.leave_to_parent()


os.register_at_fork(after_in_child=_forget_parent)


class LocalLink(Following):
    """One thread takes frames from the session. Calls come on any thread. `changed` guards all state; the session is not called
    while it is held."""

    def __init__(
        self,
        session: Session,
        writer: tuple[str, int, int],
        options: FrameOptions,
        call_timeout: float,
        given: Given | None,
        is_live: bool = True,
    ) -> None:
        """`given`: what the session was made of, by its owner. `writer`: token, epoch and newest update; the token is empty for a reader."""
        self._token, epoch, newest = writer
        super().__init__(Ledger(), epoch, newest, is_live)
        self._report = _report_of(session)
        self.name = session.name
        self.address = ADDRESS
        self._session = session
        self._options = options
        self._call_timeout = call_timeout
        self._given = given
        self._sending = threading.Lock()
        self._notices = Notices()
        self._stream: Stream | None = None
        _links.add(self)

    def leave_to_parent(self) -> None:
        """Closes the child's copy of a session, with new locks."""
        _sessions_of_parent.append(self._session)  # its end would wait for threads
        self.changed = threading.Condition()
        self._sending = threading.Lock()
        self.stop = Stop()
        self.stop.set()
        self.box = FrameBox()
        self.box.finish(session_closed())
        self._stream = self._thread = None
        self.is_solving = False
        self.is_closing = True

    @property
    def report(self) -> MeshReport:
        return self._report

    @property
    def is_writer(self) -> bool:
        return bool(self._token)

    @property
    def vertices(self) -> Copied | None:
        return None if self._given is None else self._given.vertices

    @property
    def faces(self) -> Copied | None:
        return None if self._given is None else self._given.faces

    # Changes.

    def update(self, update: Update) -> int:
        seq = self.enter(update)
        if self.is_live:  # otherwise solve() sends it, and raises what is wrong
            self._send_waiting(self.box.put_problem)
            self._start_stream()
        return seq

    def _send_waiting(self, refused: Any = None) -> None:
        """Gives the session what waits, in order. With `refused`, calls it with an error instead of raising it, and leaves
        everything to a call that has the session to itself."""
        with self._sending:
            while True:
                with self.changed:
                    if not self.ledger.has_waiting or (refused is not None and self.is_solving):
                        return
                    update, token = self.ledger.send_next(), self._token
                try:
                    self._session.update(token, update.update, update.seq)
                except LpdeformError as error:
                    about(error, update.seq)
                    with self.changed:
                        if is_taken_all_the_same(error):
                            self.ledger.accept(update.seq)
                        else:
                            self.ledger.refuse(update.seq)
                        if refused is not None:
                            refused(error)
                            continue
                    raise
                with self.changed:
                    self.ledger.accept(update.seq)
                    self.changed.notify_all()

    # Frames.

    def _start_stream(self) -> None:
        with self.changed:
            if not self.is_live or self._thread is not None or self.is_closing or self._over is not None:
                return
            self._stream = self._session.open_stream(self._token, self._options)
            self._thread = threading.Thread(
                target=self._run, args=(self._stream,), name="lpdeform session", daemon=True
            )
            self._thread.start()

    def _run(self, stream: Stream) -> None:
        try:
            while (told := stream.next()) is not None:
                if told[0] == "end":
                    self._end(stream, make(_end_codes[told[1]], told[2], told[1]))
                    break
                self._take(stream, told)
        except Exception as error:  # no memory for a frame: tells those who wait
            self._end(stream, exception(error))
        self._session.forget_stream(stream)

    def _end(self, stream: Stream, why: LpdeformError) -> None:
        with self.changed:
            if stream is not self._stream or self.is_closing:
                return
            self.interruption = self._over = why
            self.ledger.drop_unaccepted()
            self.box.finish(why)
            self.changed.notify_all()

    def _take(self, stream: Stream, told: tuple[Any, ...]) -> None:
        kind = told[0]
        if kind == "opened":
            self.box.begin_epoch(told[1])
            with self.changed:
                self.ledger.count_from(told[2])
        elif kind == "frame":
            frame = _frame_of(told[1])
            with self.changed:
                self._notices.shown(frame)
            if not self.box.put(frame, 0):
                stream.acknowledge(frame.frame_seq)
        elif kind == "fault":
            error = about(told[1], told[2])
            with self.changed:
                if not 0 < error.input_seq < self.ledger.newest:
                    self.box.put_problem(error)
        elif kind == "better":
            self._take_notice(Notice("better_shape", *told[1:]))
        elif kind == "load":
            text = "This process is overloaded: frames come less often, and refined ones later."
            over = "This process is no longer overloaded."
            self._take_notice(Notice("overloaded", text) if told[1] else Notice("recovered", over))

    def _take_notice(self, notice: Notice) -> None:
        with self.changed:
            self._notices.take_notice(notice)
        _log.log(logging.WARNING if notice.reason == "overloaded" else logging.INFO, "%s: %s", ADDRESS, notice.text)

    def take(self) -> Frame | None:
        if self.is_closing:
            raise session_closed()
        self._start_stream()
        taken = self.box.take()
        if taken is None:
            return None
        with self.changed:
            stream = self._stream
        if stream is not None:
            stream.acknowledge(taken.frame.frame_seq)
        return taken.frame

    def no_frame(self) -> LpdeformError:
        return make(Code.DEADLINE_EXCEEDED, "No new frame came in time.", "NO_FRAME")

    @property
    def connection(self) -> Connection:
        with self.changed:
            if self.is_closing or self._over is not None:
                return "closed"
            return "idle" if self._thread is None else "connected"

    @property
    def notice(self) -> Notice | None:
        with self.changed:
            return None if self.is_closing or self._over is not None else self._notices.notice

    # Calls.

    def solve(self, options: SolveOptions, stop: Stop) -> SolveResult:
        deadline = None if options.timeout is None else time.monotonic() + options.timeout
        longest = self._call_timeout if options.timeout is None else min(options.timeout, self._call_timeout)
        try:
            with alone(self, longest, stop):
                if deadline is not None and time.monotonic() >= deadline:
                    raise make(Code.DEADLINE_EXCEEDED, "The time for the solve has passed.", "SOLVE_TIME_PASSED")
                self._send_waiting()
                return self._solve(options, deadline, stop)
        finally:
            self._send_waiting(self.box.put_problem)

    def _solve(self, options: SolveOptions, deadline: float | None, stop: Stop) -> SolveResult:
        initial = options.initial_positions
        positions = None if initial is None else initial.astype(np.float64, copy=False)
        told = options.on_progress
        job = self._session.solve(self._token, options.certify, options.trace, positions, told is not None)
        looked = time.monotonic()
        try:
            while not job.wait(_interrupt_seconds):
                now = time.monotonic()
                if stop.is_set:
                    raise make(Code.CANCELLED, "The call was ended.")
                if deadline is not None and now >= deadline:
                    raise solve_took_too_long(options.timeout)
                if told is not None and now >= looked + 0.1 and (newest := job.progress()) is not None:
                    looked = now
                    told(SolveProgress(*newest))
            solved = job.result(options.with_normals)
        finally:
            job.abandon()  # an interrupt, or a progress function that raises; without effect on a finished solve
        self.drop_better_shape()
        return _result_of(solved, self.faces)

    def drop_better_shape(self) -> None:
        with self.changed:
            self._notices.better = None

    def undo(self, redo: bool, stop: Stop) -> int:
        self.require_writer()
        try:
            with alone(self, self._call_timeout, stop):
                self._send_waiting()
                with self.changed:
                    seq = self.ledger.take_number()
                self._session.undo(self._token, seq, redo)
                with self.changed:
                    self.ledger.accept_change(NumberedUpdate(seq, Update()), False)
        finally:
            self._send_waiting(self.box.put_problem)
        return seq

    def take_better_shape(self, stop: Stop) -> BetterShape:
        self.require_writer()
        if self.is_closing:
            raise session_closed()
        try:
            taken = self._session.take_better(self._token)
        except LpdeformError as error:
            if error.reason == "NO_BETTER_SHAPE":
                self.drop_better_shape()
            raise
        self.drop_better_shape()
        return BetterShape(*taken)

    def snapshot(self, stop: Stop) -> bytes:
        try:
            with alone(self, self._call_timeout, stop):
                self._send_waiting()
                text = "A session in this process cannot be written as a file; a session on a server can."
                raise make(Code.UNIMPLEMENTED, text, "NO_SNAPSHOT")
        finally:
            self._send_waiting(self.box.put_problem)

    def take_over(self) -> None:
        if self.is_closing:
            raise session_closed()
        token, epoch, newest = self._session.acquire_writer()
        with self.changed:
            self._token = token
            self._over = None
            self.ledger.count_from(newest)
            self.ledger.begin_epoch(epoch)
            self.box.begin_epoch(epoch)
            stream, thread = self._stream, self._thread
            self._stream = self._thread = None
        if stream is not None:
            stream.stop()
        if thread is not None:
            thread.join(_closing_seconds)
        self.box.resume()
        self._start_stream()

    def close(self) -> None:
        with self.changed:
            if self.is_closing:
                return
            self.is_closing = True
            stream, thread = self._stream, self._thread
            self.changed.notify_all()
        self.stop.set()
        self.box.finish(session_closed())
        if self._given is not None:
            self._session.close()
        if stream is not None:
            stream.stop()
        if thread is not None and thread is not threading.current_thread():
            thread.join(_closing_seconds)


class Local(Connecting):
    """Opens sessions in this process."""

    def __init__(self, call_timeout: float) -> None:
        self._call_timeout = call_timeout

    def open(self, given: Given, handles: Mapping[str, Handle] | None, options: FrameOptions, stop: Stop, is_live: bool = True) -> LocalLink:
        session = create(
            _doubles(given.vertices),
            given.faces,
            None if given.normals is None else _doubles(given.normals),
            given.weld,
            given.weights,
            given.free_components,
            given.settings,
        )
        _sessions[session.name] = session
        link = LocalLink(session, session.lease(), options, self._call_timeout, given, is_live)
        link.begin_with(handles)
        return link

    def join(self, name: str, as_writer: bool, options: FrameOptions, stop: Stop) -> LocalLink:
        session = _sessions.get(name)
        if session is None or session.is_closed:
            text = "There is no such session in this process; one on a server needs its address."
            raise make(Code.NOT_FOUND, text, "SESSION_UNKNOWN", "session")
        if as_writer:
            return LocalLink(session, session.acquire_writer(), options, self._call_timeout, None)
        _, epoch, newest = session.lease()
        return LocalLink(session, ("", epoch, newest), options, self._call_timeout, None)

    def restore(self, snapshot: bytes, options: FrameOptions, stop: Stop) -> LocalLink:
        text = "A file can be restored by a server only: give its address."
        raise make(Code.UNIMPLEMENTED, text, "NO_SNAPSHOT")


_end_codes = {"WRITER_REPLACED": Code.ABORTED, "SESSION_DELETED": Code.NOT_FOUND}


def _doubles(array: Copied) -> Copied:
    return np.ascontiguousarray(array, np.float64)


def _report_of(session: Session) -> MeshReport:
    vertices, faces, edges, components, boundary_loops, found, welded = session.report()
    defects = tuple(Defect(*one) for one in found)
    return MeshReport(vertices, faces, edges, components, boundary_loops, defects, welded, mesh_notices(defects))


def _frame_of(told: dict[str, Any]) -> Frame:
    frame = Frame(FrameHeader(*(told[name] for name in FrameHeader._fields)))
    if "vertices" in told:
        frame.quantized = QuantizedSurface(
            told["vertices"],
            told["quantized_normals"],
            np.array(told["origin"]),
            np.array(told["extent"]),
            told["distortion_extent"],
        )
    else:
        frame._raw = {name: sealed(told[name]) for name in ("positions", "distortion", "normals")}
    frame.wire_bytes = told["bytes"]
    frame.received_at = time.perf_counter()
    return frame


def _result_of(solved: dict[str, Any], faces: Copied | None) -> SolveResult:
    solved.pop("bytes")
    trace = tuple(IterationRecord(*one) for one in solved.pop("trace"))
    return SolveResult(**solved, trace=trace, faces=faces)
