"""L_p shape deformation, in this process or on a server: NumPy arrays in, NumPy arrays out.

    import lpdeform

    with lpdeform.open(vertices, faces, p=1.5) as s:
        s.set_handle("base", vertices[:, 2] < 0.1)                     # stays where it is
        s.set_handle("tip", vertices[:, 2] > 0.9)
        frame = s.move("tip", translation=[0, 0, 1])                   # frame.positions, frame.distortion

`lpdeform.deform(vertices, faces, handles, p=1.5)` is one finished result in one call. Both are in this process; with `address=` they are
on a server.

To drag, call `s.drag("tip", ...)` on every mouse move and `s.poll()` once per picture: in both directions the newest value
wins. `s.solve()` returns one finished result, with its trace and a bound on its distance from the optimum for its
rotations.
"""

import importlib
from typing import TYPE_CHECKING

from lpdeform._deform import deform
from lpdeform.access import Tls
from lpdeform.errors import Code, InvalidInput, LpdeformError, SplitMeshWarning, Timeout, Unavailable
from lpdeform.frames import Frame, QuantizedSurface
from lpdeform.mesh_files import MeshFile, MeshPart, read_mesh, write_mesh
from lpdeform.opening import join, open, restore
from lpdeform.reasons import Reason
from lpdeform.session import Session
from lpdeform.types import (
    Automatic,
    AxisLock,
    BetterShape,
    Defect,
    Exact,
    Fixed,
    Handle,
    IterationRecord,
    MeshReport,
    MinimaSearch,
    Notice,
    Orientation,
    PlaneLock,
    Removal,
    Resize,
    RigidMotion,
    Settings,
    Soft,
    SolveProgress,
    SolveResult,
    SolverSettings,
    SurfacePoints,
    Targets,
    Update,
)

if TYPE_CHECKING:
    from lpdeform._assembly import FrameAssembly
    from lpdeform.aio import AsyncSession, join_async, open_async, restore_async

__version__ = "0.1.0"
_when_asked_for = {
    "AsyncSession": "aio",
    "FrameAssembly": "_assembly",  # reads a server's messages, which need lpdeform[remote]
    "join_async": "aio",
    "open_async": "aio",
    "restore_async": "aio",
}


def __getattr__(name: str) -> object:
    """What not every program needs: asyncio alone takes a third of the time that an import takes."""
    if name in _when_asked_for:
        return getattr(importlib.import_module(f"lpdeform.{_when_asked_for[name]}"), name)
    raise AttributeError(f"module 'lpdeform' has no attribute {name!r}")


__all__ = [
    "AsyncSession",
    "Automatic",
    "AxisLock",
    "BetterShape",
    "Code",
    "Defect",
    "Exact",
    "Fixed",
    "Frame",
    "FrameAssembly",
    "Handle",
    "InvalidInput",
    "IterationRecord",
    "LpdeformError",
    "MeshFile",
    "MeshPart",
    "MeshReport",
    "MinimaSearch",
    "Notice",
    "Orientation",
    "PlaneLock",
    "QuantizedSurface",
    "Reason",
    "Removal",
    "Resize",
    "RigidMotion",
    "Session",
    "Settings",
    "Soft",
    "SolveProgress",
    "SolveResult",
    "SolverSettings",
    "SplitMeshWarning",
    "SurfacePoints",
    "Targets",
    "Timeout",
    "Tls",
    "Unavailable",
    "Update",
    "deform",
    "join",
    "join_async",
    "open",
    "open_async",
    "read_mesh",
    "restore",
    "restore_async",
    "write_mesh",
]
