"""What lpdeform-server's log tells an operator: why a stream ended, which update was refused, and no more lines than can be
read. It uses the Python client's messages, so it runs in the environment of deploy/install python."""

import collections
import concurrent.futures
import contextlib
import glob
import json
import os
import socket
import struct
import subprocess
import tempfile
import time
import unittest
import urllib.request

import grpc

import programs
from lpdeform.v1 import data_pb2, handle_pb2, service_pb2

SERVICE = "/lpdeform.v1.DeformService/"
PLACES = [(x, y, 0) for x in range(3) for y in range(3)]
FACES = [(3 * x + y, 3 * x + y + 3, 3 * x + y + 4) for x in range(2) for y in range(2)]
FACES += [(3 * x + y, 3 * x + y + 4, 3 * x + y + 1) for x in range(2) for y in range(2)]


class Client:
    """`way`: the header by which a proxy chooses a server."""

    def __init__(self, address, way="one"):
        self.channel = grpc.insecure_channel(address, [("grpc.use_local_subchannel_pool", 1)])
        self.metadata = (("lpdeform-session", way),)

    def call(self, name, request):
        answer = getattr(service_pb2, f"{name}Response")
        return self.channel.unary_unary(SERVICE + name, type(request).SerializeToString, answer.FromString)(
            request, timeout=programs.PATIENCE, metadata=self.metadata)

    def refused(self, name, request):
        """The error that a call ends with."""
        with contextlib.suppress(grpc.RpcError):
            self.call(name, request)
            raise AssertionError("it was not refused")

    def create(self, sheets=1):
        """A session of so many sheets side by side."""
        places = [(x, y, 5 * k) for k in range(sheets) for x, y, _ in PLACES]
        faces = [[len(PLACES) * k + corner for corner in face] for k in range(sheets) for face in FACES]
        data = b"".join(struct.pack("<3d", *place) for place in places) + b"".join(struct.pack("<3I", *face) for face in faces)
        mesh = data_pb2.Mesh(vertex_count=len(places), face_count=len(faces), scalar=data_pb2.SCALAR_FLOAT64,
                             data=data_pb2.Buffer(inline=data))
        return self.call("CreateSession", service_pb2.CreateSessionRequest(mesh=mesh))

    def frames(self, session, timeout=programs.PATIENCE):
        """A stream that is open."""
        stream = self.channel.unary_stream(SERVICE + "StreamFrames", service_pb2.StreamFramesRequest.SerializeToString,
                                           service_pb2.StreamFramesResponse.FromString)(
            service_pb2.StreamFramesRequest(session=session.session.name), timeout=timeout)
        next(stream)
        return stream

    def deform(self, session):
        """A writer's stream that is open, and what takes its messages."""
        opening = service_pb2.DeformRequest(
            open=service_pb2.DeformOpen(session=session.session.name, writer_token=session.writer_token))
        done = concurrent.futures.Future()

        def requests():
            yield opening
            while (message := done.result()) is not None:
                yield message
                return

        stream = self.channel.stream_stream(SERVICE + "Deform", service_pb2.DeformRequest.SerializeToString,
                                            service_pb2.DeformResponse.FromString)(requests(), timeout=programs.PATIENCE)
        next(stream)
        return stream, lambda message: done.set_result(message)


def read_to_end(stream):
    with contextlib.suppress(grpc.RpcError):
        for _ in stream:
            pass


def update_of(session, input_seq, *vertices, handle="tip"):
    moved = handle_pb2.HandleUpdate(name=handle)
    moved.set.vertices.inline = struct.pack(f"<{len(vertices)}I", *vertices)
    moved.set.motion.fixed.SetInParent()
    return service_pb2.UpdateHandlesRequest(session=session.session.name, writer_token=session.writer_token,
                                            update=service_pb2.Update(input_seq=input_seq, handles=[moved]))


