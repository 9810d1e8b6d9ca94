"""The same sessions for asyncio: everything that waits is awaitable. They work in any event loop; cancelling ends the call."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Generator, Mapping
from types import TracebackType
from typing import Any, TypeVar

import numpy.typing as npt

from lpdeform._groups import handles_of
from lpdeform._meshes import mesh_arrays
from lpdeform._opened import Opened
from lpdeform._progress import told_by
from lpdeform._stop import Stop
from lpdeform.access import Tls, Token
from lpdeform.errors import LpdeformError, SplitMeshWarning
from lpdeform.frames import Frame
from lpdeform.opening import checked_mesh, frame_options, reach, warn_of_splits, weld_of
from lpdeform.session import Live, deadline_after
from lpdeform.types import (
    BetterShape,
    Encoding,
    Field,
    FreeComponents,
    Handle,
    Mesh,
    Motion,
    Settings,
    SolveProgress,
    SolveResult,
    SolverSettings,
    Triangles,
    Vector3,
    WeightKind,
)

T = TypeVar("T")


async def _in_a_thread(work: Callable[[Stop], T]) -> T:
    """Runs `work` on another thread; cancelling ends its calls."""
    stop = Stop()
    try:
        return await asyncio.to_thread(work, stop)
    except asyncio.CancelledError:
        stop.set()
        raise


class AsyncSession(Live):
    """Like Session. `async for frame in session` gives frames as they come, the newest first."""

    async def move(
        self,
        name: str,
        motion: Motion | None = None,
        *,
        translation: Vector3 | None = None,
        axis: Vector3 | None = None,
        angle: float | None = None,
        center: Vector3 | None = None,
        targets: npt.ArrayLike | None = None,
        timeout: float = 60.0,
    ) -> Frame:
        """Like Session.move()."""
        deadline_after(timeout)
        self.drag(name, motion, translation=translation, axis=axis, angle=angle, center=center, targets=targets)
        return await self.settle(timeout)

    async def next_frame(self, timeout: float = 60.0) -> Frame:
        """Like Session.next_frame()."""
        return await self._wait_for(self._link.take, deadline_after(timeout))

    async def settle(self, timeout: float = 60.0) -> Frame:
        """Like Session.settle()."""
        return await self._wait_for(self._link.take_result, deadline_after(timeout))

    async def _wait_for(self, ask: Callable[[], Frame | None], deadline: float) -> Frame:
        loop, news = asyncio.get_running_loop(), asyncio.Event()

        def tell() -> None:
            loop.call_soon_threadsafe(news.set)

        self._link.box.listen(tell)
        try:
            while True:
                news.clear()
                frame = ask()
                if frame is not None:
                    return frame
                try:
                    await asyncio.wait_for(news.wait(), deadline - time.monotonic())
                except asyncio.TimeoutError:
                    raise self._link.no_frame() from None
        finally:
            self._link.box.forget(tell)

    async def __aiter__(self) -> AsyncIterator[Frame]:
        while not self._link.is_closing:
            try:
                yield await self._wait_for(self._link.take, time.monotonic() + 3600)
            except LpdeformError as error:
                if error.reason == "SESSION_CLOSED":
                    return
                if error.reason != "NO_FRAME":
                    raise

    async def solve(
        self,
        *,
        certify: bool = False,
        trace: bool = False,
        with_normals: bool = False,
        initial_positions: npt.ArrayLike | None = None,
        on_progress: Callable[[SolveProgress], None] | None = None,
        progress: bool | Callable[[SolveProgress], None] | None = None,
        timeout: float | None = None,
    ) -> SolveResult:
        """Like Session.solve(); functions are called in the event loop."""
        loop = asyncio.get_running_loop()
        with told_by(progress if progress is not None else on_progress) as told:

            def report(newest: SolveProgress) -> None:
                if told is not None:
                    loop.call_soon_threadsafe(told, newest)

            told_here = None if told is None else report
            options = self._solve_options(certify, trace, with_normals, initial_positions, told_here, timeout)
            return await _in_a_thread(lambda stop: self._link.solve(options, stop))

    async def undo(self) -> int:
        """Like Session.undo()."""
        return await _in_a_thread(lambda stop: self._link.undo(False, stop))

    async def redo(self) -> int:
        """Like Session.redo()."""
        return await _in_a_thread(lambda stop: self._link.undo(True, stop))

    async def take_better_shape(self) -> BetterShape:
        """Like Session.take_better_shape()."""
        return await _in_a_thread(self._link.take_better_shape)

    async def snapshot(self) -> bytes:
        """Like Session.snapshot()."""
        return await _in_a_thread(self._link.snapshot)

    async def take_over(self) -> None:
        """Like Session.take_over()."""
        await asyncio.to_thread(self._link.take_over)

    async def close(self) -> None:
        """Like Session.close()."""
        await asyncio.to_thread(self._link.close)

    async def __aenter__(self) -> AsyncSession:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        await self.close()

    def __repr__(self) -> str:
        return f"<AsyncSession at {self.address}: {self.mesh_report.vertices} vertices, {self.connection}>"


class Opening:
    """A session that is being opened: `session = await opening`, or `async with opening as session`."""

    def __init__(self, make: Callable[[Stop], Opened], warns: bool = False) -> None:
        self._make = make
        self._warns = warns
        self._session: AsyncSession | None = None

    async def _open(self, stacklevel: int) -> AsyncSession:
        opened = await _in_a_thread(self._make)
        try:
            if self._warns:
                warn_of_splits(opened.report, stacklevel)
        except SplitMeshWarning:  # warnings are errors
            await asyncio.to_thread(opened.close)
            raise
        return AsyncSession(opened)

    def __await__(self) -> Generator[Any, None, AsyncSession]:
        return self._open(stacklevel=2).__await__()

    async def __aenter__(self) -> AsyncSession:
        self._session = await self._open(stacklevel=3)
        return self._session

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._session is not None:
            await self._session.close()


def open_async(
    vertices: Mesh,
    faces: Triangles | None = None,
    *,
    address: str | None = None,
    token: Token = None,
    tls: Tls | bool = False,
    handles: Mapping[str, Handle] | None = None,
    p: Field | None = None,
    stiffness: Field | None = None,
    length_unit: float | None = None,
    solver: SolverSettings | None = None,
    region: npt.ArrayLike | None = None,
    normals: npt.ArrayLike | None = None,
    weights: WeightKind = "cotangent",
    free_components: FreeComponents = "error",
    weld: npt.ArrayLike | float | bool | None = None,
    encoding: Encoding = "float32",
    lowest_encoding: Encoding | None = None,
    credit: int = 0,
    with_distortion: bool = True,
    with_normals: bool = False,
    certify: bool = False,
    max_frames_per_second: float = 0.0,
    call_timeout: float = 30.0,
    reconnect_for: float = 120.0,
) -> Opening:
    """Like open(): `async with lpdeform.open_async(vertices, faces) as session`."""
    options = frame_options(
        encoding, lowest_encoding, credit, with_distortion, with_normals, max_frames_per_second, certify
    )
    settings = Settings(p, stiffness, length_unit, solver, region)

    def make(stop: Stop) -> Opened:
        place = reach(address, token, tls, call_timeout, reconnect_for)
        points, triangles = mesh_arrays(vertices, faces)
        given = checked_mesh(points, triangles, normals, settings, weights, free_components, weld_of(weld, vertices))
        return place.open(given, handles_of(handles or {}, given.vertices), options, stop)

    return Opening(make, warns=True)


def join_async(
    name: str,
    *,
    as_writer: bool = False,
    address: str | None = None,
    token: Token = None,
    tls: Tls | bool = False,
    encoding: Encoding = "float32",
    lowest_encoding: Encoding | None = None,
    credit: int = 0,
    with_distortion: bool = True,
    with_normals: bool = False,
    certify: bool = False,
    max_frames_per_second: float = 0.0,
    call_timeout: float = 30.0,
    reconnect_for: float = 120.0,
) -> Opening:
    """Like join()."""
    options = frame_options(
        encoding, lowest_encoding, credit, with_distortion, with_normals, max_frames_per_second, certify
    )
    return Opening(
        lambda stop: reach(address, token, tls, call_timeout, reconnect_for).join(name, as_writer, options, stop)
    )


def restore_async(
    snapshot: bytes,
    *,
    address: str | None = None,
    token: Token = None,
    tls: Tls | bool = False,
    encoding: Encoding = "float32",
    lowest_encoding: Encoding | None = None,
    credit: int = 0,
    with_distortion: bool = True,
    with_normals: bool = False,
    certify: bool = False,
    max_frames_per_second: float = 0.0,
    call_timeout: float = 30.0,
    reconnect_for: float = 120.0,
) -> Opening:
    """Like restore()."""
    options = frame_options(
        encoding, lowest_encoding, credit, with_distortion, with_normals, max_frames_per_second, certify
    )
    return Opening(
        lambda stop: reach(address, token, tls, call_timeout, reconnect_for).restore(snapshot, options, stop)
    )
