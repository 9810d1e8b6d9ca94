"""The inside of a session: the lease on the server's session, the ledger of updates, the box of frames, and a Deform stream
that is kept open."""

from __future__ import annotations

import logging
import threading
import time
from typing import Any

import grpc

from lpdeform import _wire
from lpdeform._assembly import FrameAssembly
from lpdeform._following import Following
from lpdeform._lease import Lease, Original, Snapshot, check_vertex_count, create_session, join_session, restore_session
from lpdeform._ledger import Ledger
from lpdeform._recovery import Answer, Backoff, Ending, Judge, Next, RecoveryRules
from lpdeform._rpc import Rpc, new_request_id
from lpdeform._stop import Stop
from lpdeform._sending import requests
from lpdeform._status import from_call, from_fault
from lpdeform._stream import Stream
from lpdeform.errors import Code, LpdeformError, again, exception, make, session_closed
from lpdeform.frames import Frame
from lpdeform.types import Connection, MeshReport, Notice, Update
from lpdeform.v1 import frame_pb2, service_pb2

_closing_seconds = 3.0
_log = logging.getLogger("lpdeform")


class Link(Following):
    """One thread reads a stream and opens the next one. A thread of gRPC runs requests(), which sends. Calls come on any thread.

    `changed` guards all state. No call to the server is made while it is held.
    """

    def __init__(
        self,
        rpc: Rpc,
        lease: Lease,
        options: frame_pb2.FrameOptions,
        original: Original | Snapshot | None,
        is_live: bool = True,
    ) -> None:
        ledger = Ledger(begins_bare=not isinstance(original, Snapshot))
        super().__init__(ledger, lease.epoch, lease.input_seq, is_live)
        self.rpc = rpc
        self.original = original
        self.judge = Judge()
        self.lease = lease
        self.options = options
        self.is_recreated = False
        """Whether the session was lost and all its handles were sent again in one update."""
        self._request_id = new_request_id()
        self._renewing = threading.Lock()
        self._stream: Stream | None = None
        self._stream_count = 0
        self._last_open = 0.0
        self._is_to_reopen = False
        self._is_taking_over = False
        self._rules = RecoveryRules(original is not None, rpc.reconnect_for)

    @property
    def report(self) -> MeshReport:
        return self.lease.report

    @property
    def is_writer(self) -> bool:
        return bool(self.lease.writer_token)

    # Calls from users, on their own threads.

    def update(self, update: Update) -> int:
        seq = self.enter(update)
        self.start_stream()
        return seq

    def start_stream(self) -> None:
        with self.changed:
            if not self.is_live or self._thread is not None or self.is_closing or self._over is not None:
                return
            self._last_open = time.monotonic()
            self._thread = threading.Thread(target=self._run, name="lpdeform session", daemon=True)
            self._thread.start()

    def take(self) -> Frame | None:
        """The newest frame that was not taken. Taking it lets the server send more."""
        if self.is_closing:
            raise session_closed()
        self.start_stream()
        taken = self.box.take()
        if taken is None:
            return None
        self._acknowledge(taken.frame.frame_seq, taken.stream)
        return taken.frame

    def no_frame(self) -> LpdeformError:
        with self.changed:
            is_down = self._stream is None or not self._stream.is_open
            why = f" The connection is down: {self.interruption}" if is_down and self.interruption else ""
        return make(Code.DEADLINE_EXCEEDED, f"No new frame came in time.{why}", "NO_FRAME")

    @property
    def connection(self) -> Connection:
        with self.changed:
            if self.is_closing or self._over is not None:
                return "closed"
            if self._stream is not None and self._stream.is_open and not self._stream.is_over:
                return "connected"
            if self._thread is None:
                return "idle"
            return "reconnecting"

    @property
    def notice(self) -> Notice | None:
        with self.changed:
            stream = self._stream
            return stream.notice if stream is not None and stream.is_open and not stream.is_over else None

    def drop_better_shape(self) -> None:
        """The notice of a better shape no longer applies."""
        with self.changed:
            if self._stream is not None:
                self._stream.better = None

    def take_over(self) -> None:
        with self.changed:
            if self.is_closing:
                raise session_closed()
            self._is_taking_over = True
            session = self.lease.session
        try:
            lease = join_session(self.rpc, session, True, self.stop)
        except LpdeformError:
            with self.changed:
                self._is_taking_over = False
                self.changed.notify_all()
            raise
        with self.changed:
            self._is_taking_over = False
            self.lease = lease
            self.ledger.count_from(lease.input_seq)
            self.ledger.begin_epoch(lease.epoch)
            self.box.begin_epoch(lease.epoch)
            self._rules.begin()
            self._last_open = time.monotonic()
            self._is_to_reopen = self._thread is not None and self._over is None
            if self._over is not None:
                self._thread, self._over = None, None
            stream = self._stream
            self.changed.notify_all()
        if stream is not None:
            stream.cancel()
        self.box.resume()
        self.start_stream()

    def close(self) -> None:
        """Deletes the session if this client created it. If that fails, the session expires by itself."""
        with self.changed:
            if self.is_closing:
                return
            self.is_closing = True
            stream, thread = self._stream, self._thread
            self.changed.notify_all()
        self.stop.set()
        self.box.finish(session_closed())
        if stream is not None:
            stream.cancel()
        if thread is not None and thread is not threading.current_thread():
            thread.join(_closing_seconds)
        if self.original is not None:
            request = service_pb2.DeleteSessionRequest(session=self.lease.session)
            try:
                self.rpc.call("DeleteSession", request, service_pb2.DeleteSessionResponse, Stop(), _closing_seconds)
            except LpdeformError:
                pass
        self.rpc.close()

    def recreate(self, lost: str) -> None:
        """Recreates the session once, even if several callers ask."""
        assert self.original is not None
        with self._renewing:
            with self.changed:
                if self.lease.session != lost:
                    return
                request_id = self._request_id
            if isinstance(self.original, Snapshot):
                lease = restore_session(self.rpc, self.original, request_id, self.stop)
            else:
                lease = create_session(self.rpc, self.original, request_id, self.stop)
            with self.changed:
                self.lease = lease
                self._request_id = new_request_id()
                self.ledger.session_lost()
                self.is_recreated = isinstance(self.original, Original) and self.ledger.has_restore
                self.ledger.count_from(lease.input_seq)
                self.ledger.begin_epoch(lease.epoch)
                self.box.begin_session()

    # The stream, on its thread.

    def _run(self) -> None:
        try:
            while self._recover(self._one_stream()):
                pass
        except Exception as error:  # no memory for a frame: tells those who wait
            with self.changed:
                stream = self._stream
                if stream is not None:
                    stream.is_over = True
                self._give_up(exception(error))
            if stream is not None:
                stream.cancel()

    def _one_stream(self) -> LpdeformError | None:
        with self.changed:
            self._stream_count += 1
            stream = self._stream = Stream(self._stream_count)
            self._is_to_reopen = False
            lease = self.lease
        try:
            stream.call = self._deform(stream, lease)
            if self.is_closing or stream.stop.is_set:  # cancel() may have come before there was a call
                stream.cancel()
            assembly: list[FrameAssembly] = []
            for response in stream.call:
                self._take(stream, assembly, response)
            ended = None
        except LpdeformError as error:
            stream.cancel()
            ended = error
        except grpc.RpcError as error:
            ended = from_call(error, self.rpc.address)
        stream.stop.set()
        with self.changed:
            stream.is_over = True
            self.changed.notify_all()
            return stream.failure or ended

    def _deform(self, stream: Stream, lease: Lease) -> Any:
        try:
            return self.rpc.deform(requests(self, stream, lease))
        except LpdeformError:
            raise
        except ValueError:  # the channel was closed meanwhile
            raise session_closed() from None

    def _recover(self, ended: LpdeformError | None) -> bool:
        """Pauses, and recreates the session if it is lost. Returns False if the link has ended."""
        with self.changed:
            stream = self._stream
            assert stream is not None
            now = time.monotonic()
            if stream.is_open:
                self._last_open = now
            stood = now - stream.opened_at if stream.is_open else 0.0
            ending = Ending(ended, stream.go_away, stood, now - self._last_open)
            self.ledger.connection_lost()
            self.changed.notify_all()
            self.changed.wait_for(lambda: not self._is_taking_over or self.is_closing)
            if self.is_closing:
                return False
            if self._is_to_reopen:
                return True
            recovery = self._rules.after(ending)
            self.interruption = recovery.why
            if recovery.next is Next.GIVE_UP:
                self._give_up(recovery.why)
                return False
            if not self._wait_to_try_again(recovery.pause):
                return False
            lost = self.lease.session
        self.rpc.reach(lost, self.stop, Backoff.most)
        if recovery.next is Next.RESUME or self._is_to_reopen:
            return True
        return self._recreate_or_pause(lost)

    def _wait_to_try_again(self, pause: float) -> bool:
        """Waits unless the session was taken over. Returns False if it is closed."""
        self.changed.wait_for(lambda: self.is_closing or self._is_to_reopen, pause)
        return not self.is_closing

    def _recreate_or_pause(self, lost: str) -> bool:
        try:
            self.recreate(lost)
        except LpdeformError as error:
            with self.changed:
                if self._is_to_reopen:
                    return True
                failed = self._rules.after_failed_making(error)
                self.interruption = error
                if failed.next is Next.RECREATE:
                    return self._wait_to_try_again(failed.pause)
                self._give_up(error)
                return False
        return True

    def _give_up(self, why: LpdeformError) -> None:
        self.ledger.drop_unaccepted()
        self._over = why
        self.box.finish(why)
        self.changed.notify_all()

    # Messages from the server.

    def _acknowledge(self, frame_seq: int, number: int) -> None:
        with self.changed:
            stream = self._stream
            if stream is not None and stream.number == number:
                stream.ack_due = max(frame_seq, stream.ack_due)
                self.changed.notify_all()

    def _take(self, stream: Stream, assembly: list[FrameAssembly], response: service_pb2.DeformResponse) -> None:
        stream.heard_at = time.monotonic()
        if response.HasField("result"):
            with self.changed:
                self.ledger.accept(response.result.input_seq, response.result.kept)
                self._note_answered(stream, response.result.input_seq)
            return
        kind = response.event.WhichOneof("event")
        if kind == "opened":
            check_vertex_count(response.event.opened.vertex_count, self.lease.report.vertices)
            assembly[:] = [FrameAssembly(response.event.opened.vertex_count)]
            self._take_opened(stream, response.event.opened)
        elif kind == "frame":
            if not assembly:
                raise make(Code.DATA_LOSS, "A frame came before the stream was open.", "FRAME_PARTS")
            frame = assembly[0].add(response.event.frame)
            if frame is not None:
                with self.changed:
                    self._rules.frame_fitted()
                    self.ledger.show(frame.epoch, frame.input_seq)
                    stream.shown(frame)
            if frame is not None and not self.box.put(frame, stream.number):
                self._acknowledge(frame.frame_seq, stream.number)  # dropped, but its credit must be returned
        elif kind == "fault":
            self._take_fault(stream, response.event.fault)
        elif kind == "go_away":
            with self.changed:
                stream.go_away = response.event.go_away
        elif kind == "notice":
            self._take_notice(stream, response.event.notice)

    def _take_notice(self, stream: Stream, said: service_pb2.Notice) -> None:
        notice = _wire.notice_from_wire(said)
        with self.changed:
            stream.take_notice(notice)
        _log.log(logging.WARNING if notice.reason == "overloaded" else logging.INFO, "%s: %s", self.rpc.address, notice.text)

    def _take_opened(self, stream: Stream, opened: service_pb2.StreamOpened) -> None:
        self.box.begin_epoch(opened.epoch)
        with self.changed:
            if opened.heartbeat_interval_ms > 0:
                stream.longest_silence = 3 * opened.heartbeat_interval_ms / 1000
            self.ledger.count_from(opened.input_seq)
            self.ledger.reopened(opened.epoch, opened.input_seq)
            stream.is_open = True
            stream.opened_at = time.monotonic()
            self.changed.notify_all()

    def _take_fault(self, stream: Stream, fault: service_pb2.Fault) -> None:
        """Raising the error ends the stream. The next stream sends the update again, after the pause that the error asks for."""
        error = from_fault(fault)
        with self.changed:
            answer = self.judge.answer_of(error, error.input_seq)
            if error.input_seq and answer is Answer.AGAIN:
                raise error
            is_void = answer is Answer.TAKEN and 0 < error.input_seq < self.ledger.newest
            if answer is Answer.TAKEN:
                self.ledger.accept(error.input_seq)
            elif answer is Answer.REFUSED:
                self.ledger.refuse(error.input_seq)
            self._note_answered(stream, error.input_seq)
            if not is_void:
                self.box.put_problem(error)  # under the same lock: who sees the refusal in the ledger finds its error

    def _note_answered(self, stream: Stream, seq: int) -> None:
        packer = stream.uploads.pop(seq, None)
        if packer is not None:
            stream.done.append(packer)
        self.changed.notify_all()
