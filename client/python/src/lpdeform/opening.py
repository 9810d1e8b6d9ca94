"""Functions that create and join sessions."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from numbers import Real

import numpy as np
import numpy.typing as npt

from lpdeform import _codec, _wire
from lpdeform._lease import Lease, Original, Snapshot, create_session, join_session, restore_session, route_of
from lpdeform._link import Link
from lpdeform._numbers import Copied, indices, numbers
from lpdeform._rpc import Rpc, Stop, default_address, new_request_id
from lpdeform.access import Tls, Token
from lpdeform.errors import LpdeformError, SplitMeshWarning, invalid
from lpdeform.session import Session
from lpdeform.types import Encoding, Field, FreeComponents, Handle, MeshReport, Settings, SolverSettings, Update, WeightKind
from lpdeform.v1 import frame_pb2


def connect(
    address: str | None, call_timeout: float, reconnect_for: float, token: Token, tls: Tls | bool
) -> Rpc:
    return Rpc(address or default_address(), call_timeout, reconnect_for, token, tls)


def _weld_of(weld: npt.ArrayLike | float | bool) -> Copied | float | None:
    if isinstance(weld, (bool, np.bool_)):
        return 0.0 if weld else None
    return float(weld) if isinstance(weld, Real) else indices(weld, "weld")


def open_link(
    rpc: Rpc,
    stop: Stop,
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    normals: npt.ArrayLike | None,
    handles: Mapping[str, Handle] | None,
    settings: Settings,
    weights: WeightKind,
    free_components: FreeComponents,
    weld: npt.ArrayLike | float | bool,
    frame_options: frame_pb2.FrameOptions,
) -> Link:
    rest = numbers(vertices, "vertices", 3)
    original = Original(
        vertices=rest,
        faces=indices(faces, "faces", 3),
        normals=None if normals is None else numbers(normals, "normals", 3),
        weld=_weld_of(weld),
        weights=_wire.weights_to_wire(weights),
        free_components=_wire.free_components_to_wire(free_components),
        settings=_wire.checked_settings(settings, len(rest)),
    )
    try:
        lease = create_session(rpc, original, new_request_id(), stop)
    except BaseException:
        rpc.close()
        raise
    link = Link(rpc, lease, frame_options, original)
    if handles:
        try:
            link.update(Update(dict(handles)))
        except BaseException:
            link.close()
            raise
    return link


def warn_of_splits(report: MeshReport, stacklevel: int) -> None:
    """stacklevel: as in warnings.warn, counted from the caller of this function."""
    for notice in report.notices:
        text = f"{notice} Open it with weld=True, or with a larger tolerance as weld=."
        warnings.warn(text, SplitMeshWarning, stacklevel=stacklevel + 1)


def frame_options(
    encoding: Encoding,
    lowest_encoding: Encoding | None,
    credit: int,
    with_distortion: bool,
    with_normals: bool,
    max_frames_per_second: float,
    certify: bool,
) -> frame_pb2.FrameOptions:
    if not 0 <= credit <= 8:
        raise invalid(f"The credit is {credit}.", "CREDIT_OUT_OF_RANGE", "credit", "0 <= credit <= 8")
    if "compressed" in (encoding, lowest_encoding):
        _codec.require_decoder()
    return _wire.frame_options_to_wire(
        encoding, lowest_encoding, credit, with_distortion, with_normals, max_frames_per_second, certify
    )


def open(  # noqa: A001  (called as lpdeform.open)
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
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
    weld: npt.ArrayLike | float | bool = False,
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

    vertices: n x 3, in any unit. faces: m x 3, 0-based, counter-clockwise seen from outside.
    address: "host:port" or "unix:/path"; by default the environment variable LPDEFORM_ADDRESS, or localhost:50051.
    token: a bearer token, or a function that returns the newest one, called on any thread when a call begins.
    tls: True, or a Tls with certificates.
    handles: the handles to begin with. p, stiffness, length_unit, solver, region: as in Settings.
    normals: n x 3, as drawn at rest, for frames with normals.
    free_components: what happens to a connected component that no handle holds: "error" (raised), "stay", "follow".
    weld: True if vertices in the same place are copies of one. Or the largest distance of copies as a share of the bounding box's
        diagonal, at most 1e-3. Or one number per vertex, which is the same for copies. True and 0 mean 1e-6, because copies may
        differ by rounding. False: no weld.
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
    rpc = connect(address, call_timeout, reconnect_for, token, tls)
    link = open_link(
        rpc, Stop(), vertices, faces, normals, handles, settings, weights, free_components, weld, options
    )
    try:
        warn_of_splits(link.lease.report, stacklevel=2)
    except SplitMeshWarning:  # warnings are errors
        link.close()
        raise
    return Session(link)


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
    rpc = connect(address, call_timeout, reconnect_for, token, tls)
    return Session(join_link(rpc, Stop(), name, as_writer, options))


def join_link(rpc: Rpc, stop: Stop, name: str, as_writer: bool, options: frame_pb2.FrameOptions) -> Link:
    try:
        return Link(rpc, _join_where_it_is(rpc, stop, name, as_writer), options, None)
    except BaseException:
        rpc.close()
        raise


def _join_where_it_is(rpc: Rpc, stop: Stop, name: str, as_writer: bool) -> Lease:
    """With several servers behind a proxy, uses the route of the server that has the session."""
    try:
        lease = join_session(rpc, name, as_writer, stop)
        if lease.route:
            rpc.go_by(lease.route)
        return lease
    except LpdeformError as error:
        route = route_of(error)
        if not route or route == rpc.route:
            raise
        rpc.go_by(route)
        return join_session(rpc, name, as_writer, stop)


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
    rpc = connect(address, call_timeout, reconnect_for, token, tls)
    return Session(restore_link(rpc, Stop(), snapshot, options))


def restore_link(rpc: Rpc, stop: Stop, snapshot: bytes, options: frame_pb2.FrameOptions) -> Link:
    original = Snapshot(bytes(snapshot))
    try:
        return Link(rpc, restore_session(rpc, original, new_request_id(), stop), options, original)
    except BaseException:
        rpc.close()
        raise
