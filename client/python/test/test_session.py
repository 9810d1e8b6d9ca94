"""Sessions on a real server."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext

import numpy as np
import pytest

import lpdeform
from conftest import PATIENCE, Grid, Place

MakeGrid = Callable[[int], Grid]


def refused(session: lpdeform.Session) -> lpdeform.LpdeformError:
    with pytest.raises(lpdeform.LpdeformError) as caught:
        session.settle(PATIENCE)
    return caught.value


def test_a_move_gives_the_finished_surface(session: lpdeform.Session, shape: Grid) -> None:
    frame = session.move("right", translation=[0, 0, 5])
    assert frame.is_final
    assert frame.positions.shape == (144, 3)
    assert frame.distortion.shape == (144,)
    assert frame.positions[shape.left].tolist() == shape.vertices[shape.left].tolist()
    assert np.array_equal(frame.positions[shape.right], shape.vertices[shape.right] + [0, 0, 5])
    assert session.mesh_report.vertices == 144
    assert session.connection == "connected"
    assert "144 vertices" in repr(session)


def test_the_live_result_is_that_of_a_solve_with_a_certificate(session: lpdeform.Session) -> None:
    frame = session.move("right", axis=[1, 0, 0], angle=0.5)
    result = session.solve(certify=True, trace=True)
    assert result.positions.dtype == np.float64
    assert result.energy == pytest.approx(frame.energy, rel=1e-6)  # the tolerance that the stream stopped at
    assert result.optimality_gap is not None
    assert result.optimality_gap < 1e-6
    assert result.trace[-1].energy == result.energy
    assert result.stop_reason == "converged"


def test_certified_streams_send_the_gap_of_a_result_that_stands(place: Place, shape: Grid) -> None:
    handles = {"left": lpdeform.Handle(shape.left), "right": lpdeform.Handle(shape.right)}
    with lpdeform.open(
        shape.vertices, shape.faces, address=place.address, handles=handles, certify=True
    ) as session:
        frame = session.move("right", translation=[0, 0, 2])
        while frame.optimality_gap is None:
            frame = session.next_frame(PATIENCE)
        assert 0 <= frame.optimality_gap < 1e-6


@pytest.mark.parametrize("encoding", ["float64", "float32", "quantized", "compressed"])
def test_every_encoding_carries_the_same_surface(place: Place, shape: Grid, encoding: str) -> None:
    with lpdeform.open(
        shape.vertices, shape.faces, address=place.address, encoding=encoding, with_normals=True  # type: ignore[arg-type]
    ) as session:
        session.set_handle("left", shape.left)
        session.set_handle("right", shape.right)
        frame = session.move("right", axis=[0, 1, 0], angle=-1.0, translation=[0, 0, 4])
        exact = session.solve(with_normals=True)
        extent = np.ptp(exact.positions, axis=0).max()
        # How far two solves agree, half a step of 16 bits, and what float32 rounds.
        most = {"float64": 1e-8, "float32": 1e-6}.get(encoding, 0.5 / 65535 + 1e-6) * extent
        assert np.abs(frame.positions - exact.positions).max() <= most
        assert np.abs(frame.normals - exact.normals).max() <= 1e-4
        assert np.abs(frame.distortion - exact.distortion).max() <= exact.distortion.max() * 2e-5
        assert frame.wire_bytes < 144 * {"float64": 57, "float32": 29}.get(encoding, 17)
        assert (frame.quantized is not None) == (encoding in ("quantized", "compressed"))


def test_compressed_frames_are_refused_where_nothing_reads_them(
    place: Place, shape: Grid, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lpdeform._codec._decoder", lambda: None)
    with pytest.raises(lpdeform.LpdeformError) as caught:
        lpdeform.open(shape.vertices, shape.faces, address=place.address, encoding="compressed")
    assert caught.value.reason == "NO_DECODER"


def test_large_meshes_and_targets_go_up_in_parts(place: Place, make_grid: MakeGrid) -> None:
    shape = make_grid(250)  # 62,500 vertices: 3 MB of mesh, 1.5 MB of targets, frames of several parts
    settings = lpdeform.SolverSettings(max_iterations=1)
    with lpdeform.open(shape.vertices, shape.faces, address=place.address, solver=settings) as session:
        targets = shape.vertices + [0, 0, 3]
        session.set_handle("all", np.arange(62_500), lpdeform.Targets(targets))
        frame = session.settle(PATIENCE)
        assert np.array_equal(frame.positions, targets)


def test_every_kind_of_hold_does_what_it_says(session: lpdeform.Session, shape: Grid) -> None:
    middle = np.flatnonzero((shape.vertices == [5, 6, 0]).all(axis=1))
    lift = lpdeform.RigidMotion(translation=(0, 0, 2))
    session.set_handle("middle", middle, lift, hold=lpdeform.Soft(0.5))
    soft = session.settle(PATIENCE).positions[middle, 2]
    assert 0.1 < soft < 1.9
    session.set_handle("middle", middle, lift, hold=lpdeform.AxisLock((1, 0, 0)))
    assert session.settle(PATIENCE).positions[middle, 1:].tolist() == [[6, 2]]
    session.set_handle("middle", middle, lift, hold=lpdeform.PlaneLock((0, 0, 1)))
    assert session.settle(PATIENCE).positions[middle, 2].tolist() == [2]
    session.set_handle("middle", points=lpdeform.SurfacePoints([100], [[0.25, 0.25, 0.5]]), motion=lift)
    corners = session.settle(PATIENCE).positions[shape.faces[100]]
    assert np.dot([0.25, 0.25, 0.5], corners)[2] == pytest.approx(2, abs=1e-5)
    turn = lpdeform.RigidMotion(axis=(0, 1, 0), angle=-0.6)
    session.set_handle("middle", middle, turn, hold=lpdeform.Orientation())
    turned = session.settle(PATIENCE).positions
    slope = turned[middle[0] + 1, 2] - turned[middle[0] - 1, 2]
    assert slope > 0.2  # the cell is turned up towards x, with nobody holding its position
    session.remove("middle")
    assert np.abs(session.settle(PATIENCE).positions[:, 2]).max() < 1e-6


def test_p_and_stiffness_may_differ_at_each_vertex(session: lpdeform.Session, shape: Grid) -> None:
    session.drag("right", axis=[0, 1, 0], angle=-1.2, translation=[-4, 0, 5])
    uniform = session.settle(PATIENCE)
    session.set(p=np.where(shape.vertices[:, 0] < 6, 1.0, 2.0), stiffness=np.full(144, 2.0, np.float32))
    painted = session.settle(PATIENCE)
    assert np.abs(painted.positions - uniform.positions).max() > 1e-3
    session.set(p=lpdeform.Automatic(0.5), stiffness=lpdeform.Automatic(0.5))
    session.settle(PATIENCE)
    session.set(p=2, stiffness=1)
    assert np.abs(session.settle(PATIENCE).positions - uniform.positions).max() < 1e-3


def test_a_region_keeps_everything_else_where_it_is(session: lpdeform.Session, shape: Grid) -> None:
    session.set(region=shape.vertices[:, 0] > 5.5)
    frame = session.move("right", translation=[0, 0, 3])
    outside = shape.vertices[:, 0] < 4.5
    assert np.abs(frame.positions[outside, 2]).max() == 0
    session.set(region=[])
    assert session.settle(PATIENCE).positions[outside, 2].max() > 0.01


def test_a_resizing_scales_and_spares(session: lpdeform.Session) -> None:
    session.update({"left": lpdeform.Removal(), "right": lpdeform.Removal()}, resize=lpdeform.Resize((2, 1, 1)))
    frame = session.settle(PATIENCE)
    assert np.ptp(frame.positions[:, 0]) == pytest.approx(22, rel=1e-5)


def test_welded_copies_come_out_the_same(place: Place, make_grid: MakeGrid) -> None:
    shape = make_grid(6)
    corners = shape.vertices[shape.faces].reshape(-1, 3)  # every triangle has its own three vertices
    faces = np.arange(len(corners)).reshape(-1, 3)
    with lpdeform.open(corners, faces, address=place.address, weld=True) as session:
        assert session.mesh_report.welded_vertices == len(corners) - 36
        session.set_handle("left", corners[:, 0] < 0.5)
        session.set_handle("right", corners[:, 0] > 4.5)
        frame = session.move("right", translation=[0, 0, 2])
        _, copies = np.unique(corners, axis=0, return_inverse=True)
        for group in range(36):
            assert np.unique(frame.positions[copies.reshape(-1) == group], axis=0).shape[0] == 1


def test_a_split_mesh_is_noticed_and_welded_with_a_tolerance(
    place: Place, make_grid: MakeGrid
) -> None:
    shape = make_grid(6)
    corners = shape.vertices[shape.faces].reshape(-1, 3)
    corners[:, 2] = np.arange(len(corners)) % 2 * 1e-5  # copies are apart
    faces = np.arange(len(corners)).reshape(-1, 3)
    with lpdeform.open(corners, faces, address=place.address, weld=1e-4) as session:
        assert session.mesh_report.welded_vertices == len(corners) - 36
        assert session.mesh_report.notices == ()
    with pytest.warns(lpdeform.SplitMeshWarning) as warned:
        session = lpdeform.open(corners.round(3), faces, address=place.address)
    with session:
        (notice,) = session.mesh_report.notices
        assert "comes apart where it is split" in notice
        split = next(defect for defect in session.mesh_report.defects if defect.kind == "split_border_vertices")
        assert split.count == len(corners) - 2  # all but two corners of the grid
    (warning,) = warned
    assert str(warning.message).startswith(notice)
    assert f" {split.count} vertices" in notice
    assert "weld=True" in str(warning.message)
    assert warning.filename == __file__
    with pytest.raises(lpdeform.SplitMeshWarning):  # an error by the filter of these tests
        lpdeform.open(corners.round(3), faces, address=place.address)
    with pytest.raises(lpdeform.InvalidInput, match="0.002"):
        lpdeform.open(corners, faces, address=place.address, weld=0.002)


def test_a_sphere_of_single_precision_is_noticed_and_welded(place: Place) -> None:
    rings, segments = 8, 16
    latitude = np.linspace(0, np.pi, rings + 1, dtype=np.float32)[:, None]
    longitude = np.linspace(0, 2 * np.pi, segments + 1, dtype=np.float32)[None, :]
    sphere = np.stack([np.sin(latitude) * np.cos(longitude), np.sin(latitude) * np.sin(longitude), np.cos(latitude) + 0 * longitude], axis=-1)
    corner = np.arange((rings + 1) * (segments + 1)).reshape(rings + 1, segments + 1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[:-1, 1:], corner[1:, 1:]
    faces = np.concatenate([np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([c, b, d], axis=-1).reshape(-1, 3)])
    for weld in (False, True):
        expected = nullcontext() if weld else pytest.warns(lpdeform.SplitMeshWarning)
        with expected, lpdeform.open(sphere.reshape(-1, 3), faces, address=place.address, weld=weld) as session:
            assert len(session.mesh_report.notices) == (not weld)
            split = {defect.kind: defect.count for defect in session.mesh_report.defects}.get("split_border_vertices", 0)
            assert split == (0 if weld else 2 * (rings - 1) + 2 * (segments + 1))
            assert session.mesh_report.welded_vertices == (rings + 1) * (segments + 1) - 2 - (rings - 1) * segments if weld else True


def test_what_the_server_refuses_is_raised_with_its_words(session: lpdeform.Session) -> None:
    session.settle(PATIENCE)
    number = session.set_handle("bad", [5000])
    error = refused(session)
    assert isinstance(error, lpdeform.InvalidInput)
    assert isinstance(error, ValueError)
    assert (error.code, error.reason) == (lpdeform.Code.INVALID_ARGUMENT, "HANDLE_VERTEX_OUT_OF_RANGE")
    assert (error.element, error.limit, error.input_seq) == ("vertex 5000", "0 <= vertex < 144", number)
    assert error.metadata == {"element": "vertex 5000", "limit": "0 <= vertex < 144"}
    assert session.move("right", translation=[0, 0, 1]).is_final  # the session goes on without it


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"p": 0.5}, "P_OUT_OF_RANGE"),
        ({"stiffness": -1.0}, "STIFFNESS_OUT_OF_RANGE"),
        ({"p": lpdeform.Automatic(2)}, "STRENGTH_OUT_OF_RANGE"),
        ({"length_unit": -1.0}, "LENGTH_UNIT_OUT_OF_RANGE"),
        ({"solver": lpdeform.SolverSettings(tolerance=1)}, "TOLERANCE_OUT_OF_RANGE"),
        ({"region": [999]}, "REGION_VERTEX_OUT_OF_RANGE"),
    ],
)
def test_settings_out_of_range_are_refused(session: lpdeform.Session, settings: dict[str, object], reason: str) -> None:
    session.settle(PATIENCE)
    session.set(**settings)  # type: ignore[arg-type]
    assert refused(session).reason == reason


def test_a_name_that_is_no_text_is_refused_at_once_and_the_session_goes_on(session: lpdeform.Session) -> None:
    with pytest.raises(lpdeform.InvalidInput) as caught:
        session.set_handle("tip \ud800", [0])
    assert (caught.value.reason, caught.value.element) == ("NAME_ENCODING", "handle 'tip \\ud800'")
    assert session.settle(PATIENCE).is_final


def test_what_cannot_be_sent_is_refused_at_once(session: lpdeform.Session) -> None:
    newest = session.newest_input
    for wrong in (
        lambda: session.move("right"),
        lambda: session.move("right", lpdeform.Fixed(), translation=[0, 0, 1]),
        lambda: session.move("right", translation=[0, 0]),
        lambda: session.drag("right", targets=[[0, 1]]),
        lambda: session.set_handle("new", [0.5]),
        lambda: session.set(solver=lpdeform.SolverSettings(method="magic")),  # type: ignore[arg-type]
        lambda: session.solve(initial_positions=np.zeros((3, 3))),
        lambda: session.solve(initial_positions=np.full((144, 3), np.nan)),
    ):
        with pytest.raises(lpdeform.InvalidInput):
            wrong()
    assert session.newest_input == newest


def test_meshes_that_cannot_be_deformed_name_the_element(place: Place, shape: Grid) -> None:
    broken = shape.vertices.copy()
    broken[17, 1] = np.nan
    with pytest.raises(lpdeform.InvalidInput) as caught:
        lpdeform.open(broken, shape.faces, address=place.address)
    assert (caught.value.reason, caught.value.element) == ("MESH_NOT_FINITE", "vertex 17")
    for vertices, faces, options in (
        (shape.vertices[:, :2], shape.faces, {}),
        (shape.vertices, shape.faces + 144, {}),
        (shape.vertices, -shape.faces, {}),
        (shape.vertices, shape.faces, {"weights": "heavy"}),
        (shape.vertices, shape.faces, {"encoding": "smoke"}),
        (shape.vertices, shape.faces, {"credit": 9}),
        (shape.vertices, shape.faces, {"weld": [0, 1]}),
    ):
        with pytest.raises(lpdeform.InvalidInput):
            lpdeform.open(vertices, faces, address=place.address, **options)  # type: ignore[arg-type]


def test_nobody_there_is_said_at_once(shape: Grid) -> None:
    with pytest.raises(lpdeform.Unavailable, match="No lpdeform server answers at 127.0.0.1:1:") as caught:
        lpdeform.open(shape.vertices, shape.faces, address="127.0.0.1:1")
    assert isinstance(caught.value, ConnectionError)
    assert caught.value.reason == "NO_SERVER"


def test_a_component_without_a_handle_is_named_until_it_has_one(place: Place, shape: Grid) -> None:
    vertices = np.concatenate([shape.vertices, shape.vertices + [100, 0, 0]])
    faces = np.concatenate([shape.faces, shape.faces + 144])
    with lpdeform.open(vertices, faces, address=place.address) as session:
        session.set_handle("one", [0, 1, 2])
        error = refused(session)
        assert (error.code, error.reason) == (lpdeform.Code.FAILED_PRECONDITION, "COMPONENT_WITHOUT_HANDLE")
        session.set_handle("other", [144, 145, 146])
        assert session.settle(PATIENCE).is_final
    with lpdeform.open(vertices, faces, address=place.address, free_components="stay") as session:
        session.set_handle("one", [0, 1, 2])
        assert session.settle(PATIENCE).is_final


def test_a_drag_faster_than_the_server_ends_where_it_was_left(session: lpdeform.Session, shape: Grid) -> None:
    taken = 0
    for step in range(500):
        session.drag("right", translation=[0, 0, step / 100])
        taken += session.poll() is not None
    frame = session.settle(PATIENCE)
    assert np.abs(frame.positions[shape.right, 2] - 4.99).max() < 1e-5
    assert taken <= 500


def test_a_reader_who_never_asks_holds_up_nobody(session: lpdeform.Session, place: Place) -> None:
    with lpdeform.join(session.name, address=place.address) as idle:
        assert idle.next_frame(PATIENCE).positions.shape == (144, 3)
        for step in range(20):
            session.move("right", translation=[0, 0, step / 10])
        newest = session.newest_input
        while idle.next_frame(PATIENCE).input_seq < newest:
            pass


def test_readers_watch_and_may_take_over(session: lpdeform.Session, place: Place) -> None:
    session.move("right", translation=[0, 0, 1])
    with lpdeform.join(session.name, address=place.address) as reader:
        assert reader.next_frame(PATIENCE).input_seq == session.newest_input
        with pytest.raises(lpdeform.LpdeformError) as caught:
            reader.remove("left")
        assert caught.value.reason == "NOT_THE_WRITER"
        reader.take_over()
        reader.drag("right", translation=[0, 0, 2])
        reader.settle(PATIENCE)
        while True:
            try:
                session.next_frame(PATIENCE)
            except lpdeform.LpdeformError as error:
                assert error.reason == "WRITER_REPLACED"
                break
        assert session.connection == "closed"
        session.take_over()
        assert session.move("right", translation=[0, 0, 3]).positions[11, 2] == 3
    with pytest.raises(lpdeform.LpdeformError) as caught:
        lpdeform.join("sessions/" + 32 * "0", address=place.address)
    assert caught.value.reason == "SESSION_UNKNOWN"
