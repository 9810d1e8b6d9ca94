"""Servers that go away."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np
import pytest

import lpdeform
from conftest import PATIENCE, Grid, Server

MakeGrid = Callable[[int], Grid]


@pytest.fixture
def shape(make_grid: MakeGrid) -> Grid:
    return make_grid(20)


def test_after_kill_9_the_session_is_recreated_and_shows_the_same_surface(
    remote_session: lpdeform.Session, server: Server
) -> None:
    session = remote_session
    before = session.move("right", translation=[0, 0, 5])
    name = session.name
    server.kill()
    server.start()
    after = session.next_frame(PATIENCE)
    while not after.is_final:
        after = session.next_frame(PATIENCE)
    assert session.name != name
    assert after.input_seq == before.input_seq
    assert np.abs(after.positions - before.positions).max() < 1e-4 * 27  # both within the solver's tolerance
    assert session.move("right", translation=[0, 0, 6]).positions[19, 2] == 6


def test_what_is_moved_while_the_server_is_away_comes_when_it_is_back(
    remote_session: lpdeform.Session, server: Server
) -> None:
    session = remote_session
    session.move("right", translation=[0, 0, 5])
    server.stop()
    for height in (6, 7, 8, 9):
        session.drag("right", translation=[0, 0, height])
    assert session.poll() is None or session.connection != "closed"
    server.start()
    assert session.settle(PATIENCE).positions[19, 2] == 9
    assert session.interruption is not None


def test_a_solve_under_way_begins_again(remote_session: lpdeform.Session, server: Server) -> None:
    session = remote_session
    session.move("right", translation=[0, 0, 5])
    results: list[lpdeform.SolveResult] = []
    session.drag("right", axis=[1, 0, 0], angle=2.0)
    solving = threading.Thread(target=lambda: results.append(session.solve(timeout=PATIENCE)))
    solving.start()
    server.kill()
    server.start()
    solving.join(PATIENCE)
    assert [one.stop_reason for one in results] == ["converged"]


def test_heartbeats_keep_a_stream_that_has_nothing_to_say(remote_session: lpdeform.Session) -> None:
    session = remote_session
    session.move("right", translation=[0, 0, 1])
    with pytest.raises(lpdeform.Timeout):
        session.next_frame(7)  # dead after 6 s without them
    assert session.connection == "connected"
    assert session.interruption is None


def test_a_server_away_for_too_long_is_given_up(server: Server, shape: Grid) -> None:
    with lpdeform.open(
        shape.vertices, shape.faces, address=server.address, reconnect_for=0.3, handles={"left": lpdeform.Handle(shape.left)}
    ) as session:
        session.settle(PATIENCE)
        server.kill()
        with pytest.raises(lpdeform.Unavailable):
            session.next_frame(PATIENCE)
        assert session.connection == "closed"
        with pytest.raises(lpdeform.Unavailable):
            session.remove("left")
    server.start()


def test_a_joined_session_that_the_server_lost_is_over(remote_session: lpdeform.Session, server: Server) -> None:
    session = remote_session
    session.move("right", translation=[0, 0, 1])
    with lpdeform.join(session.name, address=server.address) as reader:
        reader.next_frame(PATIENCE)
        server.kill()
        server.start()
        with pytest.raises(lpdeform.LpdeformError) as caught:
            while True:
                reader.next_frame(PATIENCE)
        assert caught.value.reason == "SESSION_UNKNOWN"
