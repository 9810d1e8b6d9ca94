"""One deformation, in one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from lpdeform import types
from lpdeform._groups import Given, handles_of
from lpdeform._meshes import mesh_arrays
from lpdeform._progress import told_by
from lpdeform._solving import SolveOptions, checked_positions
from lpdeform._stop import Stop
from lpdeform.access import Tls, Token
from lpdeform.opening import checked_mesh, reach, warn_of_splits, weld_of
from lpdeform.session import deadline_after
from lpdeform.types import Field, FrameOptions, FreeComponents, Settings, SolveProgress, SolverSettings, WeightKind


def deform(
    vertices: types.Mesh,
    faces: types.Triangles | None = None,
    handles: Mapping[str, Given] | None = None,
    *,
    p: Field = 2.0,
    stiffness: Field = 1.0,
    length_unit: float | None = None,
    solver: SolverSettings | None = None,
    region: npt.ArrayLike | None = None,
    normals: npt.ArrayLike | None = None,
    weights: WeightKind = "cotangent",
    free_components: FreeComponents = "error",
    weld: npt.ArrayLike | float | bool | None = None,
    initial_positions: npt.ArrayLike | None = None,
    certify: bool = True,
    trace: bool = True,
    with_normals: bool = False,
    progress: bool | Callable[[SolveProgress], None] | None = None,
    timeout: float | None = None,
    address: str | None = None,
    token: Token = None,
    tls: Tls | bool = False,
) -> types.SolveResult:
    """Deforms a triangle mesh, and returns the finished result in float64.

    vertices: n x 3, in any unit of length; or a MeshFile, or a mesh of trimesh, meshio, PyVista or Polyscope, and then without `faces`.
    faces: m x 3 indices from 0, counter-clockwise seen from outside.
    handles: by name, what is held and where it goes. A handle is a lpdeform.Handle; or (group, motion), where a motion is a
        RigidMotion, or k x 3 target positions for the k vertices of the group; or a group alone, which stays where it is. A group
        is indices, a boolean mask of length n, or a function that gets the n x 3 vertices and returns either.
    p: 1 to 64, one number or n; stiffness: 1e-6 to 1e6, one number or n. Either may be lpdeform.Automatic().
    certify: whether to compute optimality_gap, a bound on the distance from the optimum for the result's rotations.
    progress: True for a bar, by tqdm if it is installed; or a function, called with the SolveProgress at most ten times a second, and
        not in the first tenth of one.
    timeout: seconds; None is without limit.
    solver: method, accuracy and search. Below p = 2 the solve goes on from other starts after its first minimum, and returns
        the lowest. That takes several times as long. SolverSettings(search=MinimaSearch(effort=0)) takes the first minimum.
    address: of a server, as in open(); without one, and without LPDEFORM_ADDRESS, the mesh is deformed in this process.
    Everything else is as in open() and Session.solve(). Ctrl-C ends the solve within one iteration.

    Raises InvalidInput with the first element that cannot be used; FAILED_PRECONDITION (COMPONENT_WITHOUT_HANDLE) if no handle
    holds a part of the mesh, unless `free_components` says what happens to it.

    >>> import lpdeform
    >>> result = lpdeform.deform(
    ...     [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]],
    ...     [[0, 1, 2], [1, 3, 2]],
    ...     {"left": [0, 2], "right": ([1, 3], [[2, 0, 0], [2, 1, 0]])},
    ...     p=1,
    ... )
    >>> result.positions[:, 0].tolist(), result.p
    ([0.0, 2.0, 0.0, 2.0], 1.0)
    """
    points, triangles = mesh_arrays(vertices, faces)
    settings = Settings(p, stiffness, length_unit, solver, region)
    given = checked_mesh(points, triangles, normals, settings, weights, free_components, weld_of(weld, vertices), copies=False)
    held = handles_of(handles or {}, given.vertices)
    initial = checked_positions(initial_positions, len(given.vertices))
    if timeout is not None:
        deadline_after(timeout)
    stop = Stop()
    link = reach(address, token, tls).open(given, held, FrameOptions(), stop, False)
    try:
        warn_of_splits(link.report, stacklevel=2)
        with told_by(progress) as on_progress:
            return link.solve(SolveOptions(bool(certify), bool(trace), bool(with_normals), initial, on_progress, timeout), stop)
    finally:
        link.close()
