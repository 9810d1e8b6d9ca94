"""One Solve call, from its request to the finished result, and what becomes of it where the server goes away."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import grpc
import numpy as np
import numpy.typing as npt

from lpdeform import _wire
from lpdeform._lease import Lease
from lpdeform._ledger import NumberedUpdate
from lpdeform._link import Link
from lpdeform._numbers import Copied, numbers
from lpdeform._recovery import Backoff
from lpdeform._rpc import Packer, Stop
from lpdeform.errors import (
    Code,
    LpdeformError,
    from_call,
    invalid,
    is_session_lost,
    is_taken_all_the_same,
    is_undecided,
    make,
    session_closed,
)
from lpdeform.frames import Frame, FrameAssembly, method_name, stop_reason_name
from lpdeform.types import IterationRecord, SolveProgress, SolveResult
from lpdeform.v1 import data_pb2, service_pb2


@dataclass(frozen=True, eq=False)
class SolveOptions:
    certify: bool = False
    trace: bool = False
    with_normals: bool = False
    initial_positions: Copied | None = None
    on_progress: Callable[[SolveProgress], None] | None = None
    timeout: float | None = None


def checked_positions(values: npt.ArrayLike | None, vertex_count: int) -> Copied | None:
    """Here, so that what the server finds invalid can only be the update."""
    if values is None:
        return None
    positions = numbers(values, "initial positions", 3)
    if len(positions) != vertex_count:
        text = f"There are {len(positions)} initial positions for {vertex_count} vertices."
        raise invalid(text, "POSITIONS_SIZE", "", f"positions = {vertex_count}")
    bad = np.flatnonzero(~np.isfinite(positions).all(axis=1))
    if bad.size:
        text = f"The initial position of vertex {bad[0]} is not finite."
        raise invalid(text, "POSITIONS_NOT_FINITE", f"vertex {bad[0]}")
    return positions


def solve(link: Link, options: SolveOptions, stop: Stop) -> SolveResult:
    """Begins again where the server went away, within the timeout and for as long as the stream would."""
    deadline = None if options.timeout is None else time.monotonic() + options.timeout
    longest = link.rpc.call_timeout if options.timeout is None else min(options.timeout, link.rpc.call_timeout)
    with link.changed:
        is_quiet = link.changed.wait_for(
            lambda: link.is_closing or stop.is_set or (not link.is_solving and not link.ledger.has_in_flight), longest
        )
        if link.is_closing:
            raise session_closed()
        if stop.is_set:
            raise make(Code.CANCELLED, "The call was ended.")
        if not is_quiet:
            text = "Another solve, or an update that the server has not answered, is under way."
            raise make(Code.DEADLINE_EXCEEDED, text, "SOLVE_UNDER_WAY")
        link.is_solving = True
    try:
        return _solve_patiently(link, options, deadline, stop)
    finally:
        with link.changed:
            link.is_solving = False
            link.changed.notify_all()


def _solve_patiently(link: Link, options: SolveOptions, deadline: float | None, stop: Stop) -> SolveResult:
    backoff = Backoff()
    latest = None
    while True:
        session = link.lease.session
        try:
            left = None if deadline is None else max(deadline - time.monotonic(), 0.0)
            return _solve_once(link, options, left, stop)
        except LpdeformError as error:
            if link.is_closing:
                raise session_closed() from None
            is_lost = is_session_lost(error) and link.original is not None
            if stop.is_set or not (is_lost or error.code is Code.UNAVAILABLE):
                raise
            pause = backoff.next()
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
                link.make_anew(session)
            except LpdeformError as error:
                if not is_undecided(error):
                    raise


def _solve_once(link: Link, options: SolveOptions, timeout: float | None, stop: Stop) -> SolveResult:
    _send_restore(link, stop)
    with link.changed:
        update = link.ledger.send_next() if link.ledger.has_waiting else None
        lease = link.lease
    try:
        result = _run(link, lease, update, options, timeout, stop)
    except LpdeformError as error:
        if update is not None:
            with link.changed:
                if is_taken_all_the_same(error):
                    link.ledger.accept(update.seq)
                elif is_undecided(error):
                    link.ledger.connection_lost()
                else:
                    link.ledger.refuse(update.seq)
        raise
    if update is not None:
        with link.changed:
            link.ledger.accept(update.seq)
    return result


def _send_restore(link: Link, stop: Stop) -> None:
    """Gives a session made anew what the lost one had, on its own: it must not fall with an update that is refused."""
    while True:
        with link.changed:
            if not link.ledger.has_restore:
                return
            restore = link.ledger.send_next()
            lease = link.lease
        packer = Packer(link.rpc, stop)
        try:
            request = service_pb2.UpdateHandlesRequest(
                session=lease.session,
                writer_token=lease.writer_token,
                update=_wire.update_to_wire(restore.update, restore.seq, packer),
            )
            link.rpc.call("UpdateHandles", request, service_pb2.UpdateHandlesResponse, stop)
        except LpdeformError:
            with link.changed:
                link.ledger.connection_lost()
            raise
        finally:
            packer.discard()
        with link.changed:
            link.ledger.accept(restore.seq)


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
        builder = _ResultBuilder(lease.report.vertices, options)
        for response in call:
            builder.take(response)
        return builder.finish()
    except grpc.RpcError as error:
        raise from_call(error, link.rpc.address) from None
    finally:
        if call is not None:
            call.cancel()  # an interrupt in a notebook; without effect on one that is over
            stop.remove(call)
        packer.discard()


class _ResultBuilder:
    """Takes in the messages of a Solve call."""

    def __init__(self, vertex_count: int, options: SolveOptions) -> None:
        self._assembly = FrameAssembly(vertex_count)
        self._options = options
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
            trace=tuple(self._trace),
        )