class Log(unittest.TestCase):
    def serve(self, *arguments):
        server = programs.RunningServer("--admin-address", "127.0.0.1:0", *arguments)
        self.addCleanup(lambda: server.process.poll() is not None or server.stop())
        return server, Client(server.address)

    def lines(self, server, event, **holds):
        found = []
        for text in list(server.log):
            if not text.startswith("{"):
                continue
            line = json.loads(text)
            if line["event"] == event and all(line.get(name) == value for name, value in holds.items()):
                found.append(line)
        return found

    def next_end(self, server):
        return json.loads(server.waits_for("stream_ended"))

    @staticmethod
    def digits(session):
        return session.session.name.removeprefix("sessions/")[:8]

    def shown(self, server):
        with urllib.request.urlopen(server.admin + "/metrics", timeout=60) as answer:
            lines = answer.read().decode().splitlines()
        return {name: float(value) for name, value in (line.rsplit(" ", 1) for line in lines if line and line[0] != "#")}


class Streams(Log):
    def test_the_log_and_the_metrics_say_why_each_ended(self):
        server, client = self.serve()
        session = client.create()

        client.frames(session).cancel()
        ended = self.next_end(server)
        self.assertEqual((ended["reason"], ended["session"]), ("cancelled", self.digits(session)))

        # When a call's time is over, the client cancels it, too. A server that is held up may see only that.
        ends = collections.Counter(["cancelled"])
        while not ends["deadline"]:
            self.assertLess(ends.total(), 10)
            read_to_end(client.frames(session, timeout=5))
            ends[self.next_end(server)["reason"]] += 1

        stream, send = client.deform(session)
        send(service_pb2.DeformRequest(open=service_pb2.DeformOpen(session=session.session.name)))
        read_to_end(stream)
        self.assertEqual(json.loads(server.waits_for("stream_misused"))["text"], "The stream was opened twice.")
        self.assertEqual(self.next_end(server)["reason"], "misuse")

        stream, send = client.deform(session)
        client.call("AcquireWriter", service_pb2.AcquireWriterRequest(session=session.session.name))
        read_to_end(stream)
        send(None)
        self.assertEqual(self.next_end(server)["reason"], "writer_replaced")

        stream = client.frames(session)
        client.call("DeleteSession", service_pb2.DeleteSessionRequest(session=session.session.name))
        read_to_end(stream)
        self.assertEqual(self.next_end(server)["reason"], "session_deleted")

        ends.update(["misuse", "writer_replaced", "session_deleted"])
        self.assertLessEqual(set(ends), {"cancelled", "deadline", "misuse", "writer_replaced", "session_deleted"})
        for reason, count in ends.items():
            self.assertEqual(self.shown(server)[f'lpdeform_streams_ended_total{{reason="{reason}"}}'], count, reason)

        stream = client.frames(client.create())
        self.assertEqual(server.stop(), 0)
        read_to_end(stream)
        self.assertEqual(self.next_end(server)["reason"], "draining")

    def test_of_a_session_that_nobody_used_it_says_so(self):
        server, client = self.serve("--session-idle", "3")
        read_to_end(client.frames(client.create()))
        self.assertEqual(self.next_end(server)["reason"], "session_expired")

    def test_a_fault_for_which_no_frame_can_come_is_named(self):
        server, client = self.serve()
        session = client.create(sheets=2)
        stream = client.frames(session)
        client.call("UpdateHandles", update_of(session, 1, 0, 1))  # of the first sheet
        for response in stream:
            if response.event.HasField("fault"):
                break
        stream.cancel()
        self.assertEqual(response.event.fault.reason, "COMPONENT_WITHOUT_HANDLE")
        self.assertEqual(self.next_end(server)["fault"], "COMPONENT_WITHOUT_HANDLE")


