"""The finished result of the newest update, by whichever call it was taken."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Iterator

import pytest

import lpdeform
from conftest import PATIENCE, Grid, Place, Server

MakeGrid = Callable[[int], Grid]


@pytest.fixture
def session(place: Place, make_grid: MakeGrid) -> Iterator[lpdeform.Session]:
    shape = make_grid(10)
    handles = {"left": lpdeform.Handle(shape.left), "right": lpdeform.Handle(shape.right)}
    with lpdeform.open(shape.vertices, shape.faces, address=place.address, handles=handles, p=2) as made:
        yield made


def test_a_result_that_was_polled_is_returned_at_once(session: lpdeform.Session) -> None:
    for height in range(10):
        number = session.drag("right", translation=[0, 0, height])
        frame = None
        while frame is None or not frame.is_final or frame.input_seq < number:
            frame = session.poll()
        assert session.settle(0) is frame


def test_it_stays_while_the_server_is_away(remote_session: lpdeform.Session, server: Server) -> None:
    session = remote_session
    frame = session.move("right", translation=[0, 0, 1])
    server.kill()
    assert session.settle(0) is frame
    server.start()
    assert session.next_frame(PATIENCE) is not frame


def test_an_undo_asks_for_another_one(session: lpdeform.Session) -> None:
    session.move("right", translation=[0, 0, 1])
    number = session.undo()
    assert session.settle(PATIENCE).input_seq == number
    assert session.settle(0).input_seq == number


def test_what_was_refused_leaves_the_result_before_it(session: lpdeform.Session) -> None:
    frame = session.move("right", translation=[0, 0, 1])
    session.set_handle("beyond", [10**6])
    with pytest.raises(lpdeform.InvalidInput):
        session.settle(PATIENCE)
    assert session.settle(0) is frame


def test_a_refusal_that_comes_while_it_looks_is_raised_first(
    session: lpdeform.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    session.move("right", translation=[0, 0, 1])
    number = session.set_handle("beyond", [10**6])
    link = session._link
    look = link.is_result

    def look_after_the_refusal(frame: lpdeform.Frame) -> bool:
        deadline = time.monotonic() + PATIENCE
        while link.ledger.newest >= number:
            assert time.monotonic() < deadline
            time.sleep(0.001)
        return look(frame)

    monkeypatch.setattr(link, "is_result", look_after_the_refusal)
    with pytest.raises(lpdeform.InvalidInput, match="HANDLE_VERTEX_OUT_OF_RANGE"):
        session.settle(PATIENCE)


def test_every_thread_that_waits_gets_it(session: lpdeform.Session) -> None:
    session.settle(PATIENCE)
    number = session.drag("right", translation=[0, 0, 2])
    results: list[lpdeform.Frame] = []
    threads = [threading.Thread(target=lambda: results.append(session.settle(PATIENCE))) for _ in range(4)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert [one.input_seq for one in results] == 4 * [number]


def test_every_task_that_waits_gets_it(place: Place, make_grid: MakeGrid) -> None:
    shape = make_grid(10)

    async def settled() -> list[lpdeform.Frame]:
        handles = {"left": lpdeform.Handle(shape.left)}
        async with lpdeform.open_async(shape.vertices, shape.faces, address=place.address, handles=handles) as session:
            frames = list(await asyncio.gather(*(session.settle(PATIENCE) for _ in range(4))))
            return [*frames, await session.settle(0)]

    frames = asyncio.run(settled())
    assert [one.input_seq for one in frames] == 5 * [frames[0].input_seq]


def test_a_new_writer_waits_for_a_frame_that_knows_of_the_other_one(
    session: lpdeform.Session, place: Place
) -> None:
    session.move("right", translation=[0, 0, 1])
    with lpdeform.join(session.name, address=place.address, as_writer=True) as other:
        theirs = other.move("right", translation=[0, 0, 3])
    session.take_over()
    assert session.settle(PATIENCE).positions[9, 2] == theirs.positions[9, 2]
