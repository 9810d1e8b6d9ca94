"""Drags bars of several sizes at a server and says where the time goes; see run."""

from __future__ import annotations

import argparse
import contextlib
import json
import pathlib
import re
import socket
import statistics
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator

SPANS = {"taken": "lpdeform_input_to_solve_seconds", "shown": "lpdeform_input_to_frame_seconds",
         "sent": "lpdeform_frame_to_stream_seconds", "encoded": "lpdeform_frame_encode_seconds",
         "written": "lpdeform_frame_write_seconds"}
ROUNDS = 3


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@contextlib.contextmanager
def served(program: pathlib.Path) -> Iterator[tuple[int, int]]:
    port, admin = free_port(), free_port()
    command = [str(program), "--address", f"127.0.0.1:{port}", "--admin-address", f"127.0.0.1:{admin}"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as server:
        try:
            while True:
                if server.poll() is not None:
                    sys.exit(f"{program} ended at once with status {server.returncode}")
                with contextlib.suppress(OSError):
                    urllib.request.urlopen(f"http://127.0.0.1:{admin}/healthz", timeout=1).read()
                    break
                time.sleep(0.05)
            yield port, admin
        finally:
            server.terminate()


def spans(admin: int) -> dict[str, tuple[float, float]]:
    """The sum and count of each span."""
    text = urllib.request.urlopen(f"http://127.0.0.1:{admin}/metrics", timeout=5).read().decode()

    def value(name: str) -> float:
        found = re.search(rf"^{name} (\S+)$", text, re.MULTILINE)
        return float(found[1]) if found else 0.0

    return {key: (value(name + "_sum"), value(name + "_count")) for key, name in SPANS.items()}


def drag(server: pathlib.Path, client: pathlib.Path, vertices: int, options: argparse.Namespace) -> dict[str, float]:
    with served(server) as (port, admin):
        command = [str(client), f"127.0.0.1:{port}", "float32", str(options.seconds), str(vertices), str(options.p), "30",
                   str(options.frames)]
        before = spans(admin)
        row = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        after = spans(admin)
    for key in SPANS:
        total, count = (after[key][k] - before[key][k] for k in (0, 1))
        row[key] = 1e3 * total / count if count else float("nan")
    return row


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=pathlib.Path, required=True)
    parser.add_argument("--sizes", default="1000,10000,40000,100000")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--p", type=float, default=2)
    parser.add_argument("--frames", type=float, default=60)
    parser.add_argument("--beside", type=pathlib.Path)
    options = parser.parse_args()
    servers = {"this": options.programs / "lpdeform-server"} | ({"beside": options.beside} if options.beside else {})
    print("| vertices | server | median | p99 | until the solver has it | from there until a frame is there | wait for its stream | "
          "encoding | until gRPC takes the next message | the rest: sockets, client |\n|--:|:--|--:|--:|--:|--:|--:|--:|--:|--:|")
    for size in map(int, options.sizes.split(",")):
        rows: dict[str, list[dict[str, float]]] = {name: [] for name in servers}
        for _ in range(ROUNDS):
            for name, server in servers.items():
                rows[name].append(drag(server, options.programs / "native_drag", size, options))
        for name, runs in rows.items():
            at = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
            cells = [f"{at['vertices']:.0f}", name] + [f"{value:.2f} ms" for value in (
                at["p50"], at["p99"], at["taken"], at["shown"] - at["taken"], at["sent"], at["encoded"], at["written"],
                at["mean"] - at["shown"] - at["sent"] - at["encoded"])]
            print("| " + " | ".join(cells) + " |", flush=True)
    print("\nFrom a move to the frame that answers it, at the client: the median of three runs. The parts are means; those "
          "after the frame is there are of one message of any frame, and the rest of the way goes on while gRPC writes.")


if __name__ == "__main__":
    main()
