"""Types of inputs and results. An array may be anything that NumPy accepts, and is copied at the call.

Vertices may be given as indices or as a boolean mask over all vertices: `vertices[:, 2] < 0.1`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, Protocol, Union

import numpy as np
import numpy.typing as npt

from lpdeform._picture import plot, table_of

Vector3 = Union[Sequence[float], npt.NDArray[Any]]
Floats = npt.NDArray[np.floating[Any]]
Group = Union[npt.ArrayLike, Callable[[npt.NDArray[Any]], npt.ArrayLike]]
"""Vertices: indices, a boolean mask over all vertices, or a function that gets the n x 3 vertices and returns either."""
Triangles = Union[npt.ArrayLike, Sequence[Any]]
"""m x 3 indices; PyVista's faces, with 3 before each triangle; or meshio's cells."""
Method = Literal["auto", "quasi_newton", "line_search", "local_global", "conic", "multiresolution"]
InitialGuess = Literal["current", "laplacian", "rest"]
WeightKind = Literal["cotangent", "uniform", "intrinsic_delaunay"]
FreeComponents = Literal["error", "stay", "follow"]
Encoding = Literal["float64", "float32", "quantized", "compressed"]
Connection = Literal["idle", "connected", "reconnecting", "closed"]


class VerticesMesh(Protocol):
    """A MeshFile, or a mesh of trimesh."""

    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...


class PointsMesh(Protocol):
    """A mesh of meshio or PyVista."""

    @property
    def points(self) -> Any: ...


class BufferMesh(Protocol):
    """A mesh of Polyscope."""

    def get_buffer(self, buffer_name: str) -> Any: ...


Mesh = Union[npt.ArrayLike, VerticesMesh, PointsMesh, BufferMesh]
"""n x 3 vertices, or a mesh with its faces."""


@dataclass(frozen=True)
class FrameOptions:
    """What frames a session is sent: the arguments of open()."""

    encoding: Encoding = "float32"
    lowest_encoding: Encoding | None = None
    credit: int = 0
    with_distortion: bool = True
    with_normals: bool = False
    max_frames_per_second: float = 0.0
    certify: bool = False


@dataclass(frozen=True)
class Fixed:
    """Stays where the rest mesh has it."""


@dataclass(frozen=True)
class RigidMotion:
    """x = R (p - center) + center + translation for every vertex of the handle; always relative to the rest mesh."""

    axis: Vector3 = (0.0, 0.0, 1.0)
    """Of any length but 0."""
    angle: float = 0.0
    """Radians, counter-clockwise seen against the axis."""
    center: Vector3 = (0.0, 0.0, 0.0)
    translation: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Targets:
    """Absolute positions, k x 3, in the order of the handle's vertices or points."""

    positions: npt.ArrayLike


Motion = Union[Fixed, RigidMotion, Targets]


@dataclass(frozen=True)
class Exact:
    """Held exactly at its targets, which its motion gives."""


@dataclass(frozen=True)
class Soft:
    """Pulled towards its targets: 0 has no effect, 1 is about as strong as one edge of the surface. 0 to 1e6."""

    weight: float = 1.0


@dataclass(frozen=True)
class Orientation:
    """Rotated by the handle's motion, with a free position. For vertices only, without targets. 0 to 1e6."""

    weight: float = 100.0


@dataclass(frozen=True)
class AxisLock:
    """Each vertex is free along a line through its target. For vertices only."""

    axis: Vector3 = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class PlaneLock:
    """Each vertex is free within a plane through its target. For vertices only."""

    normal: Vector3 = (0.0, 0.0, 1.0)


Hold = Union[Exact, Soft, Orientation, AxisLock, PlaneLock]


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points inside faces of the rest mesh: for each point a face, and three barycentric coordinates in the order of its
    corners."""

    faces: npt.ArrayLike
    barycentric: npt.ArrayLike
    """k x 3, each at least 0, with a sum of 1 per row, both to within 1e-6."""


@dataclass(frozen=True, eq=False)
class Handle:
    """A group of vertices, or of points inside faces, that the user holds. A vertex belongs to one handle at most."""

    vertices: Group = ()
    motion: Motion = Fixed()
    hold: Hold = Exact()
    points: SurfacePoints | None = None
    """Used instead of vertices; held exactly or soft."""
    footprint: float = 0.0
    """Radius, along the surface, of a region around the handle that moves with it nearly rigidly, against spikes. 0: none."""


@dataclass(frozen=True)
class Removal:
    """Removes a handle."""


@dataclass(frozen=True)
class Automatic:
    """p or stiffness from the shape's geometry, computed where the session is: joints are soft, parts are rigid."""

    strength: float = 1.0
    """0 to 1; 0 is p = 2 and stiffness 1 everywhere."""


