"""Undo and redo of handle steps on the server."""

from __future__ import annotations

import time

from lpdeform import _wire
from lpdeform._alone import alone
from lpdeform._ledger import NumberedUpdate
from lpdeform._link import Link
from lpdeform._recovery import Backoff
from lpdeform._sending_alone import send_restore, send_waiting
from lpdeform._stop import Stop
from lpdeform.errors import Code, LpdeformError, Unavailable, make, session_closed
from lpdeform.v1 import service_pb2


def undo(link: Link, redo: bool, stop: Stop) -> int:
    """Returns the number of the update that the undo or redo is."""
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
    """Undo is idempotent, so the call may be repeated after the server went away, once the server has what it may have lost."""
    end = time.monotonic() + link.rpc.call_timeout
    backoff = Backoff()
    is_again = False
    is_to_check = link.is_recreated and not request.redo
    while True:
        try:
            if is_again:
                _catch_up(link, stop)
            if is_to_check:
                _check_steps(link, request.session, stop)
                is_to_check = False  # once only: a call that was carried out without an answer has reduced the steps
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
    """Sends only what the server does not have any more, because it would count as a step."""
    found = _session(link, link.lease.session, stop)
    with link.changed:
        link.ledger.reopened(found.epoch, found.input_seq)
    send_restore(link, stop)


def _check_steps(link: Link, name: str, stop: Stop) -> None:
    """In a recreated session, the update with all its handles counts as a step for the server. Users must not undo it."""
    if _session(link, name, stop).undo_steps <= 1:
        text = "The session was recreated, and has no steps from before."
        raise make(Code.FAILED_PRECONDITION, text, "NOTHING_TO_UNDO")


def _session(link: Link, name: str, stop: Stop) -> service_pb2.Session:
    request = service_pb2.GetSessionRequest(session=name)
    return link.rpc.call("GetSession", request, service_pb2.GetSessionResponse, stop).session
