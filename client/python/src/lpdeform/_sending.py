"""What a link sends on its Deform stream, on gRPC's thread."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from lpdeform import _wire
from lpdeform._lease import Lease
from lpdeform._ledger import NumberedUpdate
from lpdeform._recovery import Answer
from lpdeform._rpc import Packer
from lpdeform._stream import Stream
from lpdeform.errors import LpdeformError, exception
from lpdeform.v1 import service_pb2

if TYPE_CHECKING:
    from lpdeform._link import Link


def requests(link: Link, stream: Stream, lease: Lease) -> Iterator[bytes]:
    """Messages as they travel. gRPC would take an exception here for a stream that broke, which is to be resumed."""
    try:
        for request in _requests(link, stream, lease):
            yield request.SerializeToString()
    except Exception as error:
        with link.changed:
            stream.failure = exception(error)
        stream.cancel()


def _requests(link: Link, stream: Stream, lease: Lease) -> Iterator[service_pb2.DeformRequest]:
    opening = service_pb2.DeformOpen(session=lease.session, writer_token=lease.writer_token, options=link.options)
    yield service_pb2.DeformRequest(open=opening)
    while True:
        with link.changed:
            if not _wait_for_work(link, stream):
                return
            ack, stream.ack_due = stream.ack_due, 0
            done, stream.done = stream.done, []
            update = link.ledger.send_next() if _can_send(link) else None
        if ack:
            yield service_pb2.DeformRequest(ack=service_pb2.FrameAck(frame_seq=ack))
        for packer in done:
            packer.discard()
        if update is not None:
            message = _packed(link, stream, update)
            if message is not None:
                yield service_pb2.DeformRequest(update=message)


def _can_send(link: Link) -> bool:
    return not link.is_solving and link.ledger.can_send


def _wait_for_work(link: Link, stream: Stream) -> bool:
    """False where the stream is over. Ends one that has been silent for too long."""

    def has_work() -> bool:
        is_due = bool(stream.ack_due or stream.done) or _can_send(link)
        return stream.is_over or (stream.is_open and is_due)

    while not stream.is_over:
        left = stream.heard_at + stream.longest_silence - time.monotonic()
        if left <= 0:
            stream.cancel()
            return False
        if link.changed.wait_for(has_work, left):
            break
    return not stream.is_over


def _packed(link: Link, stream: Stream, update: NumberedUpdate) -> service_pb2.Update | None:
    packer = Packer(link.rpc, stream.stop)
    try:
        message = _wire.update_to_wire(update.update, update.seq, packer)
    except LpdeformError as error:
        with link.changed:
            if link.judge.answer_of(error, update.seq) not in (Answer.AGAIN, Answer.MAKE_ANEW):
                link.ledger.refuse(update.seq)
                link.box.put_problem(error)
                return None
            if not stream.stop.is_set:  # otherwise its own end says more
                stream.failure = error  # what is in flight waits again for the next stream
        stream.cancel()
        return None
    if packer.uploads:
        with link.changed:
            stream.uploads[update.seq] = packer
    return message