Field = Union[float, npt.ArrayLike, Automatic]
"""The same number everywhere, one per vertex, or computed from the geometry."""


@dataclass(frozen=True)
class MinimaSearch:
    """How far to look for lower minima once the first one is found. The energy is not convex: it has many minima, above all
    where p is below 2."""

    effort: int | None = None
    """The number of further starts is 12 times the effort, 0 to 1000. 0 takes the first minimum. None takes 1 if the method is
    "auto" and p is below 2 somewhere, and for solve() if it also starts cold, which is not from an earlier result; otherwise 0.
    A start takes up to two or three times as long as the first minimum. Meshes of fewer than 100 vertices are not searched.
    Meshes of more than 15,000 vertices are searched on their coarse levels, and only what is lower there is tried on the mesh
    itself, as one further start.

    solve() finds the first minimum, then searches with what is left of its limits, and then returns. A session whose frames are
    read shows the first minimum, and searches when nothing changes for a second. solve() makes it forget the shape that it has
    announced: take_better_shape() then raises NO_BETTER_SHAPE, and the session searches again."""
    show: bool = False
    """What the session does with a lower minimum that it has found then. False: a notice "better_shape" announces it, and
    take_better_shape() shows it. True: it is shown at once, as a new frame for the same update."""
    least_share: float = 0.0
    """The share of the energy that must be saved for this, 0 to 1; 0 means 0.02."""


@dataclass(frozen=True)
class SolverSettings:
    """How a solve is made and when it stops. This is a single setting and is replaced as a whole. 0 takes the
    default."""

    method: Method = "auto"
    tolerance: float = 0.0
    """1e-14 to 0.1."""
    max_iterations: int = 0
    time_limit: float = 0.0
    """Seconds; 0 is without limit."""
    initial: InitialGuess = "current"
    search: MinimaSearch | None = None
    """None: all its fields have their defaults."""


@dataclass(frozen=True, eq=False)
class Settings:
    """A setting that is None keeps its value."""

    p: Field | None = None
    """1 to 64."""
    stiffness: Field | None = None
    """1e-6 to 1e6."""
    length_unit: float | None = None
    """The unit of length for mixed norms, in the mesh's unit; 0 takes the mean rest edge length."""
    solver: SolverSettings | None = None
    region: npt.ArrayLike | None = None
    """The vertices that may move; all others stay where they are. Empty: everything may move again."""


@dataclass(frozen=True)
class Resize:
    """A scaling by different factors along three axes. Salient parts keep their shape and size.

    It makes the handle "resize", which holds the ends along scaled axes, and sets p and stiffness unless the same update sets
    them. Along the other axes the extent changes, unless plane locks hold the ends there.
    """

    scale: Vector3
    """Along the axes, relative to the rest mesh; each 0.01 to 100."""
    origin: Vector3 | None = None
    """The point that stays in place; the default is the middle of the mesh's bounding box."""
    axes: tuple[Vector3, Vector3] | None = None
    """Directions of the first and second axis, of any length; the default is x and y of the mesh."""


Change = Union[Handle, Fixed, RigidMotion, Targets, Removal]
"""A Handle adds or replaces, a motion moves, a Removal removes."""


@dataclass(frozen=True, eq=False)
class Update:
    """A change of handles and settings, accepted or refused as a whole."""

    handles: Mapping[str, Change] = field(default_factory=dict)
    settings: Settings = Settings()
    resize: Resize | None = None
    begins_step: bool = False
    """Whether its effect on handles begins a new step for undo(). Set it when a drag begins."""


@dataclass(frozen=True)
class Defect:
    """One kind of defect of a mesh."""

    kind: str
    count: int
    first: tuple[int, ...]
    """The first few by index; an edge is two vertex indices."""


@dataclass(frozen=True)
class MeshReport:
    """What was found of the mesh."""

    vertices: int
    faces: int
    edges: int
    components: int
    boundary_loops: int
    defects: tuple[Defect, ...]
    """Every kind, also those with count 0."""
    welded_vertices: int
    """How many vertices are copies of an earlier one."""
    notices: tuple[str, ...]
    """What users should know before they deform the mesh, one sentence each: for example that it comes apart where it is
    split."""


def mesh_notices(defects: Iterable[Defect]) -> tuple[str, ...]:
    """The same texts as in client/cpp/mesh_notices.h."""
    return tuple(
        f"The mesh comes apart where it is split: {defect.count} vertices at its borders lie in the same place as others "
        f"(vertices {', '.join(map(str, defect.first))}{', ...' if defect.count > len(defect.first) else ''}). "
        "Weld it by position to hold it together there."
        for defect in defects
        if defect.kind == "split_border_vertices" and defect.count > 0
    )


