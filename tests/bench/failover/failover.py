"""How long a drag stands still when the server that has its session is killed.

    failover.py ADDRESS PROCESS      of Envoy, and of a running deploy/up --replicas N

For each size a flat square is bent through Envoy. Each server is killed once in the middle of moves, and the time from there to
the finished result of the next move is taken. The longest time is that of the server that had the session. The session stays the
same.
"""

import os
import signal
import subprocess
import sys
import time

import numpy as np

import lpdeform

SIDES = (32, 100, 316)


def servers(process):
    found = subprocess.run(["pgrep", "-P", process, "lpdeform-server"], capture_output=True, text=True)
    return [int(pid) for pid in found.stdout.split()]


def square(side):
    """side x side vertices, one unit apart."""
    x, y = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    number = np.arange(side * side).reshape(side, side)
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    vertices = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1).astype(float)
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def seconds_of_move(session, height):
    begin = time.monotonic()
    session.move("tip", translation=[0, 0, height])
    return time.monotonic() - begin


def measure(side, address, process):
    vertices, faces = square(side)
    with lpdeform.open(vertices, faces, address=address) as session:
        session.set_handle("base", vertices[:, 0] < 0.5)
        session.set_handle("tip", vertices[:, 0] > side - 1.5)
        seconds_of_move(session, 0.1 * side)
        name, moves, kills = session.name, [], []
        for k, victim in enumerate(servers(process)):
            moves += [seconds_of_move(session, (0.11 + 0.0005 * step) * side) for step in range(10)]
            count = len(servers(process))
            os.kill(victim, signal.SIGKILL)
            kills.append(seconds_of_move(session, (0.12 + 0.01 * k) * side))
            assert session.name == name, "the session was lost"
            while len(servers(process)) < count or victim in servers(process):
                time.sleep(0.1)
            time.sleep(3)  # deploy/up gives up on a server that dies at once
    print(f"{side * side} vertices: a move {np.median(moves):.2f} s, the longest after kill -9 {max(kills):.2f} s", flush=True)


for side in SIDES:
    measure(side, sys.argv[1], sys.argv[2])
