"""The asyncio interface; each test runs its own loop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import numpy as np
import pytest

import lpdeform
from conftest import PATIENCE, Grid, Place

MakeGrid = Callable[[int], Grid]


def handles(shape: Grid) -> dict[str, lpdeform.Handle]:
    return {"left": lpdeform.Handle(shape.left), "right": lpdeform.Handle(shape.right)}


def test_sessions_are_awaited(place: Place, make_grid: MakeGrid) -> None:
    shape = make_grid(12)

    async def run() -> None:
        async with lpdeform.open_async(
            shape.vertices, shape.faces, address=place.address, handles=handles(shape)
        ) as session:
            frame = await session.move("right", translation=[0, 0, 3])
            assert frame.positions[11, 2] == 3
            told: list[lpdeform.SolveProgress] = []
            result = await session.solve(certify=True, on_progress=told.append)
            assert result.energy == pytest.approx(frame.energy, rel=1e-6)
            async with lpdeform.join_async(session.name, address=place.address) as reader:
                async for seen in reader:
                    if seen.is_final:
                        break
                await reader.take_over()
            assert "144 vertices" in repr(session)
        with pytest.raises(lpdeform.LpdeformError) as caught:
            await session.settle()
        assert caught.value.reason == "SESSION_CLOSED"

    asyncio.run(run())


def test_a_split_mesh_is_warned_of(place: Place, make_grid: MakeGrid) -> None:
    shape = make_grid(4)
    corners = shape.vertices[shape.faces].reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)

    async def run() -> None:
        with pytest.warns(lpdeform.SplitMeshWarning, match="weld=True") as warned:
            async with lpdeform.open_async(corners, faces, address=place.address):
                pass
            await (await lpdeform.open_async(corners, faces, address=place.address)).close()
        assert [warning.filename for warning in warned] == [__file__, __file__]
        with pytest.raises(lpdeform.SplitMeshWarning):  # an error by the filter of these tests
            await lpdeform.open_async(corners, faces, address=place.address)
        async with lpdeform.open_async(corners, faces, address=place.address, weld=True):
            pass

    asyncio.run(run())


def test_the_loop_goes_on_while_a_result_is_waited_for(place: Place, make_grid: MakeGrid) -> None:
    shape = make_grid(60)

    async def run() -> None:
        session = await lpdeform.open_async(shape.vertices, shape.faces, address=place.address, p=1.0)
        session.set_handles(handles(shape))
        moving = asyncio.create_task(session.move("right", axis=[1, 0, 0], angle=2.0))
        turns = 0
        while not moving.done():
            await asyncio.sleep(0)
            turns += 1
        assert (await moving).is_final
        assert turns > 10
        await session.close()

    asyncio.run(run())


def test_many_sessions_in_one_loop(place: Place, make_grid: MakeGrid) -> None:
    shape = make_grid(8)

    async def one(height: float) -> float:
        async with lpdeform.open_async(shape.vertices, shape.faces, address=place.address) as session:
            session.set_handles(handles(shape))
            frame = await session.move("right", translation=[0, 0, height])
            return float(frame.positions[7, 2])

    async def run() -> None:
        assert await asyncio.gather(*(one(k) for k in range(6))) == [0, 1, 2, 3, 4, 5]

    asyncio.run(run())


def test_errors_and_time_limits_are_raised(place: Place, make_grid: MakeGrid) -> None:
    shape = make_grid(8)

    async def run() -> None:
        with pytest.raises(lpdeform.Unavailable):
            await lpdeform.open_async(shape.vertices, shape.faces, address="127.0.0.1:1")
        async with lpdeform.open_async(shape.vertices, shape.faces, address=place.address) as session:
            session.set_handle("bad", [64])
            with pytest.raises(lpdeform.InvalidInput, match="HANDLE_VERTEX_OUT_OF_RANGE"):
                await session.settle(PATIENCE)
            session.set_handles(handles(shape))
            await session.settle(PATIENCE)
            with pytest.raises(lpdeform.Timeout):
                await session.next_frame(0.05)

    asyncio.run(run())


def test_cancelling_ends_a_solve_and_leaves_the_session(place: Place, make_grid: MakeGrid) -> None:
    shape = make_grid(60)

    async def run() -> None:
        async with lpdeform.open_async(shape.vertices, shape.faces, address=place.address, p=1.0) as session:
            session.set_handles(handles(shape))
            session.set(solver=lpdeform.SolverSettings(initial="rest", tolerance=1e-14, max_iterations=10**6))
            session.drag("right", axis=[1, 0, 0], angle=2.5)
            under_way = asyncio.Event()
            solving = asyncio.create_task(session.solve(on_progress=lambda _: under_way.set()))
            await asyncio.wait_for(under_way.wait(), PATIENCE)
            solving.cancel()
            with pytest.raises(asyncio.CancelledError):
                await solving
            session.set(solver=lpdeform.SolverSettings(), p=2)
            assert (await session.move("right", translation=[0, 0, 1])).is_final

    asyncio.run(run())
