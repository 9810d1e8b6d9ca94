"""Whether a server keeps its size: memory, descriptors and threads while sessions come and go.

    tests/chaos/soak cycles [--count 10000] [--picture FILE.svg]   sessions created, streamed and deleted, four at a time
    tests/chaos/soak load [--minutes 30] [--picture FILE.svg]      sessions under `lpdeform load`, with slow readers and
                                                                   reconnects, a new set every half a minute

Either with --store none, sqlite or redis.

Prints a line for each sample. Exits with 1 if the server or its store holds more at the end than before. For memory and the
store: the median of the last quarter is more than 5 % and 4 MiB above that of the second quarter. For descriptors and sessions:
any increase, once idle. For threads: any increase over the largest number in the second quarter, because gRPC's pool grows with
the first load. Exits with 1 also if a load falls short: an update was not answered, or a call failed.
"""

from __future__ import annotations

import argparse
import os
import pathlib
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

from lpdeform.v1 import service_pb2

from machines import PATIENCE, ROOT, Redis, Server
from picture import draw
from wire import Book, Stream, Wire, create_request, held

CLI = os.environ.get("LPDEFORM_CLI", str(ROOT / "build/release/bin/lpdeform"))
COLUMNS = ("resident MiB", "descriptors", "threads", "sessions", "store MiB")
SIZES = ("resident MiB", "store MiB")


class Soaked(Server):
    """A server with a store of its own."""

    def __init__(self, kind: str, folder: str) -> None:
        self.folder = pathlib.Path(folder) / "store"
        self.redis = Redis(folder) if kind == "redis" else None
        super().__init__({"none": "none", "sqlite": f"sqlite:{self.folder}"}.get(kind) or f"redis://127.0.0.1:{self.redis.port}")

    def store_bytes(self) -> int:
        if self.redis is None:
            return sum(file.stat().st_size for file in self.folder.rglob("*") if file.is_file())
        with socket.create_connection(("127.0.0.1", self.redis.port), PATIENCE) as connection, connection.makefile("rwb") as lines:
            lines.write(b"INFO memory\r\n")
            lines.flush()
            return int(next(line for line in lines if line.startswith(b"used_memory:")).split(b":")[1])

    def kill(self) -> None:
        super().kill()
        if self.redis:
            self.redis.kill()


def sample(server: Soaked) -> dict[str, float]:
    process = pathlib.Path(f"/proc/{server.process.pid}")
    status = dict(line.split(":", 1) for line in (process / "status").read_text().splitlines())
    return {"resident MiB": int(status["VmRSS"].split()[0]) / 1024, "descriptors": len(os.listdir(process / "fd")),
            "threads": int(status["Threads"]), "sessions": server.metrics()["lpdeform_sessions"],
            "store MiB": server.store_bytes() / 2**20}


def idle_sample(server: Soaked) -> dict[str, float]:
    """Once released connections are gone: the smallest of a few seconds."""
    samples = []
    for _ in range(50):
        samples.append(sample(server))
        time.sleep(0.1)
    return {column: min(one[column] for one in samples) for column in COLUMNS}


class Cycles:
    """Creates, streams and deletes."""

    def __init__(self, server: Soaked, count: int) -> None:
        self.server, self.left, self.done, self.faults = server, count, 0, []
        self._lock = threading.Lock()
        self.threads = [threading.Thread(target=self._work, daemon=True) for _ in range(4)]
        for thread in self.threads:
            thread.start()

    @property
    def is_over(self) -> bool:
        return not any(thread.is_alive() for thread in self.threads)

    def _work(self) -> None:
        try:
            with Wire(self.server.port, "soak") as wire:
                while True:
                    with self._lock:
                        if self.left == 0 or self.faults:
                            return
                        self.left -= 1
                    self._cycle(wire)
                    with self._lock:
                        self.done += 1
        except BaseException as error:  # raised where the samples are judged
            self.faults.append(error)

    @staticmethod
    def _cycle(wire: Wire) -> None:
        made = wire.call("CreateSession", create_request(""))
        stream = Stream(Book(), wire, made.session.name, made.writer_token, "soak", credit=2)
        stream.send(service_pb2.Update(input_seq=1, handles=[held("base", 0), held("tip", 1.5)]))
        end = time.monotonic() + PATIENCE
        while not stream.settled.get(1):
            if time.monotonic() > end or stream.is_over.is_set():
                raise TimeoutError("no final frame came")
            time.sleep(0.001)
        stream.end()
        wire.call("DeleteSession", service_pb2.DeleteSessionRequest(session=made.session.name))


