"""The callers who must not be affected: a native caller with an open Deform stream, and a page with a gRPC-Web StreamFrames,
on one session."""

from __future__ import annotations

import http.client
import queue
import socket
import struct
import threading
import time

import grpc
import numpy as np

from lpdeform.v1 import data_pb2, frame_pb2, handle_pb2, service_pb2

SERVICE = "/lpdeform.v1.DeformService/"
SIDE = 12
PATIENCE = 60.0
BETWEEN_UPDATES = 0.05


def sheet():
    places = np.array([[x, y, 0.0] for x in range(SIDE) for y in range(SIDE)])
    corners = np.array([[x * SIDE + y, (x + 1) * SIDE + y, (x + 1) * SIDE + y + 1, x * SIDE + y + 1]
                        for x in range(SIDE - 1) for y in range(SIDE - 1)], dtype="<u4")
    faces = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    data = data_pb2.Buffer(inline=places.astype("<f8").tobytes() + faces.tobytes())
    return data_pb2.Mesh(vertex_count=len(places), face_count=len(faces), scalar=data_pb2.SCALAR_FLOAT64, data=data)


def held(name, vertices, z):
    motion = handle_pb2.Motion(rigid=handle_pb2.RigidMotion(translation=data_pb2.Vector3(z=z)))
    buffer = data_pb2.Buffer(inline=np.array(vertices, dtype="<u4").tobytes())
    return handle_pb2.HandleUpdate(name=name, set=handle_pb2.Handle(vertices=buffer, motion=motion))


class Victim:
    """`cuts`: what ended that must not, each with its reason. `gaps`: seconds between one frame and the next."""

    def __init__(self) -> None:
        self.cuts: list[str] = []
        self.gaps: list[float] = []
        self.last = 0.0
        self.is_over = threading.Event()
        self.has_frame = threading.Event()

    def note_frame(self) -> None:
        now = time.monotonic()
        if self.last:
            self.gaps.append(now - self.last)
        self.last = now
        self.has_frame.set()

    def begin(self, run) -> None:
        self.thread = threading.Thread(target=self._guard, args=(run,), daemon=True)
        self.thread.start()

    def _guard(self, run) -> None:
        while not self.is_over.is_set():
            try:
                run()
                why = "ended"
            except Exception as error:  # whatever ends it is what is looked for
                why = f"{type(error).__name__}: {error}"
            if self.is_over.is_set():
                return
            self.cuts.append(f"{type(self).__name__}: {why}")
            time.sleep(0.05)  # before it comes again

    def taken(self):
        """The gaps since this was asked last, and the cuts."""
        gaps, self.gaps = self.gaps, []
        cuts, self.cuts = self.cuts, []
        return gaps, cuts


class Native(Victim):
    """The writer: a new place for the handle twenty times a second."""

    def __init__(self, port: int, token: str) -> None:
        super().__init__()
        self.metadata = (("authorization", f"Bearer {token}"),)
        self.channel = grpc.insecure_channel(f"127.0.0.1:{port}", [("grpc.use_local_subchannel_pool", 1)])
        request = service_pb2.CreateSessionRequest(mesh=sheet())
        made = self.channel.unary_unary(SERVICE + "CreateSession", service_pb2.CreateSessionRequest.SerializeToString,
                                        service_pb2.CreateSessionResponse.FromString)(request, timeout=PATIENCE, metadata=self.metadata)
        self.session, self.token, self.seq = made.session.name, made.writer_token, 0
        self.begin(self._stream)

    def _stream(self) -> None:
        requests: queue.Queue = queue.Queue()
        requests.put(service_pb2.DeformRequest(open=service_pb2.DeformOpen(session=self.session, writer_token=self.token)))
        deform = self.channel.stream_stream(SERVICE + "Deform", service_pb2.DeformRequest.SerializeToString,
                                            service_pb2.DeformResponse.FromString)
        self.call = deform(iter(requests.get, None), metadata=self.metadata)
        ended = threading.Event()
        threading.Thread(target=self._move, args=(requests, ended), daemon=True).start()
        try:
            for response in self.call:
                part = response.event.frame
                if part.last:
                    self.note_frame()
                    requests.put(service_pb2.DeformRequest(ack=service_pb2.FrameAck(frame_seq=part.frame_seq)))
                elif response.event.HasField("fault"):
                    self.cuts.append(f"Native: fault {response.event.fault.reason}")
        finally:
            ended.set()
            requests.put(None)

    def _move(self, requests, ended) -> None:
        while not ended.wait(BETWEEN_UPDATES):
            self.seq += 1
            handles = [held("base", range(SIDE), 0), held("tip", range(SIDE * (SIDE - 1), SIDE * SIDE), 0.02 * (self.seq % 97))]
            requests.put(service_pb2.DeformRequest(update=service_pb2.Update(input_seq=self.seq, handles=handles)))

    def stop(self) -> None:
        self.is_over.set()
        self.call.cancel()
        self.channel.close()
        self.thread.join(PATIENCE)


class Page(Victim):
    """A reader as a browser is one: HTTP/1.1, a stream on one connection, a call for each acknowledgement on another."""

    def __init__(self, port: int, token: str, session: str) -> None:
        super().__init__()
        self.port, self.session = port, session
        self.headers = {"content-type": "application/grpc-web+proto", "x-grpc-web": "1", "authorization": f"Bearer {token}"}
        self.begin(self._stream)

    def _post(self, connection, method, request):
        message = request.SerializeToString()
        connection.request("POST", SERVICE + method, struct.pack(">BI", 0, len(message)) + message, self.headers)
        return connection.getresponse()

    def _stream(self) -> None:
        calls = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        self.connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        try:
            request = service_pb2.StreamFramesRequest(session=self.session, options=frame_pb2.FrameOptions(credit=2))
            answer = self._post(self.connection, "StreamFrames", request)
            stream_id = ""
            while len(head := answer.read(5)) == 5:
                flags, size = struct.unpack(">BI", head)
                message = answer.read(size)
                if flags & 0x80:
                    raise ConnectionError(message.decode("latin-1"))
                event = service_pb2.StreamFramesResponse.FromString(message).event
                stream_id = event.opened.stream_id or stream_id
                if event.frame.last:
                    self.note_frame()
                    self._acknowledge(calls, stream_id, event.frame.frame_seq)
            raise ConnectionError(f"status {answer.status} and an end without trailers")
        finally:
            calls.close()
            self.connection.close()

    def _acknowledge(self, calls, stream_id, number) -> None:
        request = service_pb2.AckFramesRequest(session=self.session, stream_id=stream_id, frame_seq=number)
        answer = self._post(calls, "AckFrames", request)
        body = answer.read()
        if answer.status != 200 or b"grpc-status:0" not in body.replace(b" ", b"") or answer.headers.get("grpc-status", "0") != "0":
            self.cuts.append(f"Page: AckFrames was answered {answer.status} {dict(answer.headers)} {body!r}")

    def stop(self) -> None:
        self.is_over.set()
        if self.connection.sock:
            self.connection.sock.shutdown(socket.SHUT_RDWR)
        self.thread.join(PATIENCE)
