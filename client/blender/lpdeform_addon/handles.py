"""Empties that hold vertices, and what the server is told of them."""

import bpy
import numpy as np
from mathutils import Matrix

from . import holds, surface
from .client import lpdeform

_rigid_tolerance = 1e-5  # of the lengths and angles of a matrix, after rounding to float32


def of(ob) -> list:
    """The empties of a mesh object in the scene, one for each number."""
    found = {}
    for one in bpy.context.scene.objects:
        handle = one.lpdeform_handle
        if handle.mesh == ob and handle.number > 0:
            found.setdefault(handle.number, one)
    return list(found.values())


def rest_matrix(empty) -> Matrix:
    """The rest matrix of an empty, in its mesh's own space."""
    flat = empty.lpdeform_handle.rest
    return Matrix([flat[4 * k : 4 * k + 4] for k in range(4)])


def add(ob, vertices: np.ndarray, rest: np.ndarray):
    """Adds an empty at the middle of the vertices; other handles release them. `rest`: positions of the mesh at rest."""
    number, numbers = _next_number(ob), surface.held(ob)
    numbers[vertices] = number
    surface.set_held(ob, numbers)
    return _add_empty(ob, number, rest[vertices].mean(axis=0), rest)


def add_in_faces(ob, faces: np.ndarray, rest: np.ndarray):
    """The same for the middles of faces; other handles release them."""
    number, numbers = _next_number(ob), surface.held_faces(ob)
    numbers[faces] = number
    surface.set_held_faces(ob, numbers)
    return _add_empty(ob, number, surface.middles(ob, faces, rest)[2].mean(axis=0), rest)


def _next_number(ob) -> int:
    used = (surface.held(ob).max(initial=0), surface.held_faces(ob).max(initial=0))
    return max([*map(int, used), *(one.lpdeform_handle.number for one in of(ob))]) + 1


def _add_empty(ob, number: int, middle: np.ndarray, rest: np.ndarray):
    empty = bpy.data.objects.new(f"{ob.name} handle", None)
    (ob.users_collection or (bpy.context.scene.collection,))[0].objects.link(empty)
    empty.empty_display_type = "SPHERE"
    empty.show_in_front = True
    extent = float(np.ptp(rest, axis=0).max())
    empty.empty_display_size = 0.04 * extent
    at_rest = Matrix.Translation(middle.tolist())
    handle = empty.lpdeform_handle
    handle.mesh, handle.number = ob, number
    handle.rest = [value for row in at_rest for value in row]
    empty.matrix_world = ob.matrix_world @ at_rest
    return empty


def put_back(empty) -> None:
    """Puts the empty back to where it holds its vertices at rest."""
    empty.matrix_world = empty.lpdeform_handle.mesh.matrix_world @ rest_matrix(empty)


def remove(empty) -> None:
    """Releases the empty's vertices."""
    handle = empty.lpdeform_handle
    if handle.mesh is not None:
        for read, write in ((surface.held, surface.set_held), (surface.held_faces, surface.set_held_faces)):
            numbers = read(handle.mesh)
            if (numbers == handle.number).any():
                write(handle.mesh, np.where(numbers == handle.number, 0, numbers))
    bpy.data.objects.remove(empty)


def motion_matrix(ob, empty) -> Matrix:
    """The matrix that moves points from rest to where the empty takes them, in the mesh's own space."""
    return ob.matrix_world.inverted_safe() @ empty.matrix_world @ rest_matrix(empty).inverted_safe()


def hold(empty):
    handle = empty.lpdeform_handle
    axis = rest_matrix(empty).to_3x3().col[2].normalized()
    direction = (axis.x, axis.y, axis.z) if axis.length > 0 else (0.0, 0.0, 1.0)
    return holds.KINDS[handle.kind].make(handle.weight, direction)


def motion(matrix: Matrix, points: np.ndarray, is_turned_only: bool):
    """A rigid motion if the matrix is rigid; otherwise a target for each point. Orientations use only the rotation."""
    linear = np.array(matrix.to_3x3())
    is_rigid = np.abs(linear.T @ linear - np.eye(3)).max() < _rigid_tolerance and np.linalg.det(linear) > 0
    if not (is_rigid or is_turned_only):
        return lpdeform.Targets(points @ linear.T + np.array(matrix.translation))
    axis, angle = matrix.to_quaternion().to_axis_angle()
    return lpdeform.RigidMotion(tuple(axis) if axis.length > 0 else (0.0, 0.0, 1.0), angle, translation=tuple(matrix.translation))
