"""lpdeform-server whose store is full or does not answer: it still removes, it accepts changes again without a restart, and
when it is stopped it waits, reports what was not stored, and exits with 2. The disk is a small tmpfs in a mount namespace of
this test; if that is not possible, the test fails. It uses the Python client's messages, so it runs in the environment of
deploy/install python."""

import contextlib
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

import grpc

import programs
from lpdeform import _status
from lpdeform.v1 import data_pb2, handle_pb2, service_pb2

SERVICE = "/lpdeform.v1.DeformService/"
INSIDE = "LPDEFORM_TEST_HAS_ITS_OWN_MOUNTS"
SIDE = 100  # vertices along a side of the sheet: a mesh of about half a megabyte
NOT_KEPT = 2
KEEPING = 0.25  # seconds for which the server waits for the store before it answers


def in_own_mounts():
    """Goes on in a mount namespace, as root there."""
    if os.environ.get(INSIDE):
        return
    # In a root of chroot's, which is no mount, nothing can be said of how mounts spread.
    for how in (["-m"], ["-Urm"], ["-m", "--propagation", "unchanged"]):
        with tempfile.TemporaryDirectory() as place:
            tried = subprocess.run(["unshare", *how, "mount", "-t", "tmpfs", "-o", "size=1m", "none", place], capture_output=True)
        if tried.returncode == 0:
            os.environ[INSIDE] = "1"
            os.execvp("unshare", ["unshare", *how, sys.executable, *sys.argv])
    sys.exit("full_store_test: neither `unshare -m` nor `unshare -Urm` may mount a tmpfs here: run it as root, or allow user namespaces"
             f" (kernel.unprivileged_userns_clone=1): {tried.stderr.decode().strip()}")


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def shown(server, metric):
    with urllib.request.urlopen(server.admin + "/metrics", timeout=60) as answer:
        return float(re.search(rf"^{metric} (\S+)$", answer.read().decode(), re.MULTILINE).group(1))


class Client:
    def __init__(self, server):
        self.server = server
        self.channel = grpc.insecure_channel(server.address, [("grpc.use_local_subchannel_pool", 1)])

    def call(self, name, **fields):
        request = getattr(service_pb2, f"{name}Request")(**fields)
        answer = getattr(service_pb2, f"{name}Response")
        return self.channel.unary_unary(SERVICE + name, type(request).SerializeToString, answer.FromString)(
            request, timeout=programs.PATIENCE)

    def create(self, height, side=SIDE):
        """A sheet; of another height it is another mesh."""
        places = [struct.pack("<3d", x, y, height) for x in range(side) for y in range(side)]
        faces = []
        for x in range(side - 1):
            for y in range(side - 1):
                at = side * x + y
                faces += [struct.pack("<3I", at, at + side, at + side + 1), struct.pack("<3I", at, at + side + 1, at + 1)]
        mesh = data_pb2.Mesh(vertex_count=len(places), face_count=len(faces), scalar=data_pb2.SCALAR_FLOAT64,
                             data=data_pb2.Buffer(inline=b"".join(places + faces)))
        return self.call("CreateSession", mesh=mesh)

    def set_p(self, session, input_seq, p):
        """Whether it was kept. `p`: one value, or one a vertex."""
        field = data_pb2.Field(uniform=p) if isinstance(p, float) else data_pb2.Field(per_vertex=data_pb2.FieldValues(
            scalar=data_pb2.SCALAR_FLOAT64, values=data_pb2.Buffer(inline=struct.pack(f"<{len(p)}d", *p))))
        update = service_pb2.Update(input_seq=input_seq, settings=handle_pb2.SettingsUpdate(p=field))
        return self.call("UpdateHandles", session=session.session.name, writer_token=session.writer_token,
                         update=update).result.kept

    def keep_p(self, session, input_seq, p):
        """Whether the store takes the update. Sends it again if the server answered before the store."""
        end = time.monotonic() + programs.PATIENCE
        while True:
            begin = time.monotonic()
            is_kept = self.set_p(session, input_seq, p)
            is_refused = not is_kept and time.monotonic() - begin < KEEPING and not shown(self.server, "lpdeform_store_failing")
            if is_kept or is_refused:
                return is_kept
            assert time.monotonic() < end, f"the store has not answered about update {input_seq}"

    def delete(self, session):
        self.call("DeleteSession", session=session.session.name)


