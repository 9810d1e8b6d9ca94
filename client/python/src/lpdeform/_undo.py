"""Steps of the handles taken back on the server, and done again."""

from __future__ import annotations

import time

from lpdeform import _wire
from lpdeform._alone import alone, send_waiting
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
    """The same call again does no harm, so a server that went away may be asked again."""
    end = time.monotonic() + link.rpc.call_timeout
    backoff = Backoff()
    while True:
        try:
            return link.rpc.call("UndoUpdate", request, service_pb2.UndoUpdateResponse, stop)
        except LpdeformError as error:
            pause = backoff.next()
            if not isinstance(error, Unavailable) or time.monotonic() + pause > end:
                raise
        with link.changed:
            if link.changed.wait_for(lambda: link.is_closing or stop.is_set, pause):
                raise session_closed()
