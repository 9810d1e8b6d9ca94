"""Takes the better shape that the server has announced."""

from __future__ import annotations

from lpdeform._link import Link
from lpdeform._stop import Stop
from lpdeform.errors import LpdeformError, session_closed
from lpdeform.types import BetterShape
from lpdeform.v1 import service_pb2


def take_better_shape(link: Link, stop: Stop) -> BetterShape:
    """Asks once only: if the answer is lost, the shape may have been taken, and then there is no other."""
    link.require_writer()
    with link.changed:
        lease = link.lease
    request = service_pb2.TakeBetterShapeRequest(session=lease.session, writer_token=lease.writer_token)
    try:
        taken = link.rpc.call("TakeBetterShape", request, service_pb2.TakeBetterShapeResponse, stop)
    except LpdeformError as error:
        if error.reason == "NO_BETTER_SHAPE":
            link.drop_better_shape()
        if link.is_closing:
            raise session_closed() from None
        raise
    link.drop_better_shape()
    return BetterShape(taken.input_seq, taken.energy)
