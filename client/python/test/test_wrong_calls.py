"""What is refused of callers, in this process: each with a reason, and with what is wrong."""

from __future__ import annotations

import multiprocessing
import os
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import lpdeform
from lpdeform import Code, LpdeformError, RigidMotion, SolverSettings
from lpdeform._meshes import mesh_arrays

V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], float)
F = np.array([[0, 1, 2], [1, 3, 2]])
H: Any = {"a": [0], "b": ([3], [[1, 1, 1]])}
deform: Any = lpdeform.deform
open_: Any = lpdeform.open


def session(**given: Any) -> Any:
    return open_(V, F, handles={"a": lpdeform.Handle([0])}, **given)


@pytest.mark.parametrize(
    ("call", "reason", "element"),
    [
        (lambda: deform(V, F, [("a", [0])]), "ARRAY_TYPE", "handles"),
        (lambda: deform(V, F, {"a": [0], "b": ([3], [0, 0, 1])}), "MOTION_TYPE", "handle 'b'"),
        (lambda: deform(V, F, {"a": [0], "b": ([3], "up")}), "MOTION_TYPE", "handle 'b'"),
        (lambda: deform(V, F, {"b": ([0, 3], [[1, 2, 3], [1, 2]])}), "MOTION_TYPE", "handle 'b'"),
        (lambda: deform(V, F, {"a": ([0], RigidMotion(), 1)}), "ARRAY", "vertices of handle 'a'"),
        (lambda: deform(V, F, {"a": np.array([1, 0, 0, 1])}), "ARRAY_TYPE", "vertices of handle 'a'"),
        (lambda: deform(V, F, {"a": np.ma.array([0, 1], mask=[0, 1])}), "ARRAY_TYPE", "vertices of handle 'a'"),
        (lambda: deform(V, [[0, 1, 2], [1, -3, 2]], H), "INDEX_OUT_OF_RANGE", "faces, row 1"),
        (lambda: deform(V, H), "ARRAY", "faces"),
        (lambda: deform(V, F, H, solver="auto"), "ARRAY_TYPE", "solver"),
        (lambda: deform(V, F, H, solver=SolverSettings(search=3)), "ARRAY_TYPE", "search"),  # type: ignore[arg-type]
        (lambda: deform(V, F, H, region=np.zeros(4, bool)), "REGION_EMPTY", "region"),
        (lambda: deform(V, F, H, timeout="a"), "SECONDS_OUT_OF_RANGE", "timeout"),
        (lambda: deform(V, F, H, address=5), "ARRAY_TYPE", "address"),
        (lambda: open_(V, F, credit=1.5), "ARRAY_TYPE", "credit"),
        (lambda: open_(V, F, credit=9), "CREDIT_OUT_OF_RANGE", "credit"),
        (lambda: open_(V, F, max_frames_per_second="z"), "ARRAY_TYPE", "max_frames_per_second"),
        (lambda: open_(V, F, call_timeout=-1), "SECONDS_OUT_OF_RANGE", "call_timeout"),
        (lambda: open_(V, F, call_timeout=float("nan")), "SECONDS_OUT_OF_RANGE", "call_timeout"),
        (lambda: open_(V, F, reconnect_for="x"), "ARRAY_TYPE", "reconnect_for"),
        (lambda: session().update(settings={"p": 1}), "ARRAY_TYPE", "settings"),
        (lambda: session().update(resize="x"), "ARRAY_TYPE", "resize"),
        (lambda: session().update(["a"]), "ARRAY_TYPE", "handles"),
        (lambda: session().settle(timeout=None), "SECONDS_OUT_OF_RANGE", "timeout"),
        (lambda: deform(V, F, H).plot(backend="x"), "NAME_UNKNOWN", "backend"),
    ],
)
def test_a_wrong_argument_is_named(call: Callable[[], object], reason: str, element: str) -> None:
    with pytest.raises(lpdeform.InvalidInput) as caught:
        call()
    assert (caught.value.reason, caught.value.element) == (reason, element)


def test_flags_may_be_numpys() -> None:
    yes = np.bool_(True)
    result = deform(V, F, H, certify=yes, trace=yes, with_normals=2)
    assert result.optimality_gap is not None and len(result.trace) > 0 and result.normals is not None
    with session(with_distortion=1, with_normals=yes, certify=yes) as s:
        assert s.settle().normals is not None


