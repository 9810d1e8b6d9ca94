"""Vertices and triangles of what other libraries call a mesh. None of them is imported: their attributes tell them apart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from lpdeform import types
from lpdeform.errors import invalid

_vtk_triangle = 5


def mesh_arrays(vertices: types.Mesh, faces: types.Triangles | None) -> tuple[Any, Any]:
    """The arrays of a mesh, or those that were given. Other polygons of a mesh are refused."""
    if faces is None:
        if hasattr(vertices, "geometry") and hasattr(vertices, "to_mesh"):
            vertices = vertices.to_mesh()  # a scene of trimesh: all its meshes as one, each where it stands
        return _points_of(vertices), _triangles_of(vertices)
    if isinstance(faces, Mapping):
        text = "The faces are a dict: with a mesh of another library, give handles by name, as handles=."
        raise invalid(text, "ARRAY", "faces", "(k, 3)")
    if isinstance(faces, (list, tuple)) and len(faces) > 0:
        if hasattr(faces[0], "type"):
            return vertices, _of_cells(faces)  # the cells of a mesh of meshio
        if all(isinstance(one, tuple) and len(one) == 2 and isinstance(one[0], str) for one in faces):
            return vertices, _of_cells([_Block(*one) for one in faces])  # as meshio takes them
    return vertices, _without_counts(faces)


class _Block(NamedTuple):
    type: str
    data: Any


def _points_of(mesh: Any) -> Any:
    for name in ("vertices", "points"):  # trimesh; meshio and PyVista
        if hasattr(mesh, name):
            return getattr(mesh, name)
    if hasattr(mesh, "get_buffer"):  # Polyscope
        return np.asarray([_coordinates(one) for one in _buffer(mesh, "vertexPositions")]).reshape(-1, 3)
    text = f"There are no faces, and a {type(mesh).__name__} is no mesh of trimesh, meshio, PyVista or Polyscope."
    raise invalid(text, "ARGUMENT_MISSING", "faces")


def _triangles_of(mesh: Any) -> Any:
    if hasattr(mesh, "celltypes"):  # PyVista's UnstructuredGrid
        return _of_celltypes(mesh.cells, np.asarray(mesh.celltypes))
    if hasattr(mesh, "cells") and not hasattr(mesh, "faces"):  # meshio
        return _of_cells(mesh.cells)
    if hasattr(mesh, "faces"):  # trimesh and PyVista
        return _without_counts(mesh.faces, hasattr(mesh, "points"))
    if hasattr(mesh, "get_buffer"):
        corners = _buffer(mesh, "triangleVertexInds")
        if 3 * mesh.n_faces() != len(corners):
            raise invalid("The mesh of Polyscope has faces that are no triangles.", "ARRAY_SHAPE", "faces", "triangles")
        return np.asarray(corners).reshape(-1, 3)
    raise invalid(f"A {type(mesh).__name__} has no triangles.", "ARGUMENT_MISSING", "faces")


def _of_cells(cells: Any) -> Any:
    """Blocks of cells of meshio. Lines and single vertices are no part of a surface."""
    blocks = [block for block in cells if block.type not in ("line", "vertex")]
    for block in blocks:
        if block.type != "triangle":
            text = f"The mesh has cells of type {block.type}: only triangles can be deformed."
            raise invalid(text, "ARRAY_SHAPE", "cells", "triangle")
    return np.concatenate([np.zeros((0, 3), np.int64), *(np.asarray(block.data) for block in blocks)])


def _of_celltypes(cells: Any, types: Any) -> Any:
    """Cells of VTK, one after another, each after the number of its corners. Its type 5 is a triangle."""
    if not bool((types == _vtk_triangle).all()):
        other = int(types[types != _vtk_triangle][0])
        text = f"The mesh has cells of VTK's type {other}: only triangles (type {_vtk_triangle}) can be deformed."
        raise invalid(text, "ARRAY_SHAPE", "cells", "triangle")
    return np.asarray(cells).reshape(-1, 4)[:, 1:]


def _without_counts(faces: Any, is_counted: bool = False) -> Any:
    """PyVista writes faces one after another, with the number of corners before each. `is_counted`: it is known that these do."""
    try:
        array = np.asarray(faces)
    except (TypeError, ValueError):
        return faces  # refused later, with what is wrong
    if array.ndim != 1 or array.size == 0 or array.dtype.kind not in "iu":
        return faces
    if array.size % 4 == 0 and bool((array[::4] == 3).all()):
        counted = array.reshape(-1, 4)[:, 1:]
        if is_counted or array.size != 12:
            return counted
        # 12 numbers may also be four triangles, as of a tetrahedron.
        may_be, may_be_plain = _have_three_corners(counted), _have_three_corners(array.reshape(-1, 3))
        if may_be and not may_be_plain:
            return counted
        if may_be and set(array.tolist()) != {0, 1, 2, 3}:
            text = "The faces are 12 numbers, which may be four triangles, or three with the number of corners before each."
            raise invalid(text, "ARRAY_SHAPE", "faces", "(k, 3)")
        return faces
    if array.size % 3 != 0:
        text = "The faces are a flat array whose polygons are not all triangles."
        raise invalid(text, "ARRAY_SHAPE", "faces", "(k, 3), or 3 before each triangle")
    return faces


def _have_three_corners(triangles: Any) -> bool:
    return all(len(set(triangle)) == 3 for triangle in triangles.tolist())


def _buffer(mesh: Any, name: str) -> list[Any]:
    buffer = mesh.get_buffer(name)
    return [buffer.get_value(k) for k in range(buffer.size())]


def _coordinates(point: Any) -> Any:
    """Polyscope has points in a type of its own."""
    return point.as_tuple() if hasattr(point, "as_tuple") else point
