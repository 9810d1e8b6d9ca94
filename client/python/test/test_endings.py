"""How waiting ends, how sessions end, and what happens to errors on threads."""

from __future__ import annotations

import dataclasses
import gc
import threading
import time
from collections.abc import Callable

import numpy as np
import pytest

import lpdeform
from conftest import PATIENCE, Grid, Place, Server, settle_all
from lpdeform.frames import FrameHeader
from lpdeform.v1 import frame_pb2, service_pb2

MakeGrid = Callable[[int], Grid]


def test_frames_come_to_who_iterates_until_it_is_closed(session: lpdeform.Session) -> None:
    session.drag("right", translation=[0, 0, 1])
    seen = []
    for frame in session:
        seen.append(frame)
        if frame.is_final and frame.input_seq == session.newest_input:
            threading.Timer(0.05, session.close).start()
    assert seen
    assert session.connection == "closed"


def test_what_the_server_says_about_itself_is_logged_and_there_while_its_stream_lasts(
    remote_session: lpdeform.Session, server: Server, caplog: pytest.LogCaptureFixture
) -> None:
    session = remote_session
    session.settle(PATIENCE)
    link = session._link
    stream = link._stream
    assert stream is not None
    with link.changed:
        stream.server_notice = None  # there may be one about the load of this machine
        assert session.notice is None
    caplog.set_level("INFO", "lpdeform")
    said = (
        (service_pb2.NOTICE_REASON_OVERLOADED, "overloaded", "WARNING"),
        (service_pb2.NOTICE_REASON_RECOVERED, "recovered", "INFO"),
        (9, "other", "INFO"),
    )
    for number, reason, level in said:
        notice = service_pb2.Notice(reason=number, text="Of its own.")  # type: ignore[arg-type]
        event = service_pb2.StreamEvent(notice=notice)
        with link.changed:  # so no notice of the server itself comes in between
            link._take(stream, [], service_pb2.DeformResponse(event=event))
            assert session.notice == lpdeform.Notice(reason, "Of its own.")  # type: ignore[arg-type]
        ours = [one for one in caplog.records if one.getMessage() == f"{server.address}: Of its own."]
        assert (ours[-1].levelname, ours[-1].name) == (level, "lpdeform")
    assert len(ours) == len(said)
    server.kill()
    with link.changed:
        assert link.changed.wait_for(lambda: link._stream is None or link._stream.is_over, PATIENCE)
    assert session.notice is None
    server.start()
    session.move("right", translation=[0, 0, 1], timeout=PATIENCE)  # it goes on
    newest = session.notice
    assert newest is None or newest.text != "Of its own."


def test_a_better_shape_is_announced_until_a_frame_shows_it_or_a_later_update(remote_session: lpdeform.Session) -> None:
    session = remote_session
    settle_all(session)
    link = session._link
    stream = link._stream
    assert stream is not None

    def say(reason: int, **numbers: float) -> None:
        notice = service_pb2.Notice(reason=reason, text="Of its own.", **numbers)  # type: ignore[arg-type]
        link._take(stream, [], service_pb2.DeformResponse(event=service_pb2.StreamEvent(notice=notice)))

    def after_frame(input_seq: int, energy: float) -> str | None:
        say(service_pb2.NOTICE_REASON_BETTER_SHAPE, input_seq=7, energy=3.0, saved_share=0.25)
        assert session.notice == lpdeform.Notice("better_shape", "Of its own.", 7, 3.0, 0.25)
        stream.shown(lpdeform.Frame(FrameHeader(input_seq=input_seq, energy=energy)))
        return session.notice and session.notice.reason

    with link.changed:  # so no notice of the server itself comes in between
        stream.server_notice = None
        assert after_frame(8, 9.0) is None
        say(service_pb2.NOTICE_REASON_OVERLOADED)
        assert after_frame(7, 4.0) == "better_shape"  # the same result with its certificate
        assert after_frame(7, 3.0) == "overloaded"
        assert after_frame(8, 9.0) == "overloaded"


