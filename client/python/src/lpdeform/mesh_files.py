"""Mesh files that keep what is in them beside the mesh."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import numpy.typing as npt

from lpdeform._numbers import indices, number, numbers
from lpdeform.errors import Code, invalid, make

if TYPE_CHECKING:
    from types import ModuleType

    from lpdeform._core import MeshFile as NativeFile

Path = Union[str, "os.PathLike[str]"]


@dataclass(frozen=True)
class MeshPart:
    """The vertices first to first + count - 1, which one node of a glTF file draws. Names are "" where the file has none."""

    node: str
    mesh: str
    first: int
    count: int


class MeshFile:
    """A file that read_mesh() has read: its mesh, and everything else in it, which stays when it is written.

    open() and deform() take it in the place of vertices and faces. They weld a mesh of a GLB or glTF file unless `weld` says
    otherwise, because that format splits vertices along seams. Immutable.
    """

    def __init__(self, file: NativeFile) -> None:
        """For read_mesh()."""
        self._file = file
        self._vertices, self._faces = file.vertices(), file.faces().view(np.uint32)

    @property
    def vertices(self) -> npt.NDArray[np.float64]:
        """n x 3, read-only; of a glTF file where its scene has them. In the order of the file; an STL file has none."""
        return self._vertices

    @property
    def faces(self) -> npt.NDArray[np.uint32]:
        """m x 3, read-only; polygons are cut into triangles."""
        return self._faces

    @property
    def splits_vertices(self) -> bool:
        """Whether the format of the file splits vertices along seams, as GLB and glTF do."""
        return self._file.splits_vertices

    @property
    def groups(self) -> Mapping[str, npt.NDArray[np.uint32]]:
        """Of a glTF file: the vertices of each node, mesh and material by its name, ascending. Otherwise empty."""
        return self._file.groups()

    @property
    def parts(self) -> tuple[MeshPart, ...]:
        """Of a glTF file: which vertices each node draws. Otherwise empty."""
        return tuple(MeshPart(*part) for part in self._file.parts())

    @property
    def notices(self) -> tuple[str, ...]:
        """What a glTF file draws and what stays as it is, such as lines, one sentence each."""
        return tuple(self._file.notices())

    def write(
        self,
        path: Path,
        positions: npt.ArrayLike,
        *,
        adds_normals: bool = False,
        weld: float | bool | None = None,
    ) -> None:
        """Writes the file with other positions, completely or not at all.

        path: ends in .glb, .gltf, .off, .obj or .ply. What is beside the mesh is kept if both files are GLB or glTF, or both OBJ.
            Then positions change, normals and tangents turn as the surface turns, and everything else comes back to the bit.
        positions: n x 3, one for each of `vertices`: `positions` of a result or of a frame.
        adds_normals: GLB, glTF and OBJ get normals even if the file has none.
        weld: as in open(), for normals. None: as open() does by default.

        Raises InvalidInput: POSITIONS_SIZE, MESH_FORMAT_UNKNOWN, MESH_NOT_FINITE; for GLB and glTF MESH_UNSUPPORTED (a position
        beyond the range of float32, in which glTF has numbers, or a file that would be too large) and MESH_SYNTAX (a part that is
        wrong, or an image whose file has gone since); for a new GLB or glTF, and for normals of an OBJ, MESH_EMPTY,
        MESH_INDEX_OUT_OF_RANGE and MESH_NO_AREA; for normals WELD_TOLERANCE and WELD_TOO_DENSE. FILE_NOT_WRITTEN.
        """
        points = numbers(positions, "positions", 3)
        if len(points) != len(self._vertices):
            text = f"There are {len(points)} positions, and the file has {len(self._vertices)} vertices."
            raise invalid(text, "POSITIONS_SIZE", "positions", f"length = {len(self._vertices)}")
        weld = self.splits_vertices if weld is None else weld
        if isinstance(weld, (bool, np.bool_)):
            tolerance = 0.0 if weld else None
        else:
            tolerance = number(weld, "weld")
        self._file.write(_text(path), points.astype(np.float64), bool(adds_normals), tolerance)

    def __repr__(self) -> str:
        return f"<MeshFile of {len(self._vertices)} vertices and {len(self._faces)} faces>"


def read_mesh(path: Path) -> MeshFile:
    """Reads a GLB, glTF, OFF, OBJ, PLY or STL file, by the ending of its name.

    The mesh of a GLB or glTF is what the scene draws as triangles, each node where it stands; skins stand as they were bound, and
    morph targets and animations are not applied. Files that a .gltf names are read if they lie in its folder.

    Raises MESH_FILE_NOT_FOUND; InvalidInput: MESH_FORMAT_UNKNOWN, MESH_SYNTAX and MESH_UNSUPPORTED, which name the line, the byte or
    the part of the file, such as `accessor 3`; NO_SOLVER in a package without the compiled module.
    """
    return MeshFile(_native().read_mesh_file(_text(path)))


def write_mesh(path: Path, vertices: npt.ArrayLike, faces: npt.ArrayLike) -> None:
    """Writes a file with this mesh and nothing else, completely or not at all: .glb, .gltf, .off, .obj or .ply.

    MeshFile.write() keeps what a file has beside its mesh. Raises InvalidInput: INDEX_OUT_OF_RANGE,
    MESH_INDEX_OUT_OF_RANGE, MESH_FORMAT_UNKNOWN, MESH_NOT_FINITE, and for .glb and .gltf MESH_EMPTY, MESH_NO_AREA and
    MESH_UNSUPPORTED; FILE_NOT_WRITTEN; NO_SOLVER as read_mesh().
    """
    points = numbers(vertices, "vertices", 3).astype(np.float64)
    triangles = indices(faces, "faces", 3, below=len(points))
    if triangles.size and (most := int(triangles.max())) >= len(points):
        face = f"face {int(np.flatnonzero(triangles == most)[0]) // 3}"
        limit = f"0 <= index < {len(points)}"
        raise invalid(f"{face.capitalize()} has the vertex {most}.", "MESH_INDEX_OUT_OF_RANGE", face, limit)
    _native().write_mesh_file(_text(path), points, triangles)


def _text(path: Any) -> str:
    try:
        text = os.fspath(path)
    except TypeError:
        text = None
    if not isinstance(text, str):
        raise invalid(f"The path is of type {type(path).__name__}.", "ARRAY_TYPE", "path", "str or a path")
    try:
        text.encode()
    except UnicodeEncodeError:
        raise invalid(f"The path {text!r} cannot be said in UTF-8.", "NAME_ENCODING", "path", "UTF-8") from None
    if "\0" in text:
        raise invalid(f"The path {text!r} has a zero in it.", "NAME_ENCODING", "path", "no zero")
    return text


def _native() -> ModuleType:
    try:
        return import_module("lpdeform._core")
    except ImportError:
        text = "This wheel of lpdeform has no compiled module, which reads and writes mesh files."
        raise make(Code.UNIMPLEMENTED, text, "NO_SOLVER", "path") from None
