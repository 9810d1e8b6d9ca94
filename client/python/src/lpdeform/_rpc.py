"""The calls of the service; nothing else uses gRPC. Every error is raised as an LpdeformError."""

from __future__ import annotations

import os
import secrets
import time
from collections.abc import Iterator
from typing import Any, TypeVar

import grpc
from google.protobuf.message import Message

from lpdeform._numbers import crc32c
from lpdeform._recovery import Backoff
from lpdeform._status import from_call
from lpdeform._stop import Ended, Stop
from lpdeform.access import Caller, Tls, Token, is_header_text, open_channel
from lpdeform.errors import Code, LpdeformError, make
from lpdeform.v1 import data_pb2, service_pb2

Response = TypeVar("Response", bound=Message)
_service = "/lpdeform.v1.DeformService/"
_most_part_bytes = 1 << 20
_most_inline_bytes = 1 << 20
_channel_options = [
    # Otherwise all channels of a process to one address share a connection. A session that is opened after a
    # restart of the server would then get the failure of another session's earlier attempt.
    ("grpc.use_local_subchannel_pool", 1),
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.min_reconnect_backoff_ms", 1000),
    ("grpc.max_reconnect_backoff_ms", 1000),
    ("grpc.dns_min_time_between_resolutions_ms", 1000),
    ("grpc.keepalive_time_ms", 30_000),
    ("grpc.keepalive_timeout_ms", 10_000),
    ("grpc.http2.bdp_probe", 0),  # limits the bytes under way, so a slow reader costs little memory
    ("grpc.http2.lookahead_bytes", 256 * 1024),
    ("grpc.enable_retries", 0),  # sessions resume by themselves, and know what must be sent again
]


def default_address() -> str:
    return os.environ.get("LPDEFORM_ADDRESS") or "localhost:50051"


class Rpc:
    """A connection to a server."""

    def __init__(
        self,
        address: str,
        call_timeout: float = 30.0,
        reconnect_for: float = 120.0,
        token: Token = None,
        tls: Tls | bool = False,
    ) -> None:
        self.address = address
        self.call_timeout = call_timeout
        self.reconnect_for = reconnect_for
        self._caller = Caller(token, new_request_id())
        self._channel = open_channel(address, tls, _channel_options)

    @property
    def route(self) -> str:
        return self._caller.route

    def go_by(self, route: str) -> None:
        """From now on calls have this value of the header lpdeform-session."""
        if is_header_text(route):
            self._caller.route = route

    def call(self, name: str, request: Message, response: type[Response], stop: Stop, timeout: float | None = None) -> Response:
        """A unary call; waits for the answer."""
        method = self._channel.unary_unary(_service + name, _serialize, response.FromString)
        longest = self.call_timeout if timeout is None else timeout
        metadata = self._caller.metadata()
        try:
            call = method.future(request, timeout=longest, metadata=metadata)
        except ValueError as closed:  # the channel is closed
            raise make(Code.CANCELLED, "The connection is closed.") from closed
        stop.add(call)
        try:
            answer: Response = call.result()
            return answer
        except grpc.FutureCancelledError:
            raise make(Code.CANCELLED, "The call was ended.") from None
        except grpc.RpcError as error:
            raise from_call(error, self.address) from None
        except BaseException:  # for example an interrupt in a notebook
            call.cancel()
            raise
        finally:
            stop.remove(call)

    def deform(self, requests: Iterator[bytes]) -> Any:
        """`requests`: serialized messages, so that their creator notices a message that cannot be serialized."""
        method = self._channel.stream_stream(_service + "Deform", None, service_pb2.DeformResponse.FromString)
        return method(requests, metadata=self._caller.metadata())

    def solve(self, request: service_pb2.SolveRequest, timeout: float | None) -> Any:
        method = self._channel.unary_stream(_service + "Solve", _serialize, service_pb2.SolveResponse.FromString)
        return method(request, timeout=timeout, metadata=self._caller.metadata())

    def snapshot(
        self, request: service_pb2.SnapshotSessionRequest, stop: Stop
    ) -> Iterator[service_pb2.SnapshotSessionResponse]:
        """The parts of the snapshot as they come."""
        method = self._channel.unary_stream(
            _service + "SnapshotSession", _serialize, service_pb2.SnapshotSessionResponse.FromString
        )
        call = method(request, timeout=self.call_timeout, metadata=self._caller.metadata())
        stop.add(call)
        try:
            yield from call
        except grpc.RpcError as error:
            raise from_call(error, self.address) from None
        finally:
            call.cancel()
            stop.remove(call)

    def reach(self, session: str, stop: Stop, timeout: float) -> None:
        """Waits until the server answers, at most `timeout`. gRPC reconnects while a call waits for the connection."""
        method = self._channel.unary_unary(_service + "GetSession", _serialize, service_pb2.GetSessionResponse.FromString)
        try:
            request = service_pb2.GetSessionRequest(session=session)
            metadata = self._caller.metadata()
            call = method.future(request, timeout=timeout, wait_for_ready=True, metadata=metadata)
        except (LpdeformError, ValueError):  # no token, or the channel was closed
            return
        stop.add(call)
        try:
            call.exception()  # the next call raises the error
        except grpc.FutureCancelledError:
            return
        finally:
            stop.remove(call)

    def close(self) -> None:
        self._channel.close()


