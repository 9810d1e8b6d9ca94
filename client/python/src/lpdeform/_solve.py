"""One Solve call from its request to the finished result, and how it recovers if the server goes away."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import grpc

from lpdeform import _wire
from lpdeform._alone import alone
from lpdeform._assembly import FrameAssembly, method_name, stop_reason_name
from lpdeform._lease import Lease
from lpdeform._ledger import Ledger, NumberedUpdate
from lpdeform._link import Link
from lpdeform._recovery import Answer, Backoff, answer_of
from lpdeform._rpc import Packer
from lpdeform._sending_alone import send_restore
from lpdeform._solving import SolveOptions, solve_took_too_long
from lpdeform._status import from_call
from lpdeform._stop import Stop
from lpdeform.errors import (
    Code,
    LpdeformError,
    Unavailable,
    is_session_lost,
    is_undecided,
    make,
)
from lpdeform.frames import Frame
from lpdeform.types import IterationRecord, SolveProgress, SolveResult
from lpdeform.v1 import data_pb2, service_pb2


def solve(link: Link, options: SolveOptions, stop: Stop) -> SolveResult:
    """Starts again if the server went away, within the timeout and for as long as the stream would."""
    deadline = None if options.timeout is None else time.monotonic() + options.timeout
    longest = link.rpc.call_timeout if options.timeout is None else min(options.timeout, link.rpc.call_timeout)
    with alone(link, longest, stop):
        return _solve_patiently(link, options, deadline, stop)


def _solve_patiently(link: Link, options: SolveOptions, deadline: float | None, stop: Stop) -> SolveResult:
    backoff = Backoff()
    latest = None
    while True:
        session = link.lease.session
        try:
            return _solve_once(link, options, _left(deadline), stop)
        except LpdeformError as error:
            is_lost = is_session_lost(error) and link.original is not None
            if stop.is_set or link.is_closing or not (is_lost or error.code is Code.UNAVAILABLE):
                raise
            pause = backoff.next(error.retry_after)
            now = time.monotonic()
            latest = latest or now + link.rpc.reconnect_for
            if now + pause > min(latest, latest if deadline is None else deadline):
                raise
        with link.changed:
            link.changed.wait_for(lambda: link.is_closing or stop.is_set, pause)
        left = Backoff.most if deadline is None else deadline - time.monotonic()
        link.rpc.reach(session, stop, min(Backoff.most, max(left, 0.0)))
        if is_lost:
            try:
                link.recreate(session)
            except LpdeformError as error:
                if not is_undecided(error):
                    raise


def _left(deadline: float | None) -> float | None:
    if deadline is None:
        return None
    left = deadline - time.monotonic()
    if left <= 0:
        raise make(Code.DEADLINE_EXCEEDED, "The time for the solve has passed.", "SOLVE_TIME_PASSED")
    return left


def _solve_once(link: Link, options: SolveOptions, timeout: float | None, stop: Stop) -> SolveResult:
    send_restore(link, stop)
    with link.changed:
        update = link.ledger.send_next() if link.ledger.has_waiting else None
        lease = link.lease
    try:
        result = _run(link, lease, update, options, timeout, stop)
    except BaseException as error:  # also an interrupt in a notebook
        with link.changed:
            if update is not None:
                _note_answer(link.ledger, update.seq, error)
            if isinstance(error, Unavailable):
                link.ledger.resumed_at(0)  # the server may have gone back; sending twice does no harm
        raise
    with link.changed:
        if update is not None:
            link.ledger.accept(update.seq)
        if result.input_seq < link.ledger.newest_accepted:
            link.ledger.resumed_at(result.input_seq)
            if link.ledger.has_restore:
                raise make(Code.UNAVAILABLE, "The server went back to an earlier state.")
    return result


def _note_answer(ledger: Ledger, seq: int, error: BaseException) -> None:
    """Notes what became of the update that a call carried."""
    answer = answer_of(error) if isinstance(error, LpdeformError) else Answer.AGAIN
    if answer is Answer.TAKEN:
        ledger.accept(seq)
    elif answer is Answer.REFUSED:
        ledger.refuse(seq)
    else:
        ledger.connection_lost()


def _run(
    link: Link, lease: Lease, update: NumberedUpdate | None, options: SolveOptions, timeout: float | None, stop: Stop
) -> SolveResult:
    packer = Packer(link.rpc, stop)
    request = service_pb2.SolveRequest(
        session=lease.session,
        writer_token=lease.writer_token,
        scalar=data_pb2.SCALAR_FLOAT64,
        certify=options.certify,
        trace=options.trace,
        progress=options.on_progress is not None,
        normals=options.with_normals,
    )
    call: Any = None
    try:
        if update is not None:
            request.update.CopyFrom(_wire.update_to_wire(update.update, update.seq, packer))
        if (initial := options.initial_positions) is not None:
            request.initial_positions.scalar = _wire.scalar_of(initial)
            request.initial_positions.data.CopyFrom(packer.pack(initial.tobytes()))
        call = link.rpc.solve(request, timeout)
        stop.add(call)
        builder = _ResultBuilder(lease.report.vertices, options, link.drop_better_shape)
        for response in call:
            builder.take(response)
        return builder.finish()
    except grpc.RpcError as error:
        why = from_call(error, link.rpc.address)
        if timeout is not None and why.code is Code.DEADLINE_EXCEEDED and not why.reason:
            why = solve_took_too_long(options.timeout)
        raise why from None
    finally:
        if call is not None:
            call.cancel()  # an interrupt in a notebook; without effect on a finished call
            stop.remove(call)
        packer.discard()


class _ResultBuilder:
    """Handles the messages of a Solve call."""

    def __init__(self, vertex_count: int, options: SolveOptions, on_solved: Callable[[], None]) -> None:
        """`on_solved`: called once the server has solved, before the result has come."""
        self._assembly = FrameAssembly(vertex_count)
        self._options = options
        self._on_solved = on_solved
        self._summary: service_pb2.SolveSummary | None = None
        self._trace: list[IterationRecord] = []
        self._frame: Frame | None = None

    def take(self, response: service_pb2.SolveResponse) -> None:
        kind = response.WhichOneof("message")
        if kind == "progress" and self._options.on_progress is not None:
            progress = response.progress
            self._options.on_progress(SolveProgress(progress.iteration, progress.energy, progress.seconds))
        elif kind == "summary":
            self._summary = response.summary
            self._on_solved()
        elif kind == "trace":
            for one in response.trace.records:
                self._trace.append(IterationRecord(one.iteration, one.seconds, one.energy, one.objective, one.stage))
        elif kind == "frame":
            self._frame = self._assembly.add(response.frame) or self._frame

    def finish(self) -> SolveResult:
        summary, frame = self._summary, self._frame
        if summary is None or frame is None:
            raise make(Code.DATA_LOSS, "The server's result came without positions.", "FRAME_PARTS")
        return SolveResult(
            positions=frame.positions,
            distortion=frame.distortion,
            normals=frame.normals,
            method=method_name(summary.method),
            stop_reason=stop_reason_name(summary.stop_reason),
            iterations=summary.iterations,
            initial_energy=summary.initial_energy,
            energy=summary.energy,
            soft_energy=summary.soft_energy,
            optimality_gap=summary.certificate.relative_gap if summary.HasField("certificate") else None,
            setup_seconds=summary.setup_seconds,
            solve_seconds=summary.solve_seconds,
            threads=summary.threads,
            input_seq=summary.input_seq,
            minima=tuple(summary.minima),
            further_starts=summary.further_starts,
            search_iterations=summary.search_iterations,
            effort=summary.effort,
            trace=tuple(self._trace),
        )