def run_cycles(server: Soaked, options) -> list[dict[str, float]]:
    cycles = Cycles(server, options.count)
    samples, begin = [], time.monotonic()
    step = max(1, options.count // 100)
    while not cycles.is_over:
        if cycles.done >= step * len(samples):
            samples.append({"cycles": cycles.done, **sample(server)})
            if len(samples) % 10 == 1:
                show(samples[-1])
        time.sleep(0.01)
    if cycles.faults:
        raise cycles.faults[0]
    samples.append({"cycles": cycles.done, **sample(server)})
    print(f"{cycles.done} cycles in {time.monotonic() - begin:.0f} s")
    return samples


def run_load(server: Soaked, options) -> list[dict[str, float]]:
    samples, begin = [], time.monotonic()
    end = begin + 60 * options.minutes
    turn = min(30.0, max(2.0, 10 * options.minutes))
    words = [CLI, "load", "--server", f"127.0.0.1:{server.port}", "--sessions", "12", "--vertices", "400,1000,10000", "--rate", "5",
             "--seconds", f"{turn:.0f}", "--slow-readers", "3", "--reconnect", "7"]
    while time.monotonic() < end:
        load = subprocess.Popen(words, stdout=subprocess.DEVNULL)  # what it has to complain of, it says
        while load.poll() is None:
            time.sleep(min(5.0, turn / 3))
            samples.append({"seconds": time.monotonic() - begin, **sample(server)})
            if len(samples) % 12 == 1:
                show(samples[-1])
        if load.returncode == 2:
            raise RuntimeError("lpdeform load was not given what it takes")
        samples[-1]["short"] = load.returncode  # 1: an update was not answered, or a call failed
    return samples


def show(one: dict[str, float]) -> None:
    print("  ".join(f"{name} {value:.0f}" for name, value in one.items()), flush=True)


def growth(samples: list[dict[str, float]], before: dict[str, float], after: dict[str, float]) -> list[str]:
    faults = [f"a load fell short at {one['seconds']:.0f} s" for one in samples if one.pop("short", 0)]
    quarter = len(samples) // 4
    early, late = samples[quarter:2 * quarter], samples[-quarter:]
    for size in SIZES:
        median = [statistics.median(one[size] for one in part) for part in (early, late)]
        print(f"{size}: {median[0]:.1f} in the second quarter, {median[1]:.1f} in the last")
        if median[1] > 1.05 * median[0] + 4:
            faults.append(f"{size} grew from {median[0]:.1f} to {median[1]:.1f}")
    print("idle before and after: " + ", ".join(f"{column} {before[column]:.0f} and {after[column]:.0f}" for column in COLUMNS))
    allowed = before | {"threads": max(one["threads"] for one in early)}
    for column in ("descriptors", "threads", "sessions"):
        if after[column] > allowed[column]:
            faults.append(f"{after[column] - allowed[column]:.0f} {column} are left")
    return faults


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("cycles", "load"))
    parser.add_argument("--count", type=int, default=10000)
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--store", choices=("none", "sqlite", "redis"), default="none")
    parser.add_argument("--picture")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        server = Soaked(options.store, folder)
        try:
            run = run_cycles if options.what == "cycles" else run_load
            warm = argparse.Namespace(count=40, minutes=0.05)
            run(server, warm)  # so that threads and connections that stay are there
            before = idle_sample(server)
            samples = run(server, options)
            after = idle_sample(server)
        finally:
            server.kill()
    if options.picture:
        columns = COLUMNS if options.store != "none" else COLUMNS[:-1]
        draw(options.picture, "cycles" if options.what == "cycles" else "seconds", samples, columns)
        print(f"wrote {options.picture}")
    faults = growth(samples, before, after)
    for fault in faults:
        print(f"soak: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
