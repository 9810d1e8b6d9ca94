"""Steps of the handles taken back on the server, and done again."""

from __future__ import annotations

import time

from lpdeform import _wire
from lpdeform._alone import alone, send_restore, send_waiting
from lpdeform._ledger import NumberedUpdate
from lpdeform._link import Link
from lpdeform._recovery import Backoff
from lpdeform._rpc import Stop
from lpdeform.errors import Code, LpdeformError, Unavailable, make, session_closed
from lpdeform.v1 import service_pb2


def undo(link: Link, redo: bool, stop: Stop) -> int:
    """The number of the update that this is."""
    link.require_writer()
    with alone(link, link.rpc.call_timeout, stop):
        send_waiting(link, stop)
        with link.changed:
            seq = link.ledger.take_number()
            lease = link.lease
        request = service_pb2.UndoUpdateRequest(
            session=lease.session, writer_token=lease.writer_token, input_seq=seq, redo=redo
        )
        undone = _undo_patiently(link, request, stop)
        change = NumberedUpdate(seq, _wire.changes_from_wire(undone.changes))
        with link.changed:
            link.ledger.accept_change(change, undone.result.kept)
    return seq


def _undo_patiently(
    link: Link, request: service_pb2.UndoUpdateRequest, stop: Stop
) -> service_pb2.UndoUpdateResponse:
    """The same call again does no harm, so a server that went away may be asked again: after what it may have lost."""
    end = time.monotonic() + link.rpc.call_timeout
    backoff = Backoff()
    is_again = False
    is_to_check = link.is_made_anew and not request.redo
    while True:
        try:
            if is_again:
                _catch_up(link, stop)
            if is_to_check:
                _check_steps(link, request.session, stop)
                is_to_check = False  # once: a call that was taken and not answered has made the steps fewer
            return link.rpc.call("UndoUpdate", request, service_pb2.UndoUpdateResponse, stop)
        except LpdeformError as error:
            pause = backoff.next(error.retry_after)
            if not isinstance(error, Unavailable) or time.monotonic() + pause > end:
                raise
        with link.changed:
            if link.changed.wait_for(lambda: link.is_closing or stop.is_set, pause):
                raise session_closed()
        is_again = True


def _catch_up(link: Link, stop: Stop) -> None:
    """Sends what the server has no more, and only that: it would be a step to it."""
    found = _session(link, link.lease.session, stop)
    with link.changed:
        link.ledger.reopened(found.epoch, found.input_seq)
    send_restore(link, stop)


def _check_steps(link: Link, name: str, stop: Stop) -> None:
    """All the handles of a session that was made anew are a step to the server, and none to anybody else."""
    if _session(link, name, stop).undo_steps <= 1:
        text = "The session was made anew, and knows no step from before."
        raise make(Code.FAILED_PRECONDITION, text, "NOTHING_TO_UNDO")


def _session(link: Link, name: str, stop: Stop) -> service_pb2.Session:
    request = service_pb2.GetSessionRequest(session=name)
    return link.rpc.call("GetSession", request, service_pb2.GetSessionResponse, stop).session
