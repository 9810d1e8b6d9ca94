"""What chaos.py breaks: the programs it runs, and the network between its clients and them."""

from __future__ import annotations

import os
import pathlib
import random
import signal
import socket
import subprocess
import threading
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
SERVER = os.environ.get("LPDEFORM_SERVER", str(ROOT / "build/release/bin/lpdeform-server"))
PATIENCE = 60.0  # seconds that anything may take; never reached where all is well
LONGEST_END = 30.0  # of a server after SIGTERM: its --grace of 2 s, 5 s for the store, and much more where others use the machine


def free_port() -> int:
    """Below those that the system gives to connections: one of these could take it while its server is down."""
    while True:
        port = random.SystemRandom().randrange(10000, 32000)
        with socket.socket() as taken:
            try:
                taken.bind(("127.0.0.1", port))
            except OSError:
                continue
        return port


def reaches(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), 1).close()
    except OSError:
        return False
    return True


def wait_for(port: int) -> None:
    end = time.monotonic() + PATIENCE
    while not reaches(port):
        if time.monotonic() > end:
            raise TimeoutError(f"nobody listens on port {port}")
        time.sleep(0.005)  # nothing tells when it does


class Process:
    """A program that can be killed, paused and started again with the same words."""

    def __init__(self, words: list[str], port: int) -> None:
        self.words, self.port = words, port
        self.process: subprocess.Popen | None = None
        self.start()

    def start(self) -> None:
        quiet = subprocess.DEVNULL
        environment = {name: value for name, value in os.environ.items() if not name.startswith("LPDEFORM_")}
        self.process = subprocess.Popen(self.words, stdout=quiet, stderr=quiet, env=environment)
        wait_for(self.port)

    def signal(self, number: int) -> None:
        self.process.send_signal(number)

    def kill(self) -> None:
        self.signal(signal.SIGCONT)
        self.process.kill()
        self.process.wait()

    def stop(self) -> None:
        """As an operator does."""
        self.signal(signal.SIGTERM)
        try:
            self.process.wait(LONGEST_END)
        except subprocess.TimeoutExpired as error:
            raise TimeoutError(f"{self.words[0]} did not end within {LONGEST_END:.0f} s of SIGTERM") from error

    def pause(self) -> None:
        self.signal(signal.SIGSTOP)

    def resume(self) -> None:
        self.signal(signal.SIGCONT)


class Server(Process):
    """Sessions expire after 20 s. A server keeps its stale copy of a session that another server took over for as long."""

    def __init__(self, store: str) -> None:
        self.admin = free_port()
        port = free_port()
        super().__init__([SERVER, "--address", f"127.0.0.1:{port}", "--admin-address", f"127.0.0.1:{self.admin}", "--store", store,
                          "--heartbeat", "0.5", "--grace", "2", "--log-level", "off", "--session-idle", "20"], port)

    def start(self) -> None:
        super().start()
        wait_for(self.admin)  # begins to listen last

    def metrics(self) -> dict[str, float]:
        with urllib.request.urlopen(f"http://127.0.0.1:{self.admin}/metrics", timeout=PATIENCE) as answer:
            lines = answer.read().decode().splitlines()
        return {name: float(value) for name, value in (line.rsplit(" ", 1) for line in lines if line and line[0] != "#")}


class Redis(Process):
    def __init__(self, folder: str) -> None:
        port = free_port()
        super().__init__(["redis-server", "--port", str(port), "--bind", "127.0.0.1", "--dir", folder, "--save", "", "--appendonly",
                          "yes", "--appendfsync", "always", "--logfile", "redis.log"], port)


class Envoy(Process):
    def __init__(self, servers: list[Server]) -> None:
        port = free_port()
        addresses = ",".join(f"127.0.0.1:{server.port}" for server in servers)
        super().__init__([str(ROOT / "deploy/web"), "--web", f"127.0.0.1:{port}", "--server", addresses, "--files", "none",
                          "--access-log", "/dev/null"], port)


class Proxy:
    """Passes connections on to a port, and can cut them all."""

    def __init__(self, target: int) -> None:
        self.target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._lock = threading.Lock()
        self._ends: set[socket.socket] = set()
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        with self._lock:
            ends, self._ends = self._ends, set()
        for end in ends:
            self._close(end)

    def close(self) -> None:
        self._close(self._listener)
        self.cut()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            try:
                server = socket.create_connection(("127.0.0.1", self.target), PATIENCE)
            except OSError:
                client.close()
                continue
            server.settimeout(None)
            for end in (client, server):
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with self._lock:
                self._ends |= {client, server}
            for pair in ((client, server), (server, client)):
                threading.Thread(target=self._pass, args=pair, daemon=True).start()

    def _pass(self, source: socket.socket, target: socket.socket) -> None:
        try:
            while data := source.recv(1 << 16):
                target.sendall(data)
        except OSError:
            pass
        with self._lock:
            self._ends -= {source, target}
        self._close(source)
        self._close(target)

    @staticmethod
    def _close(end: socket.socket) -> None:
        try:
            end.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        end.close()


class World:
    """The machines of a run."""

    def __init__(self, mode: str, folder: str) -> None:
        self.redis = Redis(folder) if mode == "redis" else None
        store = f"redis://127.0.0.1:{self.redis.port}" if self.redis else f"sqlite:{folder}/store"
        self.servers = [Server(store) for _ in range(2 if self.redis else 1)]
        self.envoy = Envoy(self.servers) if self.redis else None
        self.proxy = Proxy(self.envoy.port if self.envoy else self.servers[0].port)

    def processes(self):
        return [*self.servers, *filter(None, (self.envoy, self.redis))]

    def faults(self) -> list[str]:
        return ["kill", "kill", "pause", "drop"] + (["slow_store", "store", "envoy", "drain"] if self.redis else [])

    def strike(self, what: str, chance: random.Random) -> None:
        server = chance.choice(self.servers)
        if what == "kill":
            server.kill()
            server.start()
        elif what == "pause":  # longer than a lease lasts, at times
            self._pause(server, chance.uniform(0.05, 1.4))
        elif what == "drop":
            self.proxy.cut()
        elif what == "slow_store":
            self._pause(self.redis, chance.uniform(0.1, 0.8))
        elif what == "drain":  # while the store hangs, at times
            if chance.random() < 0.5:
                self.redis.pause()
            server.stop()
            self.redis.resume()
            server.start()
        elif what == "store":
            self.redis.kill()
            time.sleep(chance.uniform(0, 1.4))
            self.redis.start()
        elif what == "envoy":
            self.envoy.kill()
            self.envoy.start()

    @staticmethod
    def _pause(process, seconds: float) -> None:
        process.pause()
        time.sleep(seconds)
        process.resume()

    def level(self) -> dict[str, float]:
        """What all servers together hold."""
        sums = {"resident": 0.0, "sessions": 0.0, "streams": 0.0, "counted": 0.0}
        for server in self.servers:
            metrics = server.metrics()
            for name, metric in (("resident", "process_resident_memory_bytes"), ("sessions", "lpdeform_sessions"),
                                 ("streams", "lpdeform_streams"), ("counted", "lpdeform_memory_bytes")):
                sums[name] += metrics[metric]
        return sums

    def close(self) -> None:
        self.proxy.close()
        for process in self.processes():
            process.kill()