class OfServers(unittest.TestCase):
    def begin(self, store, *arguments):
        server = programs.RunningServer("--store", store, "--admin-address", "127.0.0.1:0", *arguments)
        self.addCleanup(lambda: server.process.poll() is None and server.stop())
        return server, Client(server)

    def stopped(self, server):
        """Its status after SIGTERM, how long that took, and what it said of what was not kept."""
        begin = time.monotonic()
        status = server.stop()
        lines = [json.loads(line) for line in server.log if line.startswith("{")]
        return status, time.monotonic() - begin, [line for line in lines if line["event"] in ("session_not_kept", "not_kept")]

    def wait_for(self, server, metric, value):
        end = time.monotonic() + programs.PATIENCE
        while True:
            found = shown(server, metric)
            if found == value:
                return
            self.assertLess(time.monotonic(), end, f"{metric} {found}")
            time.sleep(0.1)


class FullDisk(OfServers):
    def setUp(self):
        self.disk = tempfile.mkdtemp(prefix="lpdeform-disk-")
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=40m", "none", self.disk], check=True)
        self.addCleanup(os.rmdir, self.disk)
        self.addCleanup(subprocess.run, ["umount", self.disk], check=True)
        self.store = f"sqlite:{self.disk}/store"

    def fill(self):
        """As another program does, to the last byte."""
        with open(self.disk + "/other", "ab", buffering=0) as other:
            for size in (1 << 20, 4096, 1):
                with contextlib.suppress(OSError):
                    while True:
                        other.write(b"x" * size)
        self.assertEqual(os.statvfs(self.disk).f_bavail, 0)

    def refused(self, client, height):
        with self.assertRaises(grpc.RpcError) as caught:
            client.create(height)
        self.assertEqual(caught.exception.code(), grpc.StatusCode.RESOURCE_EXHAUSTED, caught.exception)
        error = _status.from_call(caught.exception, "")
        self.assertEqual(error.reason, "STORE_FULL")
        self.assertGreaterEqual(error.retry_after, 1)
        self.assertNotIn(self.disk, str(caught.exception), "where the store is, is nobody's business")
        return caught.exception.details()

    def test_it_removes_on_a_full_disk_and_takes_again_without_a_restart(self):
        server, client = self.begin(self.store)
        sessions = [client.create(height) for height in range(4)]
        self.fill()
        self.assertIn("Delete sessions", self.refused(client, 4))
        server.waits_for("store_full")
        self.wait_for(server, "lpdeform_store_full", 1)
        self.wait_for(server, "lpdeform_store_failing", 0)
        for input_seq in range(1, 200):  # what needs no more room is kept
            self.assertTrue(client.keep_p(sessions[0], input_seq, 1 + input_seq / 1000))
        for session in sessions[1:3]:
            client.delete(session)
            self.fill()  # what is given back, somebody else takes
        self.refused(client, 4)
        client.delete(sessions[3])
        again = client.create(4)
        os.truncate(self.disk + "/other", 0)
        self.wait_for(server, "lpdeform_store_full", 0)
        server.waits_for("store_has_room")
        other = client.create(5)
        self.assertEqual(self.stopped(server)[0], 0)
        _, client = self.begin(self.store)
        for session in (sessions[0], again, other):
            self.assertEqual(client.call("GetSession", session=session.session.name).session.name, session.session.name)

    def test_what_nobody_uses_goes_from_a_full_disk(self):
        server, client = self.begin(self.store, "--session-idle", "3")
        for height in range(3):
            client.create(height)
        self.fill()
        end = time.monotonic() + programs.PATIENCE
        while os.listdir(self.disk + "/store/blobs"):
            self.assertLess(time.monotonic(), end, "".join(server.log))
            time.sleep(0.1)
        client.create(9)

    def test_a_server_that_begins_on_a_full_disk_removes(self):
        server, client = self.begin(self.store)
        sessions = [client.create(height) for height in range(4)]
        for how in (signal.SIGTERM, signal.SIGKILL):
            self.fill()
            server.process.send_signal(how)
            self.assertEqual(server.process.wait(programs.PATIENCE), 0 if how == signal.SIGTERM else -signal.SIGKILL)
            server.reader.join()
            server.process.stdout.close()
            self.fill()  # what an end gives back, somebody else takes
            server, client = self.begin(self.store)
            client.delete(sessions.pop())
            sessions.append(client.create(9 + how))
        for session in sessions:
            client.call("GetSession", session=session.session.name)

    def test_what_a_full_disk_did_not_take_is_named_at_the_end(self):
        server, client = self.begin(self.store)
        sessions = [client.create(height) for height in range(14)]  # whose fields are more than the file has room for
        self.fill()
        values = [1 + k / (2 * SIDE * SIDE) for k in range(SIDE * SIDE)]
        kept = {}
        for input_seq in range(1, 6):
            for session in sessions:
                field = [value + (input_seq - 1) / 10 for value in values]
                kept.setdefault(session.session.name, []).append(client.keep_p(session, input_seq, field))
        for session in sessions:  # the store may have taken it at a later try
            kept[session.session.name][-1] = client.keep_p(session, 5, [value + 4 / 10 for value in values])
        lost = {name[len("sessions/"):][:8]: answers for name, answers in kept.items() if not answers[-1]}
        self.assertTrue(lost, kept)
        status, seconds, said = self.stopped(server)
        self.assertEqual(status, NOT_KEPT)
        self.assertGreater(seconds, 4.9)
        by_session = {line["session"]: line for line in said if line["event"] == "session_not_kept"}
        self.assertEqual(set(by_session), set(lost))
        for name, line in by_session.items():
            known = max((number for number, is_kept in enumerate(lost[name], 1) if is_kept), default=0)
            self.assertEqual(line["input_seq"], 5, line)
            self.assertIn(line["kept_input_seq"], range(known, 5), line)
            self.assertEqual(line["updates"], 5 - line["kept_input_seq"])
        self.assertEqual(said[-1]["sessions"], len(lost))


