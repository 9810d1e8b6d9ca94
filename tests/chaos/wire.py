"""Calls and streams of the service as chaos.py makes them, every step recorded in a book; and the messages that they carry."""

from __future__ import annotations

import queue
import threading
import time

import grpc
import numpy as np

from lpdeform.v1 import data_pb2, frame_pb2, handle_pb2, service_pb2

from history import History
from machines import PATIENCE

SERVICE = "/lpdeform.v1.DeformService/"
SIDE = 12  # vertices along an edge of the mesh
PROBES = [0, SIDE // 2 * SIDE + SIDE // 2, SIDE * SIDE - SIDE // 2, SIDE + 1]


def sheet() -> tuple[np.ndarray, np.ndarray]:
    places = np.array([[x, y, 0.0] for x in range(SIDE) for y in range(SIDE)])
    faces = []
    for x in range(SIDE - 1):
        for y in range(SIDE - 1):
            a, b, c, d = x * SIDE + y, (x + 1) * SIDE + y, (x + 1) * SIDE + y + 1, x * SIDE + y + 1
            faces += [[a, b, c], [a, c, d]]
    return places, np.array(faces, dtype=np.uint32)


PLACES, FACES = sheet()
ENDS = {"base": list(range(SIDE)), "tip": list(range(SIDE * (SIDE - 1), SIDE * SIDE))}


class Wire:
    """A connection of its own, with the calls that are made over it."""

    def __init__(self, port: int, way: str) -> None:
        """`way`: who shares a session comes by one server, as long as there is one."""
        self.metadata = (("lpdeform-session", way),)
        options = [("grpc.use_local_subchannel_pool", 1), ("grpc.initial_reconnect_backoff_ms", 20),
                   ("grpc.min_reconnect_backoff_ms", 5000), ("grpc.max_reconnect_backoff_ms", 50), ("grpc.http2.bdp_probe", 0)]
        self.channel = grpc.insecure_channel(f"127.0.0.1:{port}", options)

    def __enter__(self) -> Wire:
        return self

    def __exit__(self, *_) -> None:
        self.channel.close()

    def call(self, name: str, request, timeout: float = 10.0):
        answer = getattr(service_pb2, f"{name}Response")
        call = self.channel.unary_unary(SERVICE + name, type(request).SerializeToString, answer.FromString)
        return call(request, timeout=timeout, metadata=self.metadata)

    def patiently(self, name: str, request, is_over=lambda: False):
        """Until the server is there, and has released what the one before it held."""
        end = time.monotonic() + PATIENCE
        while True:
            try:
                return self.call(name, request)
            except grpc.RpcError as error:
                if error.code() not in PASSING or time.monotonic() > end or is_over():
                    raise
                time.sleep(0.02)

    def deform(self, requests):
        call = self.channel.stream_stream(SERVICE + "Deform", service_pb2.DeformRequest.SerializeToString,
                                          service_pb2.DeformResponse.FromString)
        return call(requests, timeout=4 * PATIENCE, metadata=self.metadata)


PASSING = {grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED, grpc.StatusCode.CANCELLED,
           grpc.StatusCode.INTERNAL, grpc.StatusCode.UNKNOWN}


class Book:
    """The history being written, and names for what it is about."""

    def __init__(self) -> None:
        self.history = History()
        self._lock = threading.Lock()
        self._begin = time.monotonic()
        self._names = 0

    def now(self) -> float:
        return time.monotonic() - self._begin

    def note(self, kind: str, **what) -> None:
        with self._lock:
            self.history.events.append({"kind": kind, "at": self.now(), **what})

    def name(self, what: str) -> str:
        with self._lock:
            self._names += 1
            return f"{what}{self._names}"


class Stream:
    """A Deform stream. Everything that comes is noted; frames are acknowledged unless it is `slow`."""

    def __init__(self, book: Book, wire: Wire, session: str, token: str, client: str, credit: int) -> None:
        self.book, self.session, self.token, self.credit, self.client = book, session, token, credit, client
        self.name = book.name("stream")
        self.requests: queue.Queue = queue.Queue()
        self.is_slow = threading.Event()
        self.is_over = threading.Event()
        self.was_cancelled = False
        self.results: queue.Queue = queue.Queue()
        self.settled: dict[int, bool] = {}
        options = frame_pb2.FrameOptions(credit=credit)
        opening = service_pb2.DeformOpen(session=session, writer_token=token, options=options)
        self.requests.put(service_pb2.DeformRequest(open=opening))
        book.note("opening", stream=self.name, session=session)
        self._call = wire.deform(iter(self.requests.get, None))
        self._frame: list = []
        self._unacknowledged = 0
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def send(self, update) -> None:
        self.requests.put(service_pb2.DeformRequest(update=update))

    def acknowledge_all(self) -> None:
        self.is_slow.clear()
        if self._unacknowledged:
            self._acknowledge(self._unacknowledged)

    def end(self) -> None:
        self.was_cancelled = True
        self._call.cancel()
        self.requests.put(None)
        self._thread.join(PATIENCE)

    def _acknowledge(self, number: int) -> None:
        self.book.note("ack", stream=self.name, frame_seq=number)  # first: what it makes room for may come at once
        self.requests.put(service_pb2.DeformRequest(ack=service_pb2.FrameAck(frame_seq=number)))

    def _read(self) -> None:
        status = "OK"
        try:
            for response in self._call:
                self._take(response)
        except grpc.RpcError as error:
            status = error.code().name
        self.requests.put(None)
        self.book.note("end", stream=self.name, status=status, by_client=self.was_cancelled)
        self.is_over.set()
        self.results.put(None)

    def _take(self, response) -> None:
        if response.HasField("result"):
            result = response.result
            self.book.note("answered", session=self.session, input_seq=result.input_seq, kept=result.kept, token=self.token)
            self.results.put(result)
            return
        event = response.event
        what = event.WhichOneof("event")
        if what == "opened":
            self.book.note("opened", stream=self.name, session=self.session, epoch=event.opened.epoch, client=self.client,
                           input_seq=event.opened.input_seq, credit=self.credit)
        elif what == "frame":
            self._take_part(event.frame)
        elif what == "fault":
            self.book.note("refused", session=self.session, input_seq=event.fault.input_seq, reason=event.fault.reason,
                           token=self.token)
            self.results.put(event.fault)
        elif what == "go_away":
            self.book.note("go_away", stream=self.name, reason=service_pb2.GoAwayReason.Name(event.go_away.reason))

    def _take_part(self, part) -> None:
        if part.HasField("header"):
            self._frame = []
            self._header = part.header
        self._frame.append(part.positions)
        if not part.last:
            return
        header = self._header
        places = np.frombuffer(b"".join(self._frame), dtype="<f4").reshape(-1, 3)
        self.book.note("frame", stream=self.name, session=self.session, epoch=header.epoch, frame_seq=header.frame_seq,
                       input_seq=header.input_seq, is_final=header.is_final, bytes=places.nbytes,
                       probe=places[PROBES].astype(float).tolist())
        if header.is_final:
            self.settled[header.input_seq] = True
        self._unacknowledged = header.frame_seq
        if not self.is_slow.is_set():
            self._acknowledge(header.frame_seq)


def motion(x: float) -> handle_pb2.Motion:
    return handle_pb2.Motion(rigid=handle_pb2.RigidMotion(translation=data_pb2.Vector3(z=x)))


def held(name: str, x: float) -> handle_pb2.HandleUpdate:
    vertices = data_pb2.Buffer(inline=np.array(ENDS[name], dtype="<u4").tobytes())
    return handle_pb2.HandleUpdate(name=name, set=handle_pb2.Handle(vertices=vertices, motion=motion(x)))


def create_request(request_id: str) -> service_pb2.CreateSessionRequest:
    data = data_pb2.Buffer(inline=PLACES.astype("<f8").tobytes() + FACES.astype("<u4").tobytes())
    mesh = data_pb2.Mesh(vertex_count=len(PLACES), face_count=len(FACES), scalar=data_pb2.SCALAR_FLOAT64, data=data)
    return service_pb2.CreateSessionRequest(request_id=request_id, mesh=mesh)