def test_a_timeout_of_a_solve_has_its_reason() -> None:
    y, x = np.mgrid[0:60, 0:60]
    corner = (np.arange(59)[:, None] * 60 + np.arange(59)).reshape(-1)
    faces = np.concatenate([np.stack([corner, corner + 1, corner + 60], 1), np.stack([corner + 1, corner + 61, corner + 60], 1)])
    vertices = np.stack([x, y, 0 * x], -1).reshape(-1, 3).astype(float)
    right = RigidMotion(axis=(1, 0, 0), angle=3, center=(59, 30, 0))
    handles = {"left": vertices[:, 0] == 0, "right": (vertices[:, 0] == 59, right)}
    endless = SolverSettings(search=lpdeform.MinimaSearch(effort=1000))
    with pytest.raises(lpdeform.Timeout) as caught:
        deform(vertices, faces, handles, p=1, solver=endless, timeout=2.5)
    assert (caught.value.reason, caught.value.element, caught.value.limit) == ("SOLVE_TIME_PASSED", "timeout", "2.5 s")


class PyVistas:
    """As PyVista has a mesh: the number of corners before each triangle."""

    def __init__(self, triangles: list[list[int]]) -> None:
        self.points = np.arange(21.0).reshape(7, 3)
        self.faces = np.array([number for triangle in triangles for number in (3, *triangle)])


def test_three_triangles_of_pyvista_are_three() -> None:
    triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 4]]
    assert mesh_arrays(PyVistas(triangles), None)[1].tolist() == triangles
    assert mesh_arrays(V, PyVistas(triangles).faces)[1].tolist() == triangles
    tetrahedron = [3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2]
    assert np.reshape(mesh_arrays(V, tetrahedron)[1], (-1, 3)).tolist()[1] == [2, 3, 0]
    with pytest.raises(lpdeform.InvalidInput, match="may be four triangles, or three"):
        mesh_arrays(V, [3, 0, 1, 2, 3, 4, 5, 6, 3, 4, 5, 1])


def test_cells_may_be_pairs_as_meshio_takes_them() -> None:
    assert mesh_arrays(V, [("triangle", F), ("line", [[0, 1]])])[1].tolist() == F.tolist()  # type: ignore[arg-type]


def test_an_error_goes_to_another_process_whole() -> None:
    error = lpdeform.errors.make(
        Code.INVALID_ARGUMENT, "No.", "ARRAY", "vertex 1", "x", metadata={"a": "b"}, input_seq=3, retry_after=0.5
    )
    back = pickle.loads(pickle.dumps(error))
    assert type(back) is lpdeform.InvalidInput and str(back) == str(error) and vars(back) == vars(error)


def energy_held_at(vertex: int) -> float:
    return float(deform(V, F, {"a": [vertex]}).energy)


def test_a_pool_raises_what_its_process_raised() -> None:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        with pytest.raises(LpdeformError) as caught:
            pool.map(energy_held_at, [0, 9])
    assert caught.value.element == "vertex 9"


def test_in_the_child_of_a_fork_sessions_of_the_parent_are_closed() -> None:
    s = session(p=1.5)
    s.settle()
    calls: list[Callable[[], object]] = [
        lambda: s.move("a", translation=[0, 0, 1], timeout=1),
        lambda: s.solve(timeout=1),
        lambda: s.settle(timeout=1),
        lambda: s.undo(),
        lambda: s.take_over(),
    ]
    with s._link.changed:  # as if another thread held it
        child = os.fork()
    if child == 0:
        told = []
        for call in calls:
            try:
                call()
                told.append("")
            except LpdeformError as error:
                told.append(error.reason)
        s.close()
        energy = deform(V, F, H).energy
        os._exit(0 if told == ["SESSION_CLOSED"] * len(calls) and energy >= 0 else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert s.move("a", translation=[0, 0, 1]).is_final
    s.close()


def test_deform_takes_vertices_as_they_are_and_leaves_them_so() -> None:
    from lpdeform.opening import checked_mesh

    given = checked_mesh(V, F, None, lpdeform.Settings(), "cotangent", "error", False, copies=False)
    assert np.shares_memory(given.vertices, V) and not np.shares_memory(given.faces, F)
    kept = V.copy()
    kept.setflags(write=False)
    result = deform(kept, F, H)
    assert not np.shares_memory(result.positions, kept) and np.array_equal(kept, V)


def test_faces_may_lie_in_records_as_a_ply_file_has_them() -> None:
    records = np.zeros(len(F), np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    records["corners"] = F
    assert not records["corners"].flags.aligned
    assert deform(V, records["corners"], H).energy == deform(V, F, H).energy
