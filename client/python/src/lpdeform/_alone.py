"""Calls that must come after every earlier update, and during which no update is sent."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from lpdeform import _wire
from lpdeform._link import Link
from lpdeform._rpc import Packer, Stop
from lpdeform.errors import Code, LpdeformError, is_undecided, make, session_closed
from lpdeform.v1 import service_pb2


@contextmanager
def alone(link: Link, timeout: float, stop: Stop) -> Iterator[None]:
    """Waits until nothing is under way, and lets nothing begin meanwhile.

    Raises Timeout SOLVE_UNDER_WAY after `timeout` seconds, SESSION_CLOSED, and CANCELLED.
    """
    deadline = time.monotonic() + timeout
    with link.changed:
        is_quiet = link.changed.wait_for(
            lambda: link.is_closing or stop.is_set or (not link.is_solving and not link.ledger.has_in_flight),
            deadline - time.monotonic(),
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
        yield
    except LpdeformError:
        if link.is_closing:
            raise session_closed() from None
        raise
    finally:
        with link.changed:
            link.is_solving = False
            link.changed.notify_all()


def send_restore(link: Link, stop: Stop) -> None:
    """Restores the state of a lost session in the recreated one, by an update of its own: a refused update must not affect it."""
    while link.ledger.has_restore:
        send_next(link, stop)


def send_waiting(link: Link, stop: Stop) -> None:
    """Sends everything that waits. Raises the server's errors."""
    while link.ledger.has_waiting:
        send_next(link, stop)


def send_next(link: Link, stop: Stop) -> None:
    """Sends the next update by a unary call, not on the stream."""
    with link.changed:
        update = link.ledger.send_next()
        lease = link.lease
    packer = Packer(link.rpc, stop)
    try:
        request = service_pb2.UpdateHandlesRequest(
            session=lease.session,
            writer_token=lease.writer_token,
            update=_wire.update_to_wire(update.update, update.seq, packer),
        )
        response = link.rpc.call("UpdateHandles", request, service_pb2.UpdateHandlesResponse, stop)
    except BaseException as error:
        with link.changed:
            is_refused = isinstance(error, LpdeformError) and not is_undecided(error)
            if is_refused and update.seq != link.ledger.newest_accepted:
                link.ledger.refuse(update.seq)
            else:
                link.ledger.connection_lost()
        raise
    finally:
        packer.discard()
    with link.changed:
        link.ledger.accept(update.seq, response.result.kept)