class Refusals(Log):
    def test_say_which_update_which_handle_which_element_and_which_limit(self):
        server, client = self.serve()
        session = client.create()
        client.call("UpdateHandles", update_of(session, 6, 0, 1))
        client.refused("UpdateHandles", update_of(session, 7, 0, 99))
        line = json.loads(server.waits_for("refused"))
        self.assertEqual((line["session"], line["session_input_seq"], line["input_seq"]), (self.digits(session), 6, 7))
        self.assertEqual((line["handle"], line["reason"]), ("tip", "HANDLE_VERTEX_OUT_OF_RANGE"))
        self.assertIn("99", line["element"])
        self.assertEqual(line["limit"], "0 <= vertex < 9")
        # In a stream as well.
        stream, send = client.deform(session)
        send(service_pb2.DeformRequest(update=update_of(session, 8, 0, 98, handle="base").update))
        line = json.loads(server.waits_for("refused"))
        self.assertEqual((line["input_seq"], line["handle"]), (8, "base"))
        stream.cancel()

    def test_a_wrong_checksum_is_no_fault_of_the_servers(self):
        server, client = self.serve()
        upload = client.call("CreateUpload", service_pb2.CreateUploadRequest(size_bytes=4, crc32c=1)).upload
        client.refused("UploadPart", service_pb2.UploadPartRequest(upload=upload, data=b"abcd"))
        line = json.loads(server.waits_for("refused"))
        self.assertEqual((line["reason"], line["level"]), ("UPLOAD_CHECKSUM", "info"))

    def test_a_name_or_a_token_in_the_wrong_place_is_not_repeated(self):
        server, client = self.serve()
        session = client.create()
        client.refused("GetSession", service_pb2.GetSessionRequest(session=session.writer_token))
        client.refused("GetSession", service_pb2.GetSessionRequest(session="sessions/" + "0123456789abcdef" * 2))
        client.refused("UpdateHandles", update_of(session, 1, 0, 99, handle=session.writer_token))
        server.stop()
        said = "".join(server.log)
        self.assertEqual(len(self.lines(server, "refused")), 3)
        self.assertNotIn(session.writer_token[:12], said)
        self.assertNotIn("0123456789ab", said)

    def test_ten_thousand_leave_no_more_lines_than_one_can_read_and_none_out_of_the_count(self):
        server, client = self.serve()
        loud, quiet = client.create(), client.create()
        update = client.channel.unary_unary(SERVICE + "UpdateHandles", service_pb2.UpdateHandlesRequest.SerializeToString,
                                            service_pb2.UpdateHandlesResponse.FromString)
        many = 10_000
        waiting = []
        for k in range(many):
            waiting.append(update.future(update_of(loud, k + 1, 0, 99), timeout=programs.PATIENCE))
            if len(waiting) == 100:
                for call in waiting:
                    self.assertEqual(call.code(), grpc.StatusCode.INVALID_ARGUMENT)
                waiting.clear()
        client.refused("UpdateHandles", update_of(quiet, 1, 0, 99))
        self.assertEqual(self.shown(server)['lpdeform_rejections_total{reason="HANDLE_VERTEX_OUT_OF_RANGE"}'], many + 1)
        server.stop()
        written = self.lines(server, "refused", session=self.digits(loud))
        left_out = self.lines(server, "left_out", of="refused", session=self.digits(loud))
        self.assertEqual(len(written) + sum(line["count"] for line in left_out), many)
        self.assertLessEqual(len(written), 10 * (len(left_out) + 1))  # in the last window perhaps too few to leave any out
        self.assertEqual(left_out[0]["reason"], "HANDLE_VERTEX_OUT_OF_RANGE")
        self.assertRegex(left_out[0]["text"], r"^refused \d+ more times in \d+ s$")
        self.assertEqual(len(self.lines(server, "refused", session=self.digits(quiet))), 1)  # not drowned by the other

    def test_streams_that_come_and_go_leave_no_more(self):
        server, client = self.serve()
        session = client.create()
        for _ in range(300):
            client.frames(session).cancel()
        server.stop()
        for event in ("stream_opened", "stream_ended"):
            left_out = self.lines(server, "left_out", of=event)
            self.assertLessEqual(len(self.lines(server, event)), 10 * (len(left_out) + 1))
            self.assertEqual(len(self.lines(server, event)) + sum(line["count"] for line in left_out), 300)


    def test_connections_for_which_there_is_no_room_leave_no_more(self):
        server, _ = self.serve("--max-connections", "4")
        host, port = server.address.split(":")
        for _ in range(100):
            self.addCleanup(socket.create_connection((host, int(port)), programs.PATIENCE).close)
        end = time.monotonic() + programs.PATIENCE
        while self.shown(server)["lpdeform_connections_refused_total"] < 96:
            self.assertLess(time.monotonic(), end)
        server.stop()
        written, left_out = self.lines(server, "connection_refused"), self.lines(server, "left_out", of="connection_refused")
        self.assertLessEqual(len(written), 10 * (len(left_out) + 1))
        self.assertEqual(len(written) + sum(line["count"] for line in left_out), 96)


