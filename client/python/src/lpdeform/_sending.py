"""What a link sends on its Deform stream, on a thread of gRPC."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Protocol

from lpdeform import _wire
from lpdeform._box import FrameBox
from lpdeform._lease import Lease
from lpdeform._ledger import Ledger, NumberedUpdate
from lpdeform._recovery import Answer, Judge
from lpdeform._rpc import Packer, Rpc
from lpdeform._stream import Stream
from lpdeform.errors import LpdeformError, exception
from lpdeform.v1 import frame_pb2, service_pb2


class Sender(Protocol):
    """What sending needs of its session."""

    rpc: Rpc
    options: frame_pb2.FrameOptions
    changed: threading.Condition
    """Guards the other members and the stream, and is notified of every change to them."""
    ledger: Ledger
    judge: Judge
    box: FrameBox
    is_solving: bool
    """Updates wait, because another call needs the session to itself."""


def requests(sender: Sender, stream: Stream, lease: Lease) -> Iterator[bytes]:
    """The serialized messages to send. gRPC would take an exception here for a broken stream, which would then be resumed."""
    try:
        for request in _requests(sender, stream, lease):
            yield request.SerializeToString()
    except Exception as error:
        with sender.changed:
            stream.failure = exception(error)
        stream.cancel()


def _requests(sender: Sender, stream: Stream, lease: Lease) -> Iterator[service_pb2.DeformRequest]:
    opening = service_pb2.DeformOpen(session=lease.session, writer_token=lease.writer_token, options=sender.options)
    yield service_pb2.DeformRequest(open=opening)
    while True:
        with sender.changed:
            if not _wait_for_work(sender, stream):
                return
            ack, stream.ack_due = stream.ack_due, 0
            done, stream.done = stream.done, []
            update = sender.ledger.send_next() if _can_send(sender) else None
        if ack:
            yield service_pb2.DeformRequest(ack=service_pb2.FrameAck(frame_seq=ack))
        for packer in done:
            packer.discard()
        if update is not None:
            message = _packed(sender, stream, update)
            if message is not None:
                yield service_pb2.DeformRequest(update=message)


def _can_send(sender: Sender) -> bool:
    return not sender.is_solving and sender.ledger.can_send


def _wait_for_work(sender: Sender, stream: Stream) -> bool:
    """Returns False if the stream has ended. Ends a stream that has been silent for too long."""

    def has_work() -> bool:
        is_due = bool(stream.ack_due or stream.done) or _can_send(sender)
        return stream.is_over or (stream.is_open and is_due)

    while not stream.is_over:
        left = stream.heard_at + stream.longest_silence - time.monotonic()
        if left <= 0:
            stream.cancel()
            return False
        if sender.changed.wait_for(has_work, left):
            break
    return not stream.is_over


def _packed(sender: Sender, stream: Stream, update: NumberedUpdate) -> service_pb2.Update | None:
    packer = Packer(sender.rpc, stream.stop)
    try:
        message = _wire.update_to_wire(update.update, update.seq, packer)
    except LpdeformError as error:
        with sender.changed:
            if sender.judge.answer_of(error, update.seq) not in (Answer.AGAIN, Answer.RECREATE):
                sender.ledger.refuse(update.seq)
                sender.box.put_problem(error)
                return None
            if not stream.stop.is_set:  # otherwise the stream's own end says more
                stream.failure = error  # updates in flight wait for the next stream
        stream.cancel()
        return None
    if packer.uploads:
        with sender.changed:
            stream.uploads[update.seq] = packer
    return message
