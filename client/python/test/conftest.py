"""The places where sessions are, which is this process or a real server, and shapes to deform."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

import lpdeform

ROOT = Path(__file__).resolve().parents[3]
PROGRAM = os.environ.get("LPDEFORM_SERVER", str(ROOT / "build/release/bin/lpdeform-server"))
PATIENCE = 60.0  # a time limit in seconds, never reached if all is well


def settle_all(session: lpdeform.Session) -> None:
    """Waits until every update is answered: the frame may come before the answer to its update."""
    session.settle(PATIENCE)
    link = session._link
    with link.changed:
        assert link.changed.wait_for(lambda: not link.ledger.has_in_flight, PATIENCE)


class Server:
    """lpdeform-server on a free port of this machine; it keeps the port when it is restarted."""

    def __init__(self, *flags: str) -> None:
        self.address = "127.0.0.1:0"
        self._flags = flags
        self.start()

    def start(self) -> None:
        command = [PROGRAM, "--address", self.address, "--log-level", "off", *self._flags]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        self.address = self._process.stdout.readline().split()[-1]

    def kill(self) -> None:
        """Kills the server without notice."""
        self._end(signal.SIGKILL)

    def stop(self) -> None:
        """Drains the server."""
        self._end(signal.SIGTERM)

    def _end(self, how: signal.Signals) -> None:
        self._process.send_signal(how)
        self._process.wait(PATIENCE)
        assert self._process.stdout is not None
        self._process.stdout.close()


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    running = Server("--heartbeat", "2")
    yield running
    if running._process.poll() is None:
        running.stop()


class Place(NamedTuple):
    """Where sessions are opened."""

    address: str | None
    """None: in this process."""


@pytest.fixture(params=["here", "on_a_server"], scope="module")
def place(request: pytest.FixtureRequest) -> Place:
    if request.param == "here":
        return Place(None)
    server: Server = request.getfixturevalue("server")
    return Place(server.address)


@pytest.fixture(autouse=True)
def no_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("LPDEFORM_ADDRESS", raising=False)


class Grid(NamedTuple):
    """A flat square of side x side vertices, one unit apart, in the plane z = 0."""

    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int64]
    left: npt.NDArray[np.bool_]
    right: npt.NDArray[np.bool_]


def grid(side: int) -> Grid:
    y, x = np.mgrid[0:side, 0:side]
    vertices = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3).astype(float)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1)
    lower = np.stack([corner, corner + 1, corner + side], axis=1)
    upper = np.stack([corner + 1, corner + side + 1, corner + side], axis=1)
    edges = vertices[:, 0]
    return Grid(vertices, np.concatenate([lower, upper]), edges < 0.5, edges > side - 1.5)


@pytest.fixture
def make_grid() -> Callable[[int], Grid]:
    return grid


@pytest.fixture
def shape(make_grid: Callable[[int], Grid]) -> Grid:
    return make_grid(12)


@pytest.fixture
def session(place: Place, shape: Grid) -> Iterator[lpdeform.Session]:
    with lpdeform.open(shape.vertices, shape.faces, address=place.address) as made:
        made.set_handle("left", shape.left)
        made.set_handle("right", shape.right)
        yield made


@pytest.fixture
def remote_session(server: Server, shape: Grid) -> Iterator[lpdeform.Session]:
    with lpdeform.open(shape.vertices, shape.faces, address=server.address) as made:
        made.set_handle("left", shape.left)
        made.set_handle("right", shape.right)
        yield made
