"""Hostile HTTP/2: how much one client that violates every protocol can make the server hold, directly and behind Envoy."""

import contextlib
import os
import socket
import struct
import subprocess
import threading
import time
import urllib.request
import zlib

import programs

ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
DATA, HEADERS, RST_STREAM, SETTINGS, PING, GOAWAY, WINDOW_UPDATE, CONTINUATION = 0, 1, 3, 4, 6, 7, 8, 9
ACK, END_STREAM, END_HEADERS = 1, 1, 4
MAX_CONCURRENT_STREAMS, INITIAL_WINDOW = 3, 4
MIB = 1 << 20


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) + struct.pack(">I", stream) + payload


def literal(name, value):
    return b"\0" + bytes([len(name)]) + name + bytes([len(value)]) + value


def call(method, service=b"lpdeform.v1.DeformService"):
    """The headers of a call, POST and http."""
    return (b"\x83\x86" + literal(b":path", b"/" + service + b"/" + method) + literal(b":authority", b"localhost") +
            literal(b"content-type", b"application/grpc") + literal(b"te", b"trailers"))


def has_grpc_1_51():
    """Whether the server has the gRPC of Debian 12 and 13."""
    return "libgrpc++.so.1.51 " in subprocess.run(["ldd", programs.server()], capture_output=True, text=True, check=True).stdout


