"""Lower minima: looked for by solves and by sessions in which nothing changes, announced, and taken or shown."""

from __future__ import annotations

import asyncio
import dataclasses
import time
from collections.abc import Callable

import numpy as np
import pytest

import lpdeform
from conftest import PATIENCE, Place
from lpdeform._notices import Notices


def box(side: int, height: int) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[type-arg]
    """The closed surface of a box of side x side x height cells."""
    cells = np.array([side, side, height])
    corners: list[tuple[int, ...]] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, cells[axis]):
            for i in range(cells[u]):
                for j in range(cells[v]):
                    square = []
                    for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        at = [0, 0, 0]
                        at[axis], at[u], at[v] = end, i + di, j + dj
                        square.append(tuple(at))
                    a, b, c, d = square if end else square[::-1]
                    corners += [a, b, c, a, c, d]
    vertices, inverse = np.unique(np.array(corners, float), axis=0, return_inverse=True)
    return vertices, inverse.reshape(-1, 3)


def bend(place: Place, **search: float) -> lpdeform.Session:
    """A box whose top is turned by 80 degrees. The first minimum that the solver comes to is 2 % above another one."""
    vertices, faces = box(4, 20)
    session = lpdeform.open(vertices, faces, address=place.address)
    settings = lpdeform.MinimaSearch(least_share=0.001, **search)  # type: ignore[arg-type]
    session.set(p=1.5, solver=lpdeform.SolverSettings(search=settings))
    turn = lpdeform.RigidMotion((1, 0, 0), np.radians(80), (2, 2, 10))
    bottom = np.flatnonzero(vertices[:, 2] == 0)
    top = np.flatnonzero(vertices[:, 2] == 20)
    session.set_handles({"bottom": lpdeform.Handle(bottom), "top": lpdeform.Handle(top, turn)})
    return session


def until(is_so: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.01)


def better(session: lpdeform.Session) -> bool:
    return session.notice is not None and session.notice.reason == "better_shape"


def lower_than(first: lpdeform.Frame, session: lpdeform.Session) -> lpdeform.Frame:
    """The next final frame whose energy is lower by at least the least share. Others may come before it."""
    end = time.monotonic() + PATIENCE
    while True:
        shown = session.next_frame(PATIENCE)
        if shown.is_final and shown.energy <= 0.999 * first.energy:
            return shown
        assert time.monotonic() < end


def test_a_session_in_which_nothing_changes_announces_a_better_shape_which_is_taken_once(place: Place) -> None:
    with bend(place, effort=2) as session:
        first = session.settle(PATIENCE)
        until(lambda: better(session))
        notice = session.notice
        assert notice is not None
        assert notice.input_seq == first.input_seq
        assert notice.saved_share == pytest.approx(1 - notice.energy / first.energy)
        taken = session.take_better_shape()
        assert taken.input_seq == first.input_seq
        assert taken.energy <= notice.energy  # a further start may have found a lower one meanwhile
        assert not better(session)
        shown = lower_than(first, session)
        assert (shown.is_final, shown.input_seq, shown.energy) == (True, *taken)
        with pytest.raises(lpdeform.LpdeformError) as caught:
            session.take_better_shape()
        assert caught.value.reason == "NO_BETTER_SHAPE"


def test_a_better_shape_is_not_announced_any_more_once_a_frame_answers_a_later_change(place: Place) -> None:
    with bend(place, effort=2) as session:
        session.settle(PATIENCE)
        until(lambda: better(session))
        moved = session.move("top", axis=(1, 0, 0), angle=0.1, timeout=PATIENCE)
        notice = session.notice
        # There may be one for the later change by now.
        assert notice is None or notice.reason != "better_shape" or notice.input_seq == moved.input_seq


