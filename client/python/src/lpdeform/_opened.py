"""What a session is to its interface, wherever it is: in this process (_local) or on a server (_remote)."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from lpdeform._box import FrameBox
from lpdeform._ledger import Ledger
from lpdeform._numbers import Copied
from lpdeform._solving import SolveOptions
from lpdeform._stop import Stop
from lpdeform.access import Tls, Token
from lpdeform.errors import LpdeformError
from lpdeform.frames import Frame
from lpdeform.types import (
    BetterShape,
    Connection,
    FrameOptions,
    FreeComponents,
    Handle,
    MeshReport,
    Notice,
    Settings,
    SolveResult,
    Update,
    WeightKind,
)


class Opened(Protocol):
    """A session that is open."""

    box: FrameBox
    changed: threading.Condition
    ledger: Ledger
    stop: Stop
    is_closing: bool
    interruption: LpdeformError | None

    @property
    def name(self) -> str: ...
    @property
    def address(self) -> str: ...
    @property
    def vertices(self) -> Copied | None:
        """At rest, if they are known here."""
    @property
    def faces(self) -> Copied | None: ...
    @property
    def report(self) -> MeshReport: ...
    @property
    def connection(self) -> Connection: ...
    @property
    def notice(self) -> Notice | None: ...
    def update(self, update: Update) -> int: ...
    def take(self) -> Frame | None: ...
    def take_result(self) -> Frame | None: ...
    def no_frame(self) -> LpdeformError: ...
    def solve(self, options: SolveOptions, stop: Stop) -> SolveResult: ...
    def undo(self, redo: bool, stop: Stop) -> int: ...
    def take_better_shape(self, stop: Stop) -> BetterShape: ...
    def snapshot(self, stop: Stop) -> bytes: ...
    def take_over(self) -> None: ...
    def close(self) -> None: ...


@dataclass(frozen=True, eq=False)
class Given:
    """What a session is made of, checked."""

    vertices: Copied
    faces: Copied
    normals: Copied | None
    weld: Copied | float | None
    """One number per vertex, or the tolerance of a weld by position."""
    weights: WeightKind
    free_components: FreeComponents
    settings: Settings


@dataclass(frozen=True)
class Reaching:
    """How to reach a server."""

    address: str | None = None
    token: Token = None
    tls: Tls | bool = False
    call_timeout: float = 30.0
    reconnect_for: float = 120.0


class Connecting(Protocol):
    """Where sessions are opened."""

    def open(
        self, given: Given, handles: Mapping[str, Handle] | None, options: FrameOptions, stop: Stop, is_live: bool = True
    ) -> Opened:
        """`is_live`: frames are wanted, and not only solve()."""
    def join(self, name: str, as_writer: bool, options: FrameOptions, stop: Stop) -> Opened: ...
    def restore(self, snapshot: bytes, options: FrameOptions, stop: Stop) -> Opened: ...
