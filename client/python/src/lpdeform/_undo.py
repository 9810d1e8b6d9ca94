"""Steps of the handles taken back on the server, and done again."""

from __future__ import annotations

import time

from lpdeform import _wire
from lpdeform._alone import alone, send_restore, send_waiting
from lpdeform._ledger import NumberedUpdate
from lpdeform._link import Link
from lpdeform._recovery import Backoff
from lpdeform._rpc import Stop
from lpdeform.errors import LpdeformError, Unavailable, session_closed
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
    while True:
        try:
            if is_again:
                _catch_up(link, stop)
            return link.rpc.call("UndoUpdate", request, service_pb2.UndoUpdateResponse, stop)
        except LpdeformError as error:
            pause = backoff.next()
            if not isinstance(error, Unavailable) or time.monotonic() + pause > end:
                raise
        with link.changed:
            if link.changed.wait_for(lambda: link.is_closing or stop.is_set, pause):
                raise session_closed()
        is_again = True


def _catch_up(link: Link, stop: Stop) -> None:
    """Sends what the server has no more, and only that: it would be a step to it."""
    request = service_pb2.GetSessionRequest(session=link.lease.session)
    found = link.rpc.call("GetSession", request, service_pb2.GetSessionResponse, stop)
    with link.changed:
        link.ledger.resumed_at(found.session.input_seq)
    send_restore(link, stop)
