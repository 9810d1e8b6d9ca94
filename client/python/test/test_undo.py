"""Undo and redo on the server, and sessions as files."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import numpy as np
import pytest

import lpdeform
from conftest import PATIENCE, Grid, Place, Server, settle_all
from lpdeform.v1 import service_pb2


def refused(call: object) -> str:
    with pytest.raises(lpdeform.LpdeformError) as caught:
        call()  # type: ignore[operator]
    return caught.value.reason


def test_a_step_is_taken_back_and_done_again(session: lpdeform.Session, shape: Grid) -> None:
    session.settle(PATIENCE)
    number = session.update({"right": lpdeform.RigidMotion(translation=(0, 0, 2))}, begins_step=True)
    assert session.undo() == number + 1
    back = session.settle(PATIENCE).positions[:, 2]
    assert back[11] == 0
    assert np.abs(back).max() < 1e-6
    assert session.redo() == number + 2
    assert session.settle(PATIENCE).positions[11, 2] == 2
    assert refused(session.redo) == "NOTHING_TO_REDO"
    assert session.move("right", translation=[0, 0, 3]).positions[11, 2] == 3  # numbers go on


def test_a_drag_is_one_step_and_begins_step_begins_another(session: lpdeform.Session) -> None:
    session.settle(PATIENCE)
    session.drag("right", translation=[0, 0, 1])
    session.move("right", translation=[0, 0, 2])
    session.update({"right": lpdeform.RigidMotion(translation=(0, 0, 3))}, begins_step=True)
    session.drag("right", translation=[0, 0, 4])
    assert session.settle(PATIENCE).positions[11, 2] == 4
    session.undo()
    assert session.settle(PATIENCE).positions[11, 2] == 2


def test_every_kind_of_handle_comes_back_and_is_there_after_kill_9(remote_session: lpdeform.Session, server: Server) -> None:
    session = remote_session
    lift = lpdeform.RigidMotion(axis=(0, 0, 1), angle=0.25, center=(1, 2, 0), translation=(0, 0, 2))
    kept = {
        "soft": lpdeform.Handle([50], lift, lpdeform.Soft(0.5), footprint=1.5),
        "turned": lpdeform.Handle([52], lpdeform.RigidMotion(axis=(0, 1, 0), angle=0.5), lpdeform.Orientation(50)),
        "axis": lpdeform.Handle([54], lift, lpdeform.AxisLock((1, 0, 0))),
        "plane": lpdeform.Handle([90], lift, lpdeform.PlaneLock((0, 1, 0))),
        "targets": lpdeform.Handle([92, 93], lpdeform.Targets([[8, 7, 1], [9, 7, 1]])),
        "points": lpdeform.Handle(points=lpdeform.SurfacePoints([60], [[0.25, 0.25, 0.5]]), motion=lift),
    }
    session.set_handles(kept)
    before = session.settle(PATIENCE).positions
    session.update({name: lpdeform.Removal() for name in kept}, begins_step=True)
    session.undo()
    assert np.abs(session.settle(PATIENCE).positions - before).max() < 1e-2
    server.kill()
    server.start()
    after = session.settle(PATIENCE).positions  # recreated from the client's ledger
    assert np.abs(after - before).max() < 1e-2
    assert np.abs(after[[92, 93]] - [[8, 7, 1], [9, 7, 1]]).max() == 0


def test_a_session_opens_at_once_after_a_restart_though_another_has_just_failed_to(server: Server, shape: Grid) -> None:
    for _ in range(3):
        with lpdeform.open(shape.vertices, shape.faces, address=server.address):
            server.kill()
            time.sleep(0.5)  # its client retries
            server.start()
            with lpdeform.open(shape.vertices, shape.faces, address=server.address) as other:
                assert other.name


@pytest.mark.parametrize("has_lost", [False, True])
def test_a_server_that_went_away_is_asked_again_and_gets_what_it_has_lost(
    remote_session: lpdeform.Session, monkeypatch: pytest.MonkeyPatch, has_lost: bool
) -> None:
    session = remote_session
    session.settle(PATIENCE)
    session.move("right", translation=[0, 0, 2])
    call, asked = session._link.rpc.call, []

    def away_at_first(name: str, request: Any, *rest: Any) -> Any:
        asked.append((name, request))
        if len(asked) < 3:
            raise lpdeform.Unavailable(lpdeform.Code.UNAVAILABLE, "away")
        answer = call(name, request, *rest)
        if name == "GetSession" and has_lost:
            answer.session.input_seq = 1
        return answer

    newest = session.newest_input
    monkeypatch.setattr(session._link.rpc, "call", away_at_first)
    number = session.undo()
    again = ["UpdateHandles"] if has_lost else []
    assert [name for name, _ in asked] == ["UndoUpdate", "GetSession", "GetSession", *again, "UndoUpdate"]
    assert asked[0][1] == asked[-1][1]
    assert asked[-1][1].input_seq == number
    if has_lost:
        assert asked[3][1].update.input_seq == newest
    else:
        assert session.settle(PATIENCE).positions[11, 2] == 0


def test_a_session_recreated_takes_back_what_came_after_that_and_not_all_its_handles(
    remote_session: lpdeform.Session, server: Server
) -> None:
    session = remote_session
    session.move("right", translation=[0, 0, 2])
    before = session.name
    server.kill()
    server.start()
    session.move("right", translation=[0, 0, 3])
    assert session.name != before
    session.undo()
    assert session.settle(PATIENCE).positions[11, 2] == 2
    assert refused(session.undo) == "NOTHING_TO_UNDO"
    session.redo()
    assert session.settle(PATIENCE).positions[11, 2] == 3


def test_an_undo_that_was_taken_and_not_answered_is_no_fewer_steps_to_a_session_recreated(
    remote_session: lpdeform.Session, server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = remote_session
    session.move("right", translation=[0, 0, 2])
    server.kill()
    server.start()
    session.move("right", translation=[0, 0, 3])
    call, undone = session._link.rpc.call, []

    def unanswered_at_first(name: str, *rest: Any) -> Any:
        answer = call(name, *rest)
        if name == "UndoUpdate":
            undone.append(answer)
            if len(undone) == 1:
                raise lpdeform.Unavailable(lpdeform.Code.UNAVAILABLE, "away")
        return answer

    monkeypatch.setattr(session._link.rpc, "call", unanswered_at_first)
    session.undo()
    assert len(undone) == 2
    assert session.settle(PATIENCE).positions[11, 2] == 2


def test_nothing_to_undo_readers_and_closed_sessions_are_said(place: Place, shape: Grid) -> None:
    with lpdeform.open(shape.vertices, shape.faces, address=place.address) as session:
        assert refused(session.undo) == "NOTHING_TO_UNDO"
        session.set_handle("left", shape.left)
        assert session.settle(PATIENCE).is_final  # the session goes on
        with lpdeform.join(session.name, address=place.address) as reader:
            assert refused(reader.undo) == "NOT_THE_WRITER"
    for call in (session.undo, session.redo, session.snapshot):
        assert refused(call) == "SESSION_CLOSED"


def test_a_change_that_is_refused_before_an_undo_is_said_by_it(session: lpdeform.Session) -> None:
    settle_all(session)
    session._link.is_solving = True  # so that the change waits
    session.set_handle("beyond", [5000])
    session._link.is_solving = False
    assert refused(session.undo) == "HANDLE_VERTEX_OUT_OF_RANGE"
    assert session.move("right", translation=[0, 0, 1]).positions[11, 2] == 1


def test_a_session_leaves_as_a_file_and_comes_back_the_same(remote_session: lpdeform.Session, server: Server) -> None:
    session = remote_session
    before = session.move("right", translation=[0, 0, 2])
    session.set(p=1.5)
    file = session.snapshot()
    session.close()
    with lpdeform.restore(file, address=server.address) as restored:
        assert restored.mesh_report.vertices == 144
        assert np.array_equal(restored.next_frame(PATIENCE).positions[11], before.positions[11])
        assert restored.move("right", translation=[0, 0, 3]).positions[11, 2] == 3
        restored.undo()
        assert restored.settle(PATIENCE).positions[11, 2] == 2
        server.kill()
        server.start()
        assert restored.settle(PATIENCE).positions[11, 2] == 2  # recreated from the file and the later changes
        restored.move("right", translation=[0, 0, 4])
        restored.remove("left")
        restored.settle(PATIENCE)
        server.kill()
        server.start()
        restored.set_handle("middle", [66])
        after = restored.settle(PATIENCE).positions
        assert after[11, 2] == 4  # a handle of the file that was moved, but not set again
        assert abs(after[0, 2]) > 0.1  # and one that was removed


def test_files_that_are_no_snapshots_are_refused_by_name(remote_session: lpdeform.Session, server: Server) -> None:
    session = remote_session
    file = session.snapshot()
    damaged = bytearray(file)
    damaged[len(file) // 2] ^= 1
    for wrong, reason in ((b"a poem", "SNAPSHOT_FOREIGN"), (file[:-9], "SNAPSHOT_TRUNCATED"), (damaged, "SNAPSHOT_DAMAGED")):
        assert refused(lambda wrong=wrong: lpdeform.restore(bytes(wrong), address=server.address)) == reason


def test_snapshots_with_parts_that_are_missing_are_no_files(
    remote_session: lpdeform.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = remote_session
    part = service_pb2.SnapshotSessionResponse(size_bytes=10, offset=0, data=b"12345")
    for parts in ([], [part], [part, part]):
        monkeypatch.setattr("lpdeform._rpc.Rpc.snapshot", lambda *_, parts=parts: iter(parts))
        assert refused(session.snapshot) == "SNAPSHOT_INCOMPLETE"


def test_the_same_is_awaited(server: Server, shape: Grid) -> None:
    async def work() -> float:
        async with lpdeform.open_async(shape.vertices, shape.faces, address=server.address) as session:
            session.set_handle("left", shape.left)
            session.set_handle("right", shape.right)
            await session.move("right", translation=[0, 0, 2])
            file = await session.snapshot()
            await session.undo()
            await session.redo()
        async with lpdeform.restore_async(file, address=server.address) as restored:
            return float((await restored.next_frame(PATIENCE)).positions[11, 2])

    assert asyncio.run(work()) == 2
