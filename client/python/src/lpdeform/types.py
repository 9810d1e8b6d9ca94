"""What goes in and comes out. Arrays are anything that NumPy takes for one, and are copied when they are given.

Where vertices are meant, indices and boolean masks over all vertices do equally: `vertices[:, 2] < 0.1`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, Union

import numpy as np
import numpy.typing as npt

Vector3 = Union[Sequence[float], npt.NDArray[Any]]
Floats = npt.NDArray[np.floating[Any]]
Method = Literal["auto", "quasi_newton", "line_search", "local_global", "conic", "multiresolution"]
InitialGuess = Literal["current", "laplacian", "rest"]
WeightKind = Literal["cotangent", "uniform", "intrinsic_delaunay"]
FreeComponents = Literal["error", "stay", "follow"]
Encoding = Literal["float64", "float32", "quantized", "compressed"]
Connection = Literal["idle", "connected", "reconnecting", "closed"]


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
    """Drawn to its targets: 0 lets go, 1 is about as strong as one edge of the surface. 0 to 1e6."""

    weight: float = 1.0


@dataclass(frozen=True)
class Orientation:
    """Turned by the rotation of the handle's motion, its position free. Vertices only, no targets. 0 to 1e6."""

    weight: float = 100.0


@dataclass(frozen=True)
class AxisLock:
    """Each vertex free along a line through its target. Vertices only."""

    axis: Vector3 = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class PlaneLock:
    """Each vertex free within a plane through its target. Vertices only."""

    normal: Vector3 = (0.0, 0.0, 1.0)


Hold = Union[Exact, Soft, Orientation, AxisLock, PlaneLock]


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points inside faces of the rest mesh: a face, and three barycentric coordinates in the order of its corners, each."""

    faces: npt.ArrayLike
    barycentric: npt.ArrayLike
    """k x 3, each at least 0, the sum of three 1, both to 1e-6."""


@dataclass(frozen=True, eq=False)
class Handle:
    """A group of vertices, or of points inside faces, that the user holds. A vertex belongs to one handle at most."""

    vertices: npt.ArrayLike = ()
    motion: Motion = Fixed()
    hold: Hold = Exact()
    points: SurfacePoints | None = None
    """In place of vertices; held exactly or soft."""
    footprint: float = 0.0
    """Radius, along the surface, of the surroundings that go along nearly rigidly, against spikes. 0: none."""


@dataclass(frozen=True)
class Removal:
    """Lets go of a handle."""


@dataclass(frozen=True)
class Automatic:
    """p or stiffness from the shape's geometry, found by the server: joints soft, parts rigid."""

    strength: float = 1.0
    """0 to 1; 0 is p = 2 and stiffness 1 everywhere."""


Field = Union[float, npt.ArrayLike, Automatic]
"""The same number everywhere, one a vertex, or found from the geometry."""


@dataclass(frozen=True)
class SolverSettings:
    """How a solve is made and when it stops. One setting: it is replaced whole. 0 takes the server's default."""

    method: Method = "auto"
    tolerance: float = 0.0
    """1e-14 to 0.1."""
    max_iterations: int = 0
    time_limit: float = 0.0
    """Seconds; 0 is without limit."""
    initial: InitialGuess = "current"


@dataclass(frozen=True, eq=False)
class Settings:
    """What is None keeps its value."""

    p: Field | None = None
    """1 to 64."""
    stiffness: Field | None = None
    """1e-6 to 1e6."""
    length_unit: float | None = None
    """Of mixed norms, in the mesh's unit; 0 takes the mean rest edge length."""
    solver: SolverSettings | None = None
    region: npt.ArrayLike | None = None
    """The vertices that may move; everything outside is held where it is. Empty: everything may move again."""


@dataclass(frozen=True)
class Resize:
    """A scaling by different factors along three axes in which salient parts keep their shape and size.

    Makes the handle "resize", which holds the ends along scaled axes, and sets p and stiffness, where the same update does not.
    Along the other axes the extent changes, unless plane locks hold ends there.
    """

    scale: Vector3
    """Along the axes, relative to the rest mesh; each 0.01 to 100."""
    origin: Vector3 | None = None
    """Stays where it is; the middle of the mesh's bounding box where left out."""
    axes: tuple[Vector3, Vector3] | None = None
    """Of the first and the second axis, of any length; x and y of the mesh where left out."""


Change = Union[Handle, Fixed, RigidMotion, Targets, Removal]
"""A Handle adds or replaces, a motion moves, a Removal lets go."""


@dataclass(frozen=True, eq=False)
class Update:
    """A change of handles and settings; the server takes it whole or not at all."""

    handles: Mapping[str, Change] = field(default_factory=dict)
    settings: Settings = Settings()
    resize: Resize | None = None
    begins_step: bool = False
    """What it does to handles is a step of its own, which undo() takes back: to be set when a drag begins."""


@dataclass(frozen=True)
class Defect:
    """One kind of defect of a mesh."""

    kind: str
    count: int
    first: tuple[int, ...]
    """The first few by index; an edge is two vertex indices."""


@dataclass(frozen=True)
class MeshReport:
    """What the server found in the mesh."""

    vertices: int
    faces: int
    edges: int
    components: int
    boundary_loops: int
    defects: tuple[Defect, ...]
    """Every kind, also those with count 0."""
    welded_vertices: int
    """Copies of a vertex before them."""
    notices: tuple[str, ...]
    """What is to be known before the mesh is deformed, one sentence for people each: that it comes apart where it is split."""


@dataclass(frozen=True)
class Notice:
    """What a server says about itself; nothing failed."""

    reason: Literal["overloaded", "recovered", "other"]
    """After "overloaded" frames come less often, and the last one of an update later, until "recovered"; "other": of a newer server."""
    text: str
    """One sentence for people."""


class IterationRecord(NamedTuple):
    iteration: int
    seconds: float
    energy: float
    """The true one."""
    objective: float
    """What the method minimises, in its own unit."""
    stage: int


class SolveProgress(NamedTuple):
    iteration: int
    energy: float
    seconds: float


@dataclass(frozen=True, eq=False, repr=False)
class SolveResult:
    """A finished solve. Arrays cannot be written to; copy them to change them."""

    positions: Floats
    """n x 3, float64."""
    distortion: Floats
    """n, float64: E_i of each vertex."""
    normals: Floats
    """n x 3, or 0 x 3 where they were not asked for."""
    method: str
    stop_reason: str
    iterations: int
    initial_energy: float
    energy: float
    soft_energy: float
    optimality_gap: float | None
    """(E - lower bound) / E of the convex problem with its rotations held; where it was asked for."""
    setup_seconds: float
    solve_seconds: float
    threads: int
    input_seq: int
    trace: tuple[IterationRecord, ...]

    def __repr__(self) -> str:
        return (
            f"<SolveResult of {len(self.positions)} vertices: {self.stop_reason} after {self.iterations} iterations of "
            f"{self.method}, energy {self.energy:.6g}>"
        )
