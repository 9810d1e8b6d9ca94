"""lpdeform.deform(), and what callers may give: meshes of other libraries, groups, progress, and how a result is shown."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from importlib import import_module
from importlib.util import find_spec
from types import SimpleNamespace

import meshio
import numpy as np
import polyscope
import pytest
import trimesh

import lpdeform
from conftest import PATIENCE, Grid, Place, grid


def test_one_call_gives_the_result_with_p_gap_trace_and_reason(place: Place, shape: Grid) -> None:
    up = lpdeform.RigidMotion(translation=(0, 0, 3))
    result = lpdeform.deform(
        shape.vertices, shape.faces, {"left": shape.left, "right": (shape.right, up)}, p=1, address=place.address
    )
    assert result.stop_reason == "converged"
    assert result.positions.dtype == np.float64
    assert np.array_equal(result.positions[shape.right], shape.vertices[shape.right] + [0, 0, 3])
    assert result.distortion.shape == (144,)
    assert result.p == 1
    assert result.optimality_gap is not None
    assert result.optimality_gap < 1e-3
    assert result.trace[-1].energy == pytest.approx(result.trace[0].energy, rel=1) and len(result.trace) > 1


def test_it_is_what_a_session_gives(place: Place, shape: Grid) -> None:
    targets = shape.vertices[shape.right] + [1, 0, 2]
    p = np.where(shape.vertices[:, 0] < 5, 1.5, 2.0)
    one = lpdeform.deform(
        shape.vertices, shape.faces, {"left": shape.left, "right": (shape.right, targets)}, p=p, address=place.address
    )
    with lpdeform.open(shape.vertices, shape.faces, p=p, address=place.address) as session:
        session.set_handle("left", shape.left)
        session.set_handle("right", shape.right, lpdeform.Targets(targets))
        other = session.solve()
    assert one.energy == pytest.approx(other.energy, rel=1e-4)  # the tolerance, from other starts
    assert np.array_equal(np.asarray(one.p), p)


@pytest.mark.parametrize("kind", ["mask", "indices", "list", "function", "function of indices"])
def test_a_group_is_a_mask_indices_or_a_function(place: Place, shape: Grid, kind: str) -> None:
    groups = {
        "mask": shape.left,
        "indices": np.flatnonzero(shape.left),
        "list": [int(k) for k in np.flatnonzero(shape.left)],
        "function": lambda v: v[:, 0] < 0.5,
        "function of indices": lambda v: np.flatnonzero(v[:, 0] < 0.5),
    }
    handles = {"left": groups[kind], "right": lpdeform.Handle(shape.right, lpdeform.RigidMotion(translation=(0, 0, 1)))}
    result = lpdeform.deform(shape.vertices, shape.faces, handles, address=place.address)
    assert np.array_equal(result.positions[shape.left], shape.vertices[shape.left])
    with lpdeform.open(shape.vertices, shape.faces, address=place.address) as session:
        session.set_handle("left", groups[kind])
        assert session.settle(PATIENCE).is_final


def test_a_mask_of_the_wrong_length_is_refused(place: Place, shape: Grid) -> None:
    for mask in ([True, False, True], np.ones(143, bool), lambda v: np.ones(len(v) + 1, bool)):
        with pytest.raises(lpdeform.InvalidInput) as caught:
            lpdeform.deform(shape.vertices, shape.faces, {"left": mask}, address=place.address)
        assert (caught.value.reason, caught.value.limit) == ("MASK_SIZE", "length = 144")
        assert "left" in caught.value.element


def test_errors_name_element_and_limit(place: Place, shape: Grid) -> None:
    with pytest.raises(lpdeform.InvalidInput) as caught:
        lpdeform.deform(shape.vertices, shape.faces, {"left": [144]}, address=place.address)
    assert (caught.value.reason, caught.value.element, caught.value.limit) == (
        "HANDLE_VERTEX_OUT_OF_RANGE",
        "vertex 144",
        "0 <= vertex < 144",
    )
    with pytest.raises(lpdeform.InvalidInput) as caught:
        lpdeform.deform(shape.vertices, shape.faces, {"left": [0]}, p=0.5, address=place.address)
    assert caught.value.reason == "P_OUT_OF_RANGE"
    vertices = shape.vertices.copy()
    vertices[17, 1] = np.nan
    with pytest.raises(lpdeform.InvalidInput) as caught:
        lpdeform.deform(vertices, shape.faces, {"left": [0]}, address=place.address)
    assert (caught.value.reason, caught.value.element) == ("MESH_NOT_FINITE", "vertex 17")
    two = np.concatenate([shape.vertices, shape.vertices + [0, 0, 9]])
    with pytest.raises(lpdeform.LpdeformError) as free:
        lpdeform.deform(two, np.concatenate([shape.faces, shape.faces + 144]), {"left": [0]}, address=place.address)
    assert free.value.reason == "COMPONENT_WITHOUT_HANDLE"


def poly_data(shape: Grid) -> object:
    """A mesh of PyVista, or, where PyVista is not there, an object with the attributes of one."""
    if find_spec("pyvista"):
        return import_module("pyvista").PolyData.from_regular_faces(shape.vertices, shape.faces)
    counted = np.column_stack([np.full(len(shape.faces), 3), shape.faces]).ravel()
    return SimpleNamespace(points=shape.vertices.astype(np.float32), faces=counted)


def unstructured_grid(shape: Grid, corners: int = 3) -> object:
    counted = np.column_stack([np.full(len(shape.faces), 3), shape.faces]).ravel()
    types = np.full(len(shape.faces), 5, np.uint8)
    if corners == 4:
        counted, types = np.concatenate([[4, 0, 1, 13, 12], counted]), np.concatenate([[np.uint8(9)], types])
    if find_spec("pyvista"):
        return import_module("pyvista").UnstructuredGrid(counted, types, shape.vertices)
    return SimpleNamespace(points=shape.vertices, cells=counted, celltypes=types)


def polyscope_mesh(vertices: object, faces: object) -> object:
    polyscope.set_use_prefs_file(False)
    polyscope.init("openGL_mock")
    return polyscope.register_surface_mesh("mesh", vertices, faces)


def meshes(shape: Grid) -> dict[str, object]:
    cells = [("vertex", [[0]]), ("line", [[0, 1]]), ("triangle", shape.faces[:100]), ("triangle", shape.faces[100:])]
    solid = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    return {
        "trimesh": solid,
        "trimesh_scene": trimesh.Scene([solid]),
        "meshio": meshio.Mesh(shape.vertices, cells),
        "pyvista": poly_data(shape),
        "pyvista_grid": unstructured_grid(shape),
        "polyscope": polyscope_mesh(shape.vertices, shape.faces),
    }


LIBRARIES = ["trimesh", "trimesh_scene", "meshio", "pyvista", "pyvista_grid", "polyscope"]


@pytest.mark.parametrize("library", LIBRARIES)
def test_meshes_of_other_libraries_are_taken_as_they_are(shape: Grid, library: str) -> None:
    handles = {"left": shape.left, "right": (shape.right, shape.vertices[shape.right] + [0, 0, 2])}
    result = lpdeform.deform(meshes(shape)[library], handles=handles)  # type: ignore[arg-type]
    plain = lpdeform.deform(shape.vertices, shape.faces, handles)
    assert np.abs(result.positions - plain.positions).max() < 1e-6  # float32
    with lpdeform.open(meshes(shape)[library]) as session:  # type: ignore[arg-type]
        assert session.mesh_report.faces == len(shape.faces)


def test_parts_of_other_libraries_meshes_are_taken_as_faces(shape: Grid) -> None:
    for library, name in (("meshio", "cells"), ("pyvista", "faces")):
        with lpdeform.open(shape.vertices, getattr(meshes(shape)[library], name)) as session:
            assert session.mesh_report.faces == len(shape.faces)


def test_what_is_no_triangle_mesh_is_refused_by_name(shape: Grid) -> None:
    refused = (
        (meshio.Mesh(shape.vertices, [("quad", [[0, 1, 2, 3]])]), "quad"),
        (unstructured_grid(shape, corners=4), "type 9"),
        (polyscope_mesh(shape.vertices, [[0, 1, 13, 12]]), "no triangles"),
        (SimpleNamespace(), "SimpleNamespace"),
        (shape.vertices, "ndarray"),
    )
    for mesh, said in refused:
        with pytest.raises(lpdeform.InvalidInput, match=said):
            lpdeform.open(mesh)  # type: ignore[arg-type]


def test_numbers_come_back_without_a_copy_and_input_may_have_any_layout(shape: Grid) -> None:
    handles = {"left": shape.left, "right": (shape.right, shape.vertices[shape.right] + [0, 0, 2])}
    plain = lpdeform.deform(shape.vertices, shape.faces, handles)
    assert not plain.positions.flags.owndata
    assert not plain.positions.flags.writeable
    for vertices in (np.asfortranarray(shape.vertices), shape.vertices[::-1][::-1], shape.vertices.tolist()):
        same = lpdeform.deform(vertices, shape.faces.astype(np.int32), handles)
        assert np.array_equal(same.positions, plain.positions)


def slow() -> tuple[Grid, lpdeform.Session]:
    """A session whose solve takes long."""
    shape = grid(150)
    settings = lpdeform.SolverSettings(method="line_search", tolerance=1e-14, search=lpdeform.MinimaSearch(effort=0))
    session = lpdeform.open(shape.vertices, shape.faces, p=1.5, solver=settings)
    session.set_handles({"left": lpdeform.Handle(shape.left)})
    turn = lpdeform.RigidMotion((1, 0, 0), 2.0, (149, 75, 0), (-40, 0, 30))
    session.set_handles({"right": lpdeform.Handle(shape.right, turn)})
    return shape, session


@pytest.mark.parametrize("timeout", [-1.0, float("nan")])
def test_a_time_that_is_none_is_refused(shape: Grid, timeout: float) -> None:
    with pytest.raises(lpdeform.InvalidInput, match="SECONDS_OUT_OF_RANGE"):
        lpdeform.deform(shape.vertices, shape.faces, {"left": shape.left}, timeout=timeout)


def test_an_interrupt_ends_a_solve_soon_and_the_session_goes_on() -> None:
    shape, session = slow()
    with session:
        timer = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
        begun = time.monotonic()
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            session.solve()
        assert time.monotonic() - begun < 1.0 + 5.0  # an iteration here takes a fraction of a second
        session.set(p=2, solver=lpdeform.SolverSettings(max_iterations=3))
        assert session.solve(timeout=PATIENCE).stop_reason == "iteration_limit"


def test_the_interpreter_runs_while_a_solve_does() -> None:
    class Enough(Exception):
        pass

    _, session = slow()
    with session:
        thread = threading.Thread(target=lambda: time.sleep(0.1))
        told: list[float] = []

        def tell(_: lpdeform.SolveProgress) -> None:
            told.append(time.monotonic())
            if len(told) >= 5 and not thread.is_alive():
                raise Enough

        begun = time.monotonic()
        with pytest.raises(Enough):
            thread.start()
            session.solve(progress=tell, timeout=PATIENCE)
        assert all(at >= begun + 0.1 * count for count, at in enumerate(told, 1))  # at most ten times a second


def test_progress_takes_a_function_or_true(shape: Grid, capsys: pytest.CaptureFixture[str]) -> None:
    handles = {"left": shape.left, "right": (shape.right, shape.vertices[shape.right] + [0, 0, 2])}
    assert lpdeform.deform(shape.vertices, shape.faces, handles, progress=True).stop_reason == "converged"
    with pytest.raises(lpdeform.InvalidInput):
        lpdeform.deform(shape.vertices, shape.faces, handles, progress=3)  # type: ignore[arg-type]


def test_a_result_is_shown_as_a_table_and_as_a_picture(shape: Grid, monkeypatch: pytest.MonkeyPatch) -> None:
    handles = {"left": shape.left, "right": (shape.right, shape.vertices[shape.right] + [0, 0, 2])}
    result = lpdeform.deform(shape.vertices, shape.faces, handles, p=np.linspace(1, 2, 144))
    table = result._repr_html_()
    for said in ("<table>", "144", "1 to 2", "converged", f"{result.energy:.6g}"):
        assert said in table
    monkeypatch.setattr("lpdeform._picture.find_spec", lambda _: None)
    with pytest.raises(lpdeform.LpdeformError, match="pip install") as caught:
        result.plot(show=False)
    assert caught.value.reason == "NO_PLOTTER"


def run_without(modules: str, program: str) -> str:
    """The output of a program in an interpreter that finds none of these modules."""
    hidden = f"import sys\nfor name in {modules.split()!r}:\n    sys.modules[name] = None\n"
    done = subprocess.run(
        [sys.executable, "-c", hidden + textwrap.dedent(program)], capture_output=True, text=True, timeout=PATIENCE, check=True
    )
    return done.stdout


def test_without_grpcio_and_protobuf_only_an_address_is_refused() -> None:
    said = run_without(
        "grpc google.protobuf",
        """
        import lpdeform
        square = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2]]
        print(lpdeform.deform(*square, {"all": [0, 1, 2, 3]}).stop_reason)
        try:
            lpdeform.open(*square, address="localhost:1")
        except lpdeform.LpdeformError as error:
            print(error.reason, error)
        """,
    )
    assert said.startswith("converged\nNO_REMOTE")
    assert "pip install lpdeform[remote]" in said


def test_a_process_ends_while_sessions_are_open_and_forks_begin_anew() -> None:
    said = run_without(
        "nothing",
        """
        import os
        import lpdeform
        square = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2]]
        s = lpdeform.open(*square)
        s.set_handle("all", [0, 1])
        s.settle()
        child = os.fork()
        if child == 0:
            print(lpdeform.deform(*square, {"all": [0, 1, 2, 3]}).stop_reason, flush=True)
            os._exit(0)
        print(os.waitpid(child, 0)[1], flush=True)
        """,
    )
    assert said.split() == ["converged", "0"]


def test_a_token_without_an_address_is_refused(shape: Grid) -> None:
    with pytest.raises(lpdeform.InvalidInput) as caught:
        lpdeform.open(shape.vertices, shape.faces, token="secret")
    assert (caught.value.reason, caught.value.element) == ("ARGUMENT_MISSING", "address")


def test_files_are_for_servers(shape: Grid) -> None:
    with lpdeform.open(shape.vertices, shape.faces) as session:
        for call in (session.snapshot, lambda: lpdeform.restore(b"lpdeform")):
            with pytest.raises(lpdeform.LpdeformError) as caught:
                call()
            assert caught.value.reason == "NO_SNAPSHOT"
        session.set_handle("left", shape.left)
        assert session.settle(PATIENCE).is_final