class Attacker:
    """A connection that answers pings and settings and keeps to windows, and to nothing else. `answers`: whether it does even that;
    limits that were not acknowledged are not in force."""

    def __init__(self, port, answers=True):
        self.socket = socket.create_connection(("127.0.0.1", port), programs.PATIENCE)
        self.lock = threading.Condition()
        self.answers = answers
        self.answered = set()  # streams that headers came on
        self.settings, self.windows, self.initial, self.left, self.is_over = {}, {0: 65535}, 65535, 0, threading.Event()
        self.send(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(SETTINGS, 0, 0))
        threading.Thread(target=self.read, daemon=True).start()

    def send(self, data):
        """False where the other side has closed the connection."""
        try:
            self.socket.sendall(data)
            return True
        except OSError:
            self.is_over.set()
            return False

    def read(self):
        waiting = b""
        with contextlib.suppress(OSError):
            while data := self.socket.recv(65536):
                waiting += data
                while len(waiting) >= 9 and len(waiting) >= 9 + (size := int.from_bytes(waiting[:3], "big")):
                    self.take(waiting[3], waiting[4], int.from_bytes(waiting[5:9], "big"), waiting[9:9 + size])
                    waiting = waiting[9 + size:]
        self.is_over.set()
        with self.lock:
            self.lock.notify_all()

    def take(self, kind, flags, stream, payload):
        if kind == PING and not flags & ACK and self.answers:
            self.send(frame(PING, ACK, 0, payload))
        with self.lock:
            if kind == SETTINGS and not flags & ACK and self.answers:
                told = dict(struct.iter_unpack(">HI", payload))
                grown = told.get(INITIAL_WINDOW, self.initial) - self.initial
                self.initial += grown
                self.windows = {key: size + (grown if key else 0) for key, size in self.windows.items()}
                self.send(frame(SETTINGS, ACK, 0))
                self.settings |= told
            if kind == WINDOW_UPDATE:
                self.windows[stream] = self.windows.get(stream, 0) + int.from_bytes(payload, "big")
            if kind == RST_STREAM:
                self.windows.pop(stream, None)
            if kind == HEADERS:
                self.answered.add(stream)
            self.lock.notify_all()

    def waits_for(self, what):
        """Whether it comes true."""
        with self.lock:
            return self.lock.wait_for(what, programs.PATIENCE)

    def told(self, setting):
        self.waits_for(lambda: setting in self.settings)
        return self.settings[setting]

    def fill(self, streams, size, seconds, method=b"UploadPart", least=0):
        """Sends messages that announce `size` bytes and lack the last one, as far as the windows allow. Goes on for `seconds`, and
        until `least` bytes are sent. Returns the bytes sent."""
        sent, heads = 0, {}
        for stream in streams:
            heads[stream] = b"\0" + struct.pack(">I", size)
            with self.lock:
                self.windows[stream] = self.initial
            self.send(frame(HEADERS, END_HEADERS, stream, call(method)))
        left = dict.fromkeys(streams, size + 4)
        begin = time.monotonic()
        while time.monotonic() - begin < (seconds if sent >= least else programs.PATIENCE) and not self.is_over.is_set():
            with self.lock:
                able = [s for s in left if min(left[s], self.windows.get(s, 0), self.windows[0]) >= 5]
                if not able:
                    self.lock.wait(0.05)
                    continue
                parts = []
                for stream in able:
                    room = min(16384, self.windows[stream], self.windows[0], left[stream])
                    if room < 5:  # the head goes in one piece
                        continue
                    parts.append(frame(DATA, 0, stream, (heads.pop(stream, b"") + bytes(room))[:room]))
                    for of in (stream, 0):
                        self.windows[of] -= room
                    left[stream] -= room
                    sent += room
            self.send(b"".join(parts))
        return sent

    def reset(self, count):
        """Begins calls and takes them back at once; how many were sent before the other side closed the connection."""
        headers, stream = call(b"ListSessions"), 1
        while stream < 2 * count and not self.is_over.is_set():
            burst = range(stream, stream + 200, 2)
            if not self.send(b"".join(frame(HEADERS, END_HEADERS, one, headers) + frame(RST_STREAM, 0, one, b"\0\0\0\x08")
                                      for one in burst)):
                break
            stream += 200
        return stream // 2

    def send_whole(self, streams, message, encoding):
        """A call on each stream, of one message that is marked as compressed, and its end; whether all was sent."""
        headers = call(b"UploadPart") + (literal(b"grpc-encoding", encoding) if encoding else b"")
        for stream in streams:
            with self.lock:
                self.windows[stream] = self.initial
            self.send(frame(HEADERS, END_HEADERS, stream, headers))
            left = b"\1" + struct.pack(">I", len(message)) + message
            while left:
                with self.lock:
                    self.lock.wait_for(lambda: self.is_over.is_set() or stream not in self.windows or
                                       min(self.windows[stream], self.windows[0]) > 0, programs.PATIENCE)
                    if self.is_over.is_set() or stream not in self.windows:
                        break
                    room = min(16384, self.windows[stream], self.windows[0], len(left))
                    for of in (stream, 0):
                        self.windows[of] -= room
                part, left = left[:room], left[room:]
                self.send(frame(DATA, 0 if left else END_STREAM, stream, part))

    def endless_headers(self, most_bytes):
        """One block of headers that goes on and on; the bytes sent."""
        small = literal(b"a", b"1")
        block = frame(CONTINUATION, 0, 1, small * (16000 // len(small)))
        sent = 0
        self.send(frame(HEADERS, 0, 1, small))
        while sent < most_bytes and not self.is_over.is_set() and self.send(8 * block):
            sent += 8 * len(block)
        return sent

    def close(self):
        self.socket.close()


class Flooded(programs.OnShapes):
    def serve(self, *arguments):
        server = programs.RunningServer("--admin-address", "127.0.0.1:0", "--log-level", "off", *arguments)
        self.addCleanup(server.stop)
        self.flooded, self.port = server, int(server.address.rsplit(":", 1)[1])
        return self.memory()

    def attack(self, port=None, answers=True):
        attacker = Attacker(port or self.port, answers)
        self.addCleanup(attacker.close)
        return attacker

    def memory(self, process=None, which="VmRSS"):
        """Of the server, or of this process, in bytes. `which`: "VmHWM" for the most that it ever was."""
        status = programs.read_text(f"/proc/{(process or self.flooded.process).pid}/status")
        return next(int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith(which))

    def unpacks_nothing(self, before, port=None):
        """Messages of a quarter of a MiB that would be 256 MiB each take what they are."""
        for encoding, bits in (b"gzip", 31), (b"deflate", 15), (b"", 31):
            packer = zlib.compressobj(9, zlib.DEFLATED, bits)
            message = b"".join(packer.compress(bytes(MIB)) for _ in range(256)) + packer.flush()
            attacker = self.attack(port)
            attacker.told(INITIAL_WINDOW)
            attacker.send_whole(range(1, 9, 2), message, encoding)
            self.assertTrue(self.serves(port))
        self.assertLess(self.memory(which="VmHWM") - before, 64 * MIB)
        # Those that do not say how they are packed; Envoy passes them on when it comes to it. Newer gRPC tells the server of the
        # others, too.
        self.assertTrue(attacker.waits_for(lambda: len(attacker.answered) == 4))
        read = 4 if has_grpc_1_51() else 12
        end = time.monotonic() + programs.PATIENCE
        while self.rejected("MESSAGE_UNREADABLE") < read and time.monotonic() < end:
            time.sleep(0.05)
        self.assertEqual(self.rejected("MESSAGE_UNREADABLE"), read)

    def admin(self, path):
        with urllib.request.urlopen(self.flooded.admin + path, timeout=programs.PATIENCE) as answer:
            return answer.read().decode()

    def calls(self, what, method):
        return sum(float(line.rsplit(" ", 1)[1]) for line in self.admin("/metrics").splitlines()
                   if line.startswith(f"grpc_server_{what}") and f'/{method}"' in line)

    def rejected(self, reason):
        return sum(float(line.rsplit(" ", 1)[1]) for line in self.admin("/metrics").splitlines()
                   if line.startswith("lpdeform_rejections_total") and f'"{reason}"' in line)

    def serves(self, port=None):
        return programs.run("deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--server",
                            f"127.0.0.1:{port or self.port}").returncode == 0


class TheServerAlone(Flooded):
    def test_messages_that_never_end_take_what_the_calls_of_a_connection_may_and_no_more(self):
        before = self.serve("--max-calls-per-connection", "8")
        attacker = self.attack()
        self.assertEqual(attacker.told(MAX_CONCURRENT_STREAMS), 8)
        sent = attacker.fill(range(1, 17, 2), 4 * MIB - 5, 2, least=8 * MIB)
        self.assertGreaterEqual(sent, 8 * MIB)
        self.assertLess(self.memory() - before, 8 * 4 * MIB + 32 * MIB)
        greedy = self.attack()
        greedy.told(MAX_CONCURRENT_STREAMS)
        greedy.fill(range(1, 129, 2), 4 * MIB - 5, 2)  # more than it was told
        self.assertLess(self.memory() - before, 2 * 8 * 4 * MIB + 32 * MIB)
        self.assertTrue(self.serves())

    def test_of_streams_whose_caller_may_not_come_in_nothing_is_read(self):
        key = self.at("key.pem")
        subprocess.run(["openssl", "genpkey", "-algorithm", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-out", key], check=True,
                       capture_output=True)
        subprocess.run(["openssl", "pkey", "-in", key, "-pubout", "-out", f"{key}.pub"], check=True, capture_output=True)
        before = self.serve("--token-keys", f"{key}.pub")
        attacker = self.attack()
        attacker.told(MAX_CONCURRENT_STREAMS)
        sent = attacker.fill(range(1, 33, 2), 4 * MIB - 5, 1, method=b"Deform")
        self.assertLess(sent, 16 * MIB)
        self.assertLess(self.memory() - before, 16 * MIB)
        end = time.monotonic() + programs.PATIENCE
        while self.calls("call_duration_seconds_count", "Deform") < 16:
            self.assertLess(time.monotonic(), end)
            time.sleep(0.05)
        self.assertEqual(self.calls("call_duration_seconds_count", "Deform"), 16)

    def test_compressed_messages_are_not_unpacked(self):
        self.unpacks_nothing(self.serve())

    def test_connections_that_only_answer_pings_are_closed(self):
        self.serve("--connection-idle", "1")
        attacker = self.attack()
        self.assertTrue(attacker.is_over.wait(programs.PATIENCE))

    def test_calls_that_need_no_token_keep_no_connection(self):
        self.serve("--connection-idle", "1", "--max-connections", "8")
        watch, reflect = call(b"Watch", b"grpc.health.v1.Health"), call(b"ServerReflectionInfo", b"grpc.reflection.v1alpha.ServerReflection")
        attackers = [self.attack() for _ in range(8)]
        for attacker, headers in zip(attackers, [watch, reflect] * 4):
            attacker.told(MAX_CONCURRENT_STREAMS)
            attacker.send(frame(HEADERS, END_HEADERS, 1, headers) + frame(DATA, 0, 1, bytes(5)))
        for attacker in attackers:
            self.assertTrue(attacker.is_over.wait(programs.PATIENCE))
        self.assertTrue(self.serves())

    def test_calls_of_reflection_take_few_threads(self):
        self.serve()
        folder = f"/proc/{self.flooded.process.pid}/task"
        before = len(os.listdir(folder))
        attacker = self.attack()
        attacker.told(MAX_CONCURRENT_STREAMS)
        listing = struct.pack(">BI", 0, 2) + b"\x3a\x00"
        for stream in range(1, 201, 2):
            attacker.send(frame(HEADERS, END_HEADERS, stream, call(b"ServerReflectionInfo", b"grpc.reflection.v1alpha.ServerReflection")) +
                          frame(DATA, 0, stream, listing))
        self.assertTrue(attacker.waits_for(lambda: len(attacker.answered) == 100))
        self.assertLess(len(os.listdir(folder)) - before, 32)
        self.assertTrue(self.serves())

    def test_a_connection_has_so_many_calls_and_an_address_so_many_connections(self):
        self.serve("--max-connections-per-address", "2", "--max-calls-per-connection", "7")
        first, second, third = self.attack(), self.attack(), self.attack()
        self.assertEqual(first.told(MAX_CONCURRENT_STREAMS), 7)
        self.assertEqual(second.told(MAX_CONCURRENT_STREAMS), 7)
        self.assertTrue(third.is_over.wait(programs.PATIENCE))


class BehindEnvoy(Flooded):
    """As deploy/web ships it: against what Debian's gRPC has no cure for."""

    def serve_behind_envoy(self, *arguments):
        before = self.serve()
        envoy_port = free_port()
        self.envoy = subprocess.Popen([os.path.join(ROOT, "deploy", "web"), "--web", f"127.0.0.1:{envoy_port}", "--server",
                                       self.flooded.address, "--files", "none", "--access-log", "/dev/null", *arguments])
        self.addCleanup(self.envoy.wait)
        self.addCleanup(self.envoy.terminate)
        end = time.monotonic() + programs.PATIENCE
        while not self.serves(envoy_port):
            self.assertLess(time.monotonic(), end, "Envoy does not reach the server")
            time.sleep(0.1)
        return before, envoy_port

    def test_calls_that_are_taken_back_at_once_end_at_envoy(self):
        before, port = self.serve_behind_envoy()
        begun = self.calls("call_started", "ListSessions")
        tried = sum(self.attack(port).reset(20_000) for _ in range(5))
        self.assertTrue(self.serves(port))
        reached = self.calls("call_started", "ListSessions") - begun
        self.assertLess(reached, tried / 2, f"of {tried}")
        self.assertLess(reached, 20_000)
        self.assertLess(self.memory() - before, 64 * MIB)
        self.assertIn('"serving"', self.admin("/livez"))

    def test_messages_that_never_end_stay_at_envoy_which_ends_the_largest_where_they_are_too_many(self):
        before, port = self.serve_behind_envoy("--max-heap", "64")
        envoy_before = self.memory(self.envoy)
        sent, end = 0, time.monotonic() + programs.PATIENCE
        while sent < 512 * MIB:
            self.assertLess(time.monotonic(), end)
            attacker = self.attack(port)
            attacker.told(MAX_CONCURRENT_STREAMS)
            sent += attacker.fill(range(1, 65, 2), 4 * MIB - 5, 1)
        self.assertLess(self.memory() - before, 16 * MIB)
        # Envoy looks at its memory ten times a second, and has what comes between two looks; later, where it waits for a core.
        self.assertLess(self.memory(self.envoy) - envoy_before, 320 * MIB)
        self.assertTrue(self.serves(port))

    def test_compressed_messages_are_not_unpacked(self):
        self.unpacks_nothing(*self.serve_behind_envoy())

    def test_headers_without_end_end_at_envoy(self):
        before, port = self.serve_behind_envoy()
        for _ in range(5):
            attacker = self.attack(port, answers=False)
            self.assertLess(attacker.endless_headers(64 * MIB), 32 * MIB)
            self.assertTrue(attacker.is_over.wait(programs.PATIENCE))
        self.assertTrue(self.serves(port))
        self.assertLess(self.memory() - before, 32 * MIB)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return listening.getsockname()[1]


if __name__ == "__main__":
    programs.main()