def test_a_better_shape_is_not_announced_any_more_after_a_solve(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    with bend(place, effort=2) as session:
        session.settle(PATIENCE)
        until(lambda: better(session))
        announced = session.notice
        assert announced is not None
        frames: list[lpdeform.Frame] = []
        known: list[bool] = []
        shown = Notices.shown

        def note_frame(notices: Notices, frame: lpdeform.Frame) -> None:
            frames.append(frame)
            shown(notices, frame)

        def note_progress(_: lpdeform.SolveProgress) -> None:
            with session._link.changed:  # no frame comes meanwhile
                is_shown = any(frame.energy <= announced.energy for frame in frames)
                known.append(is_shown or better(session))

        monkeypatch.setattr(Notices, "shown", note_frame)
        session.solve(on_progress=note_progress)
        assert all(known)  # until the server has solved, or a frame shows that it has
        # It may have searched again by now, and then the shape is one that it has.
        if better(session):
            session.take_better_shape()


def test_a_better_shape_is_shown_at_once_if_that_is_asked_for(place: Place) -> None:
    with bend(place, effort=0) as session:
        first = session.settle(PATIENCE)
        search = lpdeform.MinimaSearch(effort=2, least_share=0.001, show=True)
        changed = session.set(solver=lpdeform.SolverSettings(search=search))
        shown = lower_than(first, session)
        assert shown.is_final
        assert shown.input_seq == changed
        assert not better(session)


def test_a_solve_says_which_minima_it_has_seen(place: Place) -> None:
    with bend(place, effort=1) as session:
        result = session.solve()
        assert result.further_starts == 12
        assert result.energy == min(result.minima)
        starts = f"looked for lower minima from 12 further starts, of which {len(result.minima) - 1} ended in a minimum; minima of "
        assert result.searched.startswith(starts)
    with bend(place, effort=0) as session:
        result = session.solve(certify=True)
        assert (result.minima, result.further_starts) == ((result.energy,), 0)
        assert result.searched == "no other minima were looked for (effort 0)"
        assert repr(result).endswith(" for its rotations; no other minima were looked for (effort 0)>")


def test_what_was_searched_is_said_without_a_word_too_much(place: Place) -> None:
    with bend(place, effort=0) as session:
        solved = session.solve()

    def said(**facts: object) -> str:
        return dataclasses.replace(solved, **facts).searched  # type: ignore[arg-type]

    # A single start may be the result of coarse levels, or the only one before a limit.
    assert said(minima=(8.0,), further_starts=1) == (
        "looked for lower minima from 1 further start, of which 0 ended in a minimum; minima of 1 energy were seen, E = 8"
    )
    assert said(minima=(8.0, 8.004, 7.0, 7.001, 7.5), further_starts=8) == (
        "looked for lower minima from 8 further starts, of which 4 ended in a minimum; minima of 3 energies were seen, E from 7 to 8.004"
    )
    assert said(search_iterations=3) == "the search for lower minima ended before its first start did"
    assert said(minima=()) == "the server does not say whether it looked for other minima"
    limited = said(minima=(), stop_reason="time_limit", effort=1)
    assert limited == "the solve ended before a first minimum, and no other was looked for"


def test_a_search_out_of_range_is_refused_by_name(place: Place) -> None:
    for search, reason in (({"effort": 1001}, "EFFORT_OUT_OF_RANGE"), ({"least_share": 2.0}, "LEAST_SHARE_OUT_OF_RANGE")):
        vertices, faces = box(1, 1)
        with lpdeform.open(vertices, faces, address=place.address) as session:
            session.set(solver=lpdeform.SolverSettings(search=lpdeform.MinimaSearch(**search)))  # type: ignore[arg-type]
            with pytest.raises(lpdeform.InvalidInput) as caught:
                session.settle(PATIENCE)
            assert caught.value.reason == reason


def test_a_search_that_no_message_can_hold_raises_at_once_and_the_session_goes_on(place: Place) -> None:
    vertices, faces = box(1, 1)
    with lpdeform.open(vertices, faces, address=place.address) as session:
        for solver in (
            lpdeform.SolverSettings(search=lpdeform.MinimaSearch(effort=-1)),
            lpdeform.SolverSettings(search=lpdeform.MinimaSearch(effort=2**32)),
            lpdeform.SolverSettings(max_iterations=-1),
        ):
            with pytest.raises(lpdeform.InvalidInput):
                session.set(solver=solver)
        assert session.newest_input == 0
        session.set_handle("base", [0])
        assert session.settle(PATIENCE).is_final


def test_readers_may_not_take_it_and_closed_sessions_neither(place: Place) -> None:
    with bend(place) as session:
        with lpdeform.join(session.name, address=place.address) as reader:
            with pytest.raises(lpdeform.LpdeformError) as caught:
                reader.take_better_shape()
            assert caught.value.reason == "NOT_THE_WRITER"
    with pytest.raises(lpdeform.LpdeformError) as caught:
        session.take_better_shape()
    assert caught.value.reason == "SESSION_CLOSED"


def test_it_is_asked_for_from_asyncio_as_well(place: Place) -> None:
    async def ask() -> str:
        vertices, faces = box(1, 1)
        async with lpdeform.open_async(vertices, faces, address=place.address) as session:
            with pytest.raises(lpdeform.LpdeformError) as caught:
                await session.take_better_shape()
        return caught.value.reason

    assert asyncio.run(ask()) == "NO_BETTER_SHAPE"