class RedisThatIsStopped(OfServers):
    def setUp(self):
        folder = tempfile.mkdtemp(prefix="lpdeform-redis-")
        self.addCleanup(shutil.rmtree, folder)
        port = free_port()
        self.redis = subprocess.Popen(["redis-server", "--port", str(port), "--bind", "127.0.0.1", "--dir", folder, "--save", ""],
                                      stdout=subprocess.DEVNULL)
        self.addCleanup(self.redis.wait)
        self.addCleanup(self.redis.kill)
        end = time.monotonic() + programs.PATIENCE
        while not self.is_there(port):
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)
        self.server, self.client = self.begin(f"redis://127.0.0.1:{port}")
        self.session = self.client.create(0, side=3)
        self.assertTrue(self.client.keep_p(self.session, 1, 1.5))

    @staticmethod
    def is_there(port):
        with socket.socket() as tried:
            return tried.connect_ex(("127.0.0.1", port)) == 0

    def drag_unkept(self):
        for input_seq in range(2, 102):
            self.assertFalse(self.client.set_p(self.session, input_seq, 1.5 + input_seq / 1000))

    def expect_not_kept(self):
        status, seconds, said = self.stopped(self.server)
        self.assertEqual(status, NOT_KEPT)
        self.assertGreater(seconds, 4.9)
        self.assertLess(seconds, 20)
        self.assertEqual([line["event"] for line in said], ["session_not_kept", "not_kept"])
        self.assertEqual(said[0]["session"], self.session.session.name[len("sessions/"):][:8])
        self.assertEqual((said[0]["updates"], said[0]["kept_input_seq"], said[0]["input_seq"]), (100, 1, 101))
        self.assertEqual((said[1]["sessions"], said[1]["updates"]), (1, 100))

    def test_what_one_that_was_killed_did_not_take_is_named_at_the_end(self):
        self.redis.kill()
        self.drag_unkept()
        self.expect_not_kept()

    def test_what_one_that_hangs_did_not_take_is_named_at_the_end(self):
        self.redis.send_signal(signal.SIGSTOP)
        self.drag_unkept()
        self.expect_not_kept()

    def test_one_that_comes_back_in_time_takes_all(self):
        self.redis.send_signal(signal.SIGSTOP)
        self.drag_unkept()
        self.server.process.send_signal(signal.SIGTERM)
        self.server.waits_for("draining")
        time.sleep(1)  # of the 5 s that it has
        self.redis.send_signal(signal.SIGCONT)
        self.assertEqual(self.stopped(self.server)[::2], (0, []))


if __name__ == "__main__":
    in_own_mounts()
    programs.main()
