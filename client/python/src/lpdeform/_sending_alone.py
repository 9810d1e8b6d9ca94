"""Sends updates by calls of their own, before a call that must come after them."""

from __future__ import annotations

from lpdeform import _wire
from lpdeform._link import Link
from lpdeform._rpc import Packer
from lpdeform._stop import Stop
from lpdeform.errors import LpdeformError, is_undecided
from lpdeform.v1 import service_pb2


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