@dataclass(frozen=True)
class Notice:
    """What a server says about itself, or about the session's surface; nothing has failed."""

    reason: Literal["overloaded", "recovered", "better_shape", "other"]
    """After "overloaded" frames come less often, and the last frame of an update comes later, until "recovered". "better_shape":
    a shape of lower energy is known for the newest update, and take_better_shape() shows it. "other": from a newer server."""
    text: str
    """One sentence for people."""
    input_seq: int = 0
    """Of a better shape: the update that it is for. The notice ends with a frame for a later update or a frame of the
    shape."""
    energy: float = 0.0
    """Of a better shape."""
    saved_share: float = 0.0
    """Of a better shape: the share of the present energy that it saves, 0 to 1."""


class BetterShape(NamedTuple):
    """A better shape that was taken."""

    input_seq: int
    """The update that the shape is for."""
    energy: float


class IterationRecord(NamedTuple):
    iteration: int
    seconds: float
    energy: float
    """The true energy."""
    objective: float
    """What the method minimises, in its own unit."""
    stage: int


class SolveProgress(NamedTuple):
    iteration: int
    energy: float
    seconds: float


@dataclass(frozen=True, eq=False, repr=False)
class SolveResult:
    """A finished solve. Arrays are read-only; copy them to change them."""

    positions: Floats
    """n x 3, float64."""
    distortion: Floats
    """n, float64: E_i of each vertex."""
    normals: Floats
    """n x 3, or 0 x 3 if they were not requested."""
    method: str
    stop_reason: str
    iterations: int
    initial_energy: float
    energy: float
    soft_energy: float
    optimality_gap: float | None
    """(E - lower bound) / E of the convex problem with its rotations held, if it was requested."""
    setup_seconds: float
    solve_seconds: float
    threads: int
    input_seq: int
    minima: tuple[float, ...]
    """The energies of minima, in order: the first one, then one for each start of the search for lower ones (see MinimaSearch)
    that has converged, or has come back to the lowest minimum, whose energy it then has. Several starts may come to the same
    minimum. Starts that were given up have no entry. `energy` is the lowest. Empty if a limit has ended the solve before the
    first."""
    further_starts: int
    """How many further starts the search made, including those that were given up."""
    search_iterations: int
    """The part of `iterations` that the search made."""
    effort: int
    """The effort of the search: the one asked for, or the default."""
    trace: tuple[IterationRecord, ...]
    p: float | Floats | None = None
    """The p that was used: one number, or one per vertex; None if a server computed it from the geometry."""
    faces: npt.NDArray[Any] | None = None
    """m x 3: the triangles that were given, for plot(). None in a session that was joined or restored."""

    def plot(
        self, faces: npt.ArrayLike | None = None, *, backend: Literal["pyvista", "matplotlib"] | None = None, show: bool = True
    ) -> Any:
        """The surface, coloured by distortion up to its 95th percentile. Returns a pyvista.Plotter or a Matplotlib figure,
        whichever library is there; `backend` chooses. Raises UNIMPLEMENTED (NO_PLOTTER) if neither is."""
        return plot(self, self.faces if faces is None else np.asarray(faces), backend, show)

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        return table_of(self)

    @property
    def searched(self) -> str:
        """What was searched, in one line for people. `optimality_gap` does not say it: it is about the rotations of the result, and
        another minimum may be lower. An energy that is at most 0.1 % above the next lower one is not counted."""
        minima = sorted(self.minima)
        if not minima and self.stop_reason in ("converged", "stalled"):  # a server that is older than the search
            return "the server does not say whether it looked for other minima"
        if not minima:
            return "the solve ended before a first minimum, and no other was looked for"
        if self.further_starts == 0 and self.search_iterations > 0:
            return "the search for lower minima ended before its first start did"
        if self.further_starts == 0:
            return f"no other minima were looked for (effort {self.effort})"
        count = 1 + sum(high > 1.001 * low for low, high in zip(minima, minima[1:], strict=False))
        starts = f"{self.further_starts} further start{'s' if self.further_starts > 1 else ''}"
        energies = f"1 energy were seen, E = {minima[0]:.6g}"
        if count > 1:
            energies = f"{count} energies were seen, E from {minima[0]:.6g} to {minima[-1]:.6g}"
        return f"looked for lower minima from {starts}, of which {len(minima) - 1} ended in a minimum; minima of {energies}"

    def __repr__(self) -> str:
        gap = "" if self.optimality_gap is None else f", gap {self.optimality_gap:.2g} for its rotations"
        return (
            f"<SolveResult of {len(self.positions)} vertices: {self.stop_reason} after {self.iterations} iterations of "
            f"{self.method}, energy {self.energy:.6g}{gap}; {self.searched}>"
        )
