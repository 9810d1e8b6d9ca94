"""What a session does between its streams, against a server whose every message the test chooses."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any, cast

import numpy as np
import pytest
from conftest import PATIENCE
from google.protobuf.message import Message

import lpdeform
from lpdeform import Settings, Update
from lpdeform._lease import Original, create_session
from lpdeform._link import Link
from lpdeform._recovery import RecoveryRules
from lpdeform._rpc import Packer, Rpc
from lpdeform._stop import Stop
from lpdeform.errors import Code, LpdeformError, make
from lpdeform.types import Removal
from lpdeform.v1 import frame_pb2, report_pb2, service_pb2

VERTICES = 200_000
PART = 1 << 20


def full(reason: str, seconds: float) -> LpdeformError:
    return make(Code.RESOURCE_EXHAUSTED, "Full.", reason, retry_after=seconds)


def until(is_so: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.001)


class FakeStream:
    """Both ends of a Deform call."""

    def __init__(self, requests: Iterator[bytes]) -> None:
        self._requests = requests
        self._heard: queue.Queue[service_pb2.DeformRequest] = queue.Queue()
        self._said: queue.Queue[service_pb2.DeformResponse | LpdeformError] = queue.Queue()
        self.sender = threading.Thread(target=self._listen, daemon=True)
        self.sender.start()

    def _listen(self) -> None:
        for request in self._requests:
            self._heard.put(service_pb2.DeformRequest.FromString(request))

    def hear(self) -> service_pb2.DeformRequest:
        return self._heard.get(timeout=PATIENCE)

    def say(self, **event: Message) -> None:
        said = service_pb2.StreamEvent(**event)  # type: ignore[arg-type]
        self._said.put(service_pb2.DeformResponse(event=said))

    def fault(self, seq: int, code: int, reason: str, retry_after_ms: int = 0) -> None:
        self.say(fault=service_pb2.Fault(code=code, reason=reason, input_seq=seq, retry_after_ms=retry_after_ms))

    def end(self, error: LpdeformError) -> None:
        self._said.put(error)

    def opened(self) -> FakeStream:
        self.open = self.hear().open
        self.say(opened=service_pb2.StreamOpened(epoch=1, vertex_count=VERTICES))
        return self

    # The client's side.

    def cancel(self) -> None:
        self.end(make(Code.CANCELLED, "Cancelled."))

    def __iter__(self) -> Iterator[service_pb2.DeformResponse]:
        while not isinstance(said := self._said.get(), LpdeformError):
            yield said
        raise said


class FakeServer:
    """Replaces an Rpc. Every call succeeds except those for which `ends` has an error, in turn and by name."""

    address = "nowhere"
    reconnect_for = 120.0
    route = ""

    def __init__(self) -> None:
        self.call_timeout = 30.0
        self.calls: list[tuple[str, Any]] = []
        self.ends: dict[str, list[LpdeformError | None]] = {}
        self._streams: queue.Queue[FakeStream] = queue.Queue()

    def stream(self) -> FakeStream:
        return self._streams.get(timeout=PATIENCE)

    def asked(self, name: str) -> list[Any]:
        return [request for called, request in self.calls if called == name]

    @property
    def parts(self) -> list[int]:
        return [request.offset for request in self.asked("UploadPart")]

    def call(
        self, name: str, request: Any, response: type[Message], stop: Stop, timeout: float | None = None
    ) -> Message:
        self.calls.append((name, request))
        if stop.is_set and name != "DeleteSession":
            raise make(Code.CANCELLED, "The call was ended.")
        if (error := (self.ends.get(name) or [None]).pop(0)) is not None:
            raise error
        mesh = report_pb2.MeshReport(vertices=VERTICES)
        session = service_pb2.Session(name="sessions/1", epoch=1, mesh=mesh)
        if name == "CreateUpload":
            return service_pb2.CreateUploadResponse(upload="uploads/1", max_part_bytes=PART)
        if name == "UploadPart":
            return service_pb2.UploadPartResponse(finished=len(request.data) < PART)
        if name == "CreateSession":
            return service_pb2.CreateSessionResponse(session=session, writer_token="token")
        if name == "GetSession":
            return service_pb2.GetSessionResponse(session=session)
        if name == "AcquireWriter":
            return service_pb2.AcquireWriterResponse(writer_token="another", epoch=2, input_seq=100)
        return response()

    def deform(self, requests: Iterator[bytes]) -> FakeStream:
        stream = FakeStream(requests)
        self._streams.put(stream)
        return stream

    def reach(self, session: str, stop: Stop, timeout: float) -> None:
        pass

    def close(self) -> None:
        pass


@pytest.fixture
def server() -> FakeServer:
    return FakeServer()


@pytest.fixture
def link(server: FakeServer) -> Iterator[Link]:
    vertices, faces = np.zeros((VERTICES, 3), "<f4"), np.array([[0, 1, 2]], "<u4")
    original = Original(vertices, faces, None, None, 0, 0, Settings())  # type: ignore[arg-type]
    rpc = cast(Rpc, server)
    made = Link(rpc, create_session(rpc, original, "the first", Stop()), frame_pb2.FrameOptions(), original)
    server.calls.clear()
    made.start_stream()
    yield made
    made.close()


def begin_waiting(link: Link) -> None:
    until(lambda: link.interruption is not None)


def test_a_session_taken_over_does_not_wait_for_the_pause_between_tries(link: Link, server: FakeServer) -> None:
    server.stream().opened().end(full("SERVER_BUSY", 60))
    begin_waiting(link)
    begun = time.monotonic()
    link.take_over()
    assert server.stream().opened().open.writer_token == "another"
    assert time.monotonic() - begun < 30


def test_a_session_taken_over_does_not_wait_for_the_next_try_to_recreate_it(link: Link, server: FakeServer) -> None:
    server.ends["CreateSession"] = [full("SESSIONS_FULL", 60)]
    server.stream().opened().end(make(Code.NOT_FOUND, "Gone.", "SESSION_UNKNOWN"))
    until(lambda: len(server.asked("CreateSession")) == 1)
    begun = time.monotonic()
    link.take_over()
    assert server.stream().opened().open.writer_token == "another"
    assert time.monotonic() - begun < 30
    assert len(server.asked("CreateSession")) == 1


def test_a_session_taken_over_while_a_stream_begins_does_not_stay_on_it(
    link: Link, server: FakeServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin = server.deform

    def take_over_meanwhile(requests: Iterator[bytes]) -> FakeStream:
        monkeypatch.undo()
        stream = begin(requests)
        link.take_over()
        return stream

    first = server.stream().opened()
    monkeypatch.setattr(server, "deform", take_over_meanwhile)
    first.end(make(Code.UNAVAILABLE, "Killed."))
    assert server.stream().opened().open.writer_token == "token"
    begun = time.monotonic()
    assert server.stream().opened().open.writer_token == "another"
    assert time.monotonic() - begun < 30  # and not only once it has been silent for 45 s


def test_a_session_taken_over_counts_streams_that_do_not_fit_from_the_start(link: Link, server: FakeServer) -> None:
    for _ in range(2):
        for _ in range(RecoveryRules.most_misfits):
            server.stream().opened().end(make(Code.DATA_LOSS, "No frame.", "FRAME_PARTS"))
        until(lambda: link.connection == "closed")
        link.take_over()


def test_lost_uploads_are_sent_again_once_also_where_the_update_was_asked_for_for_another_reason(
    link: Link, server: FakeServer
) -> None:
    link.update(Update({"tip": Removal()}))
    stream = server.stream().opened()
    assert stream.hear().update.input_seq == 1
    stream.fault(1, 8, "SERVER_BUSY", 1)
    stream = server.stream().opened()
    assert stream.hear().update.input_seq == 1
    stream.fault(1, 5, "UPLOAD_UNKNOWN")
    stream = server.stream().opened()
    assert stream.hear().update.input_seq == 1
    stream.fault(1, 5, "UPLOAD_UNKNOWN")
    assert link.box.wait(time.monotonic() + PATIENCE, 0)
    with pytest.raises(LpdeformError) as caught:
        link.take()
    assert caught.value.reason == "UPLOAD_UNKNOWN"


LARGE = Update(settings=Settings(p=np.full(VERTICES, 1.5)))


def test_an_upload_that_the_server_has_no_room_for_is_tried_again_after_the_pause_that_it_asks_for(
    link: Link, server: FakeServer
) -> None:
    first = server.stream().opened()
    server.ends["CreateUpload"] = [full("UPLOADS_FULL", 0.3)]
    begun = time.monotonic()
    link.update(LARGE)
    second = server.stream()
    assert time.monotonic() - begun > 0.3
    assert second is not first
    assert link.interruption is not None and link.interruption.reason == "UPLOADS_FULL"
    assert second.opened().hear().update.input_seq == 1


def test_what_keeps_an_update_from_being_solved_for_is_nothing_once_a_newer_one_is_there(
    link: Link, server: FakeServer
) -> None:
    stream = server.stream().opened()
    link.update(Update({"tip": Removal()}))
    stream.hear()
    link.update(Update({"ear": Removal()}))
    stream.hear()
    stream.fault(1, 9, "NO_HANDLES")
    stream.fault(2, 9, "COMPONENT_WITHOUT_HANDLE")
    assert link.box.wait(time.monotonic() + PATIENCE, 0)
    with pytest.raises(LpdeformError) as caught:
        link.take()
    assert caught.value.reason == "COMPONENT_WITHOUT_HANDLE"


def test_a_part_that_the_server_has_no_room_for_yet_is_sent_again_after_the_pause_that_it_asks_for(
    server: FakeServer,
) -> None:
    server.ends["UploadPart"] = [None, full("UPLOAD_RATE", 0.2), full("UPLOAD_RATE", 0.2)]
    begun = time.monotonic()
    packer = Packer(cast(Rpc, server), Stop())
    assert packer.pack(bytes(2 * PART + 1)).upload == "uploads/1"
    assert time.monotonic() - begun > 0.4
    assert server.parts == [0, PART, PART, PART, 2 * PART]


@pytest.mark.parametrize("refused", [full("UPLOAD_RATE", 50), full("CALLER_MEMORY_FULL", 0)])
def test_a_part_is_not_sent_again_after_the_time_of_a_call_nor_where_the_server_says_of_no_pause(
    server: FakeServer, refused: LpdeformError
) -> None:
    server.ends["UploadPart"] = [refused]
    with pytest.raises(LpdeformError) as caught:
        Packer(cast(Rpc, server), Stop()).pack(bytes(PART + 1))
    assert caught.value is refused
    assert server.parts == [0]


def test_no_part_is_waited_for_once_the_call_is_stopped(server: FakeServer) -> None:
    server.call_timeout = 120
    server.ends["UploadPart"] = [full("UPLOAD_RATE", 59)]
    stop = Stop()
    threading.Timer(0.05, stop.set).start()
    begun = time.monotonic()
    with pytest.raises(LpdeformError) as caught:
        Packer(cast(Rpc, server), stop).pack(bytes(PART + 1))
    assert caught.value.code is Code.CANCELLED
    assert time.monotonic() - begun < 30


def test_an_upload_for_a_stream_that_has_ended_is_begun_again_for_the_next(link: Link, server: FakeServer) -> None:
    server.call_timeout = 120
    server.ends["UploadPart"] = [full("UPLOAD_RATE", 59)]
    first = server.stream().opened()
    link.update(LARGE)
    until(lambda: server.parts == [0])
    killed = make(Code.UNAVAILABLE, "Killed.")
    first.end(killed)
    second = server.stream()
    assert link.interruption is killed
    assert second.opened().hear().update.input_seq == 1
    assert len(server.asked("CreateUpload")) == 2
    until(lambda: not first.sender.is_alive())
