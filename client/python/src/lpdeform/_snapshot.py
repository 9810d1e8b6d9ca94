"""A session as a file."""

from __future__ import annotations

from lpdeform._alone import alone
from lpdeform._link import Link
from lpdeform._sending_alone import send_waiting
from lpdeform._stop import Stop
from lpdeform.errors import Code, LpdeformError, make
from lpdeform.v1 import service_pb2


def snapshot(link: Link, stop: Stop) -> bytes:
    """The file includes every earlier update."""
    with alone(link, link.rpc.call_timeout, stop):
        send_waiting(link, stop)
        return _take(link, stop)


def _take(link: Link, stop: Stop) -> bytes:
    request = service_pb2.SnapshotSessionRequest(session=link.lease.session)
    file, size = bytearray(), 0
    for part in link.rpc.snapshot(request, stop):
        size = part.size_bytes
        if part.offset != len(file):
            raise _incomplete(len(file), size)
        file += part.data
    if not file or len(file) != size:
        raise _incomplete(len(file), size)
    return bytes(file)


def _incomplete(has: int, should: int) -> LpdeformError:
    text = f"The server sent {has} of the snapshot's {should} bytes."
    return make(Code.DATA_LOSS, text, "SNAPSHOT_INCOMPLETE", "snapshot", f"{should} bytes")
