"""Functions that create and join sessions."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Mapping
from importlib.util import find_spec
from numbers import Real
from typing import get_args

import numpy as np
import numpy.typing as npt

from lpdeform._checks import checked_settings, named, typed
from lpdeform._groups import handles_of
from lpdeform._meshes import mesh_arrays
from lpdeform._numbers import Copied, count, indices, number, numbers
from lpdeform._opened import Connecting, Given, Reaching
from lpdeform._stop import Stop
from lpdeform.access import Tls, Token
from lpdeform.errors import Code, SplitMeshWarning, invalid, make
from lpdeform.mesh_files import MeshFile
from lpdeform.session import Session
from lpdeform.types import (
    Encoding,
    Field,
    FrameOptions,
    FreeComponents,
    Handle,
    Mesh,
    MeshReport,
    Settings,
    SolverSettings,
    Triangles,
    WeightKind,
)


def _is_missing(module: str) -> bool:
    if module in sys.modules:
        return sys.modules[module] is None
    try:
        return find_spec(module) is None
    except (ImportError, ValueError):
        return True


def reach(
    address: str | None, token: Token, tls: Tls | bool, call_timeout: float = 30.0, reconnect_for: float = 120.0
) -> Connecting:
    """This process, or a server if there is an address."""
    typed(address, str, "address")
    for name, seconds in (("call_timeout", call_timeout), ("reconnect_for", reconnect_for)):
        if not number(seconds, name) >= 0:
            raise invalid(f"The {name} is {seconds} seconds.", "SECONDS_OUT_OF_RANGE", name, f"0 <= {name}")
    address = address or os.environ.get("LPDEFORM_ADDRESS")
    if address:
        if _is_missing("grpc") or _is_missing("google.protobuf"):
            text = "A session on a server needs grpcio and protobuf: pip install lpdeform[remote]"
            raise make(Code.UNIMPLEMENTED, text, "NO_REMOTE", "address", "pip install lpdeform[remote]")
        from lpdeform._remote import Remote

        return Remote(Reaching(address, token, tls, call_timeout, reconnect_for))
    if token is not None or tls is not False:
        what = "token" if token is not None else "tls"
        raise invalid(f"{what} is for a session on a server, and there is no address.", "ARGUMENT_MISSING", "address")
    if _is_missing("lpdeform._core"):
        text = "This wheel of lpdeform has no solver, so that a session needs the address of a server."
        raise make(Code.UNIMPLEMENTED, text, "NO_SOLVER", "address")
    from lpdeform._local import Local

    return Local(call_timeout)


def weld_of(weld: npt.ArrayLike | float | bool | None, mesh: Mesh) -> Copied | float | None:
    """As Given has it."""
    if weld is None:
        weld = isinstance(mesh, MeshFile) and mesh.splits_vertices
    if isinstance(weld, (bool, np.bool_)):
        return 0.0 if weld else None
    return float(weld) if isinstance(weld, Real) else indices(weld, "weld")


def checked_mesh(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    normals: npt.ArrayLike | None,
    settings: Settings,
    weights: WeightKind,
    free_components: FreeComponents,
    weld: Copied | float | None,
    copies: bool = True,
) -> Given:
    """`copies`: whether the vertices may change while the session is there."""
    named(get_args(WeightKind), weights, "weights")
    named(get_args(FreeComponents), free_components, "free_components")
    rest = numbers(vertices, "vertices", 3, copies)
    return Given(
        vertices=rest,
        faces=indices(faces, "faces", 3, below=len(rest)),
        normals=None if normals is None else numbers(normals, "normals", 3),
        weld=weld,
        weights=weights,
        free_components=free_components,
        settings=checked_settings(settings, len(rest)),
    )


def warn_of_splits(report: MeshReport, stacklevel: int) -> None:
    """stacklevel: as in warnings.warn, counted from the caller of this function."""
    for notice in report.notices:
        text = f"{notice} weld=True does, or a larger tolerance as weld=."
        warnings.warn(text, SplitMeshWarning, stacklevel=stacklevel + 1)


def frame_options(
    encoding: Encoding,
    lowest_encoding: Encoding | None,
    credit: int,
    with_distortion: bool,
    with_normals: bool,
    max_frames_per_second: float,
    certify: bool,
) -> FrameOptions:
    credit = count(credit, "credit", 8)
    if credit > 8:
        raise invalid(f"The credit is {credit}.", "CREDIT_OUT_OF_RANGE", "credit", "0 <= credit <= 8")
    for one in (encoding, lowest_encoding or encoding):
        named(get_args(Encoding), one, "encoding")
    if "compressed" in (encoding, lowest_encoding):
        from lpdeform import _codec

        _codec.require_decoder()
    return FrameOptions(
        encoding,
        lowest_encoding,
        credit,
        bool(with_distortion),
        bool(with_normals),
        number(max_frames_per_second, "max_frames_per_second"),
        bool(certify),
    )


def open(  # noqa: A001  (called as lpdeform.open)
    vertices: Mesh,
    faces: Triangles | None = None,
    *,
    address: str | None = None,
    token: Token = None,
    tls: Tls | bool = False,
    handles: Mapping[str, Handle] | None = None,
    p: Field | None = None,
    stiffness: Field | None = None,
    length_unit: float | None = None,
    solver: SolverSettings | None = None,
    region: npt.ArrayLike | None = None,
    normals: npt.ArrayLike | None = None,
    weights: WeightKind = "cotangent",
    free_components: FreeComponents = "error",
    weld: npt.ArrayLike | float | bool | None = None,
    encoding: Encoding = "float32",
    lowest_encoding: Encoding | None = None,
    credit: int = 0,
    with_distortion: bool = True,
    with_normals: bool = False,
    certify: bool = False,
    max_frames_per_second: float = 0.0,
    call_timeout: float = 30.0,
    reconnect_for: float = 120.0,
) -> Session:
    """Creates a session from a triangle mesh; the order of vertices is never changed.

    vertices: n x 3, in any unit; or a MeshFile, or a mesh of trimesh, meshio, PyVista or Polyscope, and then without `faces`. faces: m x 3, 0-based, counter-clockwise seen from outside.
    address: of a server, "host:port" or "unix:/path"; by default the environment variable LPDEFORM_ADDRESS. Without either, the
        session is in this process.
    token: a bearer token, or a function that returns the newest one, called on any thread when a call begins.
    tls: True, or a Tls with certificates.
    handles: the handles to begin with. p, stiffness, length_unit, solver, region: as in Settings.
    normals: n x 3, as drawn at rest, for frames with normals.
    free_components: what happens to a connected component that no handle holds: "error" (raised), "stay", "follow".
    weld: True if vertices in the same place are copies of one. Or the largest distance of copies as a share of the bounding box's
        diagonal, at most 1e-3. Or one number per vertex, which is the same for copies. True and 0 mean 1e-6, because copies may
        differ by rounding. False: no weld. By default a MeshFile of a GLB or glTF file is welded, and everything else is not.
    encoding: how frames are sent: "float64", "float32" (16 bytes per vertex), "quantized" (8 bytes, off by half of 1/65535 of the
        frame's extent), "compressed" (the same precision, 3 to 5 bytes; needs the system's meshoptimizer).
    lowest_encoding: the least precise encoding that the server may use to keep its limit of bytes per second.
    credit: how many frames may be under way and not yet taken, 1 to 8; 0 takes the server's 2.
    certify: a finished result is sent again with its optimality_gap.
    max_frames_per_second: 0 is without limit; the last frame of an update always comes.
    call_timeout: time limit in seconds of every call but solve().
    reconnect_for: seconds after which a session gives up if the server does not return.
    Raises InvalidInput with the first element that cannot be deformed, or with a certificate or token that cannot be used;
    Unavailable (NO_SERVER) if no server answers. Warns with SplitMeshWarning of a mesh that comes apart where it is split.

    >>> import lpdeform
    >>> with lpdeform.open([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]) as session:
    ...     session.mesh_report.edges
    3
    """
    options = frame_options(
        encoding, lowest_encoding, credit, with_distortion, with_normals, max_frames_per_second, certify
    )
    settings = Settings(p, stiffness, length_unit, solver, region)
    place = reach(address, token, tls, call_timeout, reconnect_for)
    points, triangles = mesh_arrays(vertices, faces)
    given = checked_mesh(points, triangles, normals, settings, weights, free_components, weld_of(weld, vertices))
    opened = place.open(given, handles_of(handles or {}, given.vertices), options, Stop())
    try:
        warn_of_splits(opened.report, stacklevel=2)
    except SplitMeshWarning:  # warnings are errors
        opened.close()
        raise
    return Session(opened)


def join(
    name: str,
    *,
    as_writer: bool = False,
    address: str | None = None,
    token: Token = None,
    tls: Tls | bool = False,
    encoding: Encoding = "float32",
    lowest_encoding: Encoding | None = None,
    credit: int = 0,
    with_distortion: bool = True,
    with_normals: bool = False,
    certify: bool = False,
    max_frames_per_second: float = 0.0,
    call_timeout: float = 30.0,
    reconnect_for: float = 120.0,
) -> Session:
    """Joins an existing session by name: as a reader of its frames, or as its writer by taking over.

    It is not recreated if the server loses it, and close() does not delete it. Everything else is as in open().
    """
    options = frame_options(
        encoding, lowest_encoding, credit, with_distortion, with_normals, max_frames_per_second, certify
    )
    return Session(reach(address, token, tls, call_timeout, reconnect_for).join(name, as_writer, options, Stop()))


def restore(
    snapshot: bytes,
    *,
    address: str | None = None,
    token: Token = None,
    tls: Tls | bool = False,
    encoding: Encoding = "float32",
    lowest_encoding: Encoding | None = None,
    credit: int = 0,
    with_distortion: bool = True,
    with_normals: bool = False,
    certify: bool = False,
    max_frames_per_second: float = 0.0,
    call_timeout: float = 30.0,
    reconnect_for: float = 120.0,
) -> Session:
    """Creates a session from the result of Session.snapshot(), on any server of the same or a later version.

    It shows the same surface to the last bit, and has the same handles, settings and steps to undo. From then on it is like a
    session of open(). Raises InvalidInput (SNAPSHOT_FOREIGN, SNAPSHOT_NEWER, SNAPSHOT_TRUNCATED, SNAPSHOT_DAMAGED); otherwise as
    open().
    """
    options = frame_options(
        encoding, lowest_encoding, credit, with_distortion, with_normals, max_frames_per_second, certify
    )
    return Session(reach(address, token, tls, call_timeout, reconnect_for).restore(snapshot, options, Stop()))