def test_waiting_ends_at_its_time(session: lpdeform.Session) -> None:
    session.settle(PATIENCE)
    with pytest.raises(TimeoutError) as caught:
        session.next_frame(0.05)
    assert isinstance(caught.value, lpdeform.Timeout)
    assert caught.value.reason == "NO_FRAME"


def test_no_time_takes_what_is_there_and_nothing_else(session: lpdeform.Session) -> None:
    session.settle(PATIENCE)
    with pytest.raises(lpdeform.Timeout) as caught:
        session.next_frame(0)
    assert caught.value.reason == "NO_FRAME"
    session.drag("right", translation=[0, 0, 1])
    assert session._link.box.wait(time.monotonic() + PATIENCE, session._link.box.takes)
    assert session.next_frame(0).positions.shape == (144, 3)


def test_a_solve_without_time_says_so_and_sends_nothing(
    remote_session: lpdeform.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = remote_session
    settle_all(session)
    with monkeypatch.context() as patched:
        patched.setattr("lpdeform._rpc.Rpc.solve", lambda *_: pytest.fail("it was sent"))
        with pytest.raises(lpdeform.Timeout) as caught:
            session.solve(timeout=0)
    assert caught.value.reason == "SOLVE_TIME_PASSED"
    assert session.solve(timeout=PATIENCE).stop_reason == "converged"


@pytest.mark.parametrize("timeout", [-1.0, float("nan")])
def test_a_timeout_that_is_none_is_refused_and_nothing_is_sent(session: lpdeform.Session, timeout: float) -> None:
    newest = session.newest_input
    for wrong in (
        lambda: session.move("right", translation=[0, 0, 1], timeout=timeout),
        lambda: session.settle(timeout),
        lambda: session.next_frame(timeout),
        lambda: session.solve(timeout=timeout),
    ):
        with pytest.raises(lpdeform.InvalidInput) as caught:
            wrong()
        assert (caught.value.reason, caught.value.element) == ("SECONDS_OUT_OF_RANGE", "timeout")
    assert session.newest_input == newest


def test_a_closed_session_says_so_and_is_gone_from_the_server(session: lpdeform.Session, place: Place) -> None:
    session.close()
    session.close()
    for call in (session.poll, session.settle, session.solve, session.take_over, lambda: session.remove("left")):
        with pytest.raises(lpdeform.LpdeformError) as caught:
            call()
        assert caught.value.reason == "SESSION_CLOSED"
    with pytest.raises(lpdeform.LpdeformError) as caught:
        lpdeform.join(session.name, address=place.address)
    assert caught.value.reason == "SESSION_UNKNOWN"


def test_a_session_that_nobody_has_any_more_is_closed(place: Place, shape: Grid) -> None:
    session = lpdeform.open(shape.vertices, shape.faces, address=place.address)
    session.set_handle("left", shape.left)
    session.settle(PATIENCE)
    link, name = session._link, session.name
    del session
    gc.collect()
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            lpdeform.join(name, address=place.address).close()
        except lpdeform.LpdeformError as error:
            assert error.reason == "SESSION_UNKNOWN"
            break
        assert time.monotonic() < deadline
    assert link.is_closing


@pytest.mark.parametrize("raised", [MemoryError("no room"), ValueError("no number")])
def test_an_exception_on_a_thread_of_ours_ends_the_session_with_its_text(
    server: Server, shape: Grid, monkeypatch: pytest.MonkeyPatch, raised: Exception
) -> None:
    def fails(*_: object) -> None:
        raise raised

    monkeypatch.setattr("lpdeform._assembly.FrameAssembly.add", fails)
    with lpdeform.open(shape.vertices, shape.faces, address=server.address) as session:
        session.set_handle("left", shape.left)
        with pytest.raises(lpdeform.LpdeformError, match=str(raised)) as caught:
            session.settle(PATIENCE)
        assert (caught.value.code, caught.value.reason) == (lpdeform.Code.INTERNAL, "EXCEPTION")
        assert session.connection == "closed"


@pytest.mark.parametrize(("where", "raised"), [
    ("lpdeform._wire.update_to_wire", MemoryError("no room")),
    ("lpdeform._wire.update_to_wire", TypeError("no number")),
    ("lpdeform._sending._can_send", RuntimeError("no work")),
])  # fmt: skip
def test_an_exception_on_the_thread_that_sends_ends_the_session_with_its_text(
    remote_session: lpdeform.Session, monkeypatch: pytest.MonkeyPatch, where: str, raised: Exception
) -> None:
    session = remote_session
    def fails(*_: object) -> None:
        raise raised

    session.settle(PATIENCE)
    monkeypatch.setattr(where, fails)
    with pytest.raises(lpdeform.LpdeformError, match=str(raised)) as caught:
        session.drag("right", translation=[0, 0, 1])  # raises too if the thread has looked by itself meanwhile
        session.settle(PATIENCE)
    assert (caught.value.code, caught.value.reason) == (lpdeform.Code.INTERNAL, "EXCEPTION")
    assert session.connection == "closed"
    with pytest.raises(lpdeform.LpdeformError, match=str(raised)):
        session.remove("right")


def test_what_interrupts_a_solve_leaves_the_session_as_it_was(
    remote_session: lpdeform.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = remote_session
    def interrupts(*_: object) -> None:
        raise KeyboardInterrupt

    session.settle(PATIENCE)
    session._link.is_solving = True  # so that the change waits for the solve
    number = session.drag("right", translation=[0, 0, 1])
    session._link.is_solving = False
    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr("lpdeform._solve._ResultBuilder.take", interrupts)
        session.solve(timeout=PATIENCE)
    result = session.solve(timeout=PATIENCE)
    assert result.input_seq == number
    assert result.positions[11, 2] == 1


def test_a_stream_of_another_mesh_ends_the_session(server: Server, shape: Grid) -> None:
    with lpdeform.open(shape.vertices, shape.faces, address=server.address) as session:
        link = session._link  # which has no stream before the first update
        report = dataclasses.replace(link.lease.report, vertices=len(shape.vertices) - 1)
        link.lease = dataclasses.replace(link.lease, report=report)
        session.set_handle("left", np.flatnonzero(shape.left))
        with pytest.raises(lpdeform.LpdeformError, match=f"{len(shape.vertices)} vertices") as caught:
            session.settle(PATIENCE)
        assert (caught.value.code, caught.value.reason) == (lpdeform.Code.DATA_LOSS, "FRAME_VERTICES")
        assert session.connection == "closed"


def test_the_timeout_of_a_solve_counts_while_another_runs(session: lpdeform.Session) -> None:
    session._link.is_solving = True
    with pytest.raises(lpdeform.Timeout) as caught:
        session.solve(timeout=0.05)
    assert caught.value.reason == "SOLVE_UNDER_WAY"
    session._link.is_solving = False
    session.solve(timeout=PATIENCE)


def test_progress_is_told_and_a_deadline_kept(place: Place, make_grid: MakeGrid) -> None:
    shape = make_grid(100)
    handles = {"left": lpdeform.Handle(shape.left), "right": lpdeform.Handle(shape.right)}
    with lpdeform.open(shape.vertices, shape.faces, address=place.address, handles=handles, p=1.0) as session:
        session.drag("right", axis=[1, 0, 0], angle=2.5, translation=[-40, 0, 20])
        told: list[lpdeform.SolveProgress] = []
        result = session.solve(on_progress=told.append)
        assert all(one.iteration <= result.iterations for one in told)
        session.set(solver=lpdeform.SolverSettings(initial="rest", tolerance=1e-14, max_iterations=10**6), p=1.01)
        with pytest.raises(lpdeform.Timeout):
            session.solve(timeout=0.02)