class Damage(Log):
    def test_is_an_error_that_names_the_session_and_the_file_and_is_counted(self):
        with tempfile.TemporaryDirectory() as folder:
            server, client = self.serve("--store", f"sqlite:{folder}")
            session = client.create()
            server.stop()
            (blob,) = [path for path in glob.glob(f"{folder}/**/*", recursive=True) if len(os.path.basename(path)) == 64]
            with open(blob, "r+b") as file:
                file.write(b"damaged")
            server, client = self.serve("--store", f"sqlite:{folder}")
            with self.assertRaises(grpc.RpcError) as caught:
                client.call("GetSession", service_pb2.GetSessionRequest(session=session.session.name))
            self.assertEqual(caught.exception.code(), grpc.StatusCode.NOT_FOUND)
            self.assertNotIn(folder, caught.exception.details())
            line = json.loads(server.waits_for("session_damaged"))
            self.assertEqual((line["level"], line["session"]), ("error", self.digits(session)))
            self.assertIn(blob, line["text"])
            self.assertEqual(self.shown(server)["lpdeform_sessions_damaged_total"], 1)
            server.stop()


class Shared(Log):
    """Servers with one Redis."""

    def start_redis(self, folder):
        while True:  # until it has a port of its own
            with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as free:
                port = free.getsockname()[1]
            redis = subprocess.Popen(["redis-server", "--port", str(port), "--bind", "127.0.0.1", "--dir", folder, "--save", "",
                                      "--appendonly", "yes", "--appendfsync", "always", "--maxmemory", "64mb", "--logfile", "log"])
            self.addCleanup(redis.wait)
            self.addCleanup(redis.kill)
            while redis.poll() is None:
                if self.redis(port, "ping").stdout == "PONG\n":
                    return port

    @staticmethod
    def redis(port, *command):
        return subprocess.run(["redis-cli", "-p", str(port), *command], capture_output=True, text=True)

    def until(self, server, name, holds):
        end = time.monotonic() + programs.PATIENCE
        while not holds(self.shown(server)[name]):
            self.assertLess(time.monotonic(), end, name)
            time.sleep(0.05)

    def test_a_stream_of_a_session_that_another_server_takes_says_so(self):
        with tempfile.TemporaryDirectory() as folder:
            store = f"redis://127.0.0.1:{self.start_redis(folder)}"
            (first, client), (second, other) = self.serve("--store", store), self.serve("--store", store)
            session = client.create()
            stream = client.frames(session)
            while True:  # until it is handed over
                with contextlib.suppress(grpc.RpcError):
                    other.call("UpdateHandles", update_of(session, 1, 0, 1))
                    break
            read_to_end(stream)
            seen = first.seen  # the two come in any order
            self.assertEqual(json.loads(first.waits_for("session_ended"))["reason"], "elsewhere")
            first.seen = seen
            self.assertEqual(self.next_end(first)["reason"], "session_elsewhere")
            first.stop()
            second.stop()

    def test_each_server_shows_what_redis_says_of_itself(self):
        with tempfile.TemporaryDirectory() as folder:
            port = self.start_redis(folder)
            server, _ = self.serve("--store", f"redis://127.0.0.1:{port}")
            self.until(server, "lpdeform_redis_memory_limit_bytes", lambda value: value == 64 << 20)
            shown = self.shown(server)
            self.assertGreater(shown["lpdeform_redis_memory_bytes"], 100_000)
            self.assertGreaterEqual(shown["lpdeform_redis_clients"], 2)
            self.assertEqual([shown[f"lpdeform_redis_{name}"] for name in ("in_memory_alone", "persistence_failing", "evicted_keys",
                                                                           "clients_refused", "replicas")], [0] * 5)
            self.assertEqual(self.redis(port, "config", "set", "appendonly", "no").stdout, "OK\n")
            self.until(server, "lpdeform_redis_in_memory_alone", lambda value: value == 1)
            server.stop()


if __name__ == "__main__":
    programs.main()