def _serialize(message: Message) -> bytes:
    return message.SerializeToString()


def new_request_id() -> str:
    """128 random bits as hexadecimal digits."""
    return secrets.token_hex(16)


class Packer:
    """Puts arrays into the buffers of one message: inline up to 1 MiB in all, the rest by uploads that are made beforehand.

    `request_id`: the same for every try of a call, so that the request stays identical.
    """

    def __init__(self, rpc: Rpc, stop: Stop, request_id: str | None = None) -> None:
        self._rpc = rpc
        self._stop = stop
        self._id = request_id or new_request_id()
        self._left = _most_inline_bytes
        self._count = 0
        self.uploads: list[str] = []

    def pack(self, data: bytes) -> data_pb2.Buffer:
        if len(data) <= self._left:
            self._left -= len(data)
            return data_pb2.Buffer(inline=data)
        return data_pb2.Buffer(upload=self._upload(data))

    def _upload(self, data: bytes) -> str:
        self._count += 1
        create = service_pb2.CreateUploadRequest(
            request_id=f"{self._id}-{self._count}", size_bytes=len(data), crc32c=crc32c(data)
        )
        created = self._rpc.call("CreateUpload", create, service_pb2.CreateUploadResponse, self._stop)
        self.uploads.append(created.upload)
        part_bytes = min(max(created.max_part_bytes, 1), _most_part_bytes)
        is_finished = False
        for offset in range(0, len(data), part_bytes):
            part = service_pb2.UploadPartRequest(
                upload=created.upload, offset=offset, data=data[offset : offset + part_bytes]
            )
            is_finished = self._send(part).finished
        if not is_finished:
            text = "The server reports missing parts although all were sent."
            raise make(Code.DATA_LOSS, text, "UPLOAD_INCOMPLETE", created.upload)
        return created.upload

    def _send(self, part: service_pb2.UploadPartRequest) -> service_pb2.UploadPartResponse:
        """If the server has no room for a part yet, sends it again after the pause that the server asks for, within a call's
        time limit."""
        end = time.monotonic() + self._rpc.call_timeout
        backoff = Backoff()
        while True:
            try:
                return self._rpc.call("UploadPart", part, service_pb2.UploadPartResponse, self._stop)
            except LpdeformError as error:
                pause = backoff.next(error.retry_after)
                is_late = time.monotonic() + pause > end
                if error.code is not Code.RESOURCE_EXHAUSTED or error.retry_after <= 0 or is_late:
                    raise
            if self._stop.wait(pause):
                raise make(Code.CANCELLED, "The upload was stopped.")

    def discard(self) -> None:
        """Frees the server's memory before the uploads expire."""
        names, self.uploads = self.uploads, []
        for name in names:
            try:
                request = service_pb2.DeleteUploadRequest(upload=name)
                self._rpc.call("DeleteUpload", request, service_pb2.DeleteUploadResponse, self._stop)
            except Exception:  # the upload expires by itself
                return
