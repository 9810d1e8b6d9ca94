"""What a client knows of its session on the server."""

from __future__ import annotations

from dataclasses import dataclass, replace

from google.protobuf.message import Message

from lpdeform import _wire
from lpdeform._numbers import Copied
from lpdeform._rpc import Packer, Response, Rpc
from lpdeform._stop import Stop
from lpdeform.errors import Code, LpdeformError, is_undecided, make
from lpdeform.types import MeshReport, Settings
from lpdeform.v1 import report_pb2, service_pb2


@dataclass(frozen=True)
class Lease:
    session: str
    writer_token: str
    """Empty for a reader."""
    epoch: int
    input_seq: int
    report: MeshReport
    route: str = ""
    """The header lpdeform-session that leads to the session's server."""


@dataclass(frozen=True, eq=False)
class Original:
    """What a session is created from, and recreated from if the server has lost it. Everything is checked and copied."""

    vertices: Copied
    faces: Copied
    normals: Copied | None
    weld: Copied | float | None
    """One number per vertex, or the tolerance of a weld by position."""
    weights: report_pb2.WeightKind
    free_components: service_pb2.FreeComponents
    settings: Settings


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A file that a session is created from, and recreated from."""

    file: bytes


def create_session(rpc: Rpc, original: Original, request_id: str, stop: Stop) -> Lease:
    """Creates the session. It is idempotent: the same request id gives the same session, however often it is tried."""
    packer = Packer(rpc, stop, request_id)
    request = service_pb2.CreateSessionRequest(
        request_id=request_id,
        mesh=_wire.mesh_to_wire(original.vertices, original.faces, packer),
        weights=original.weights,
        free_components=original.free_components,
        settings=_wire.settings_to_wire(original.settings, packer),
    )
    if original.weld is not None:
        request.weld.CopyFrom(_wire.weld_to_wire(original.weld, packer))
    if original.normals is not None:
        request.normals.CopyFrom(_wire.normals_to_wire(original.normals, packer))
    created = _call_with(packer, rpc, "CreateSession", request, service_pb2.CreateSessionResponse, stop)
    check_vertex_count(created.session.mesh.vertices, len(original.vertices))
    return _lease_of(created.session, created.writer_token)


def restore_session(rpc: Rpc, snapshot: Snapshot, request_id: str, stop: Stop) -> Lease:
    packer = Packer(rpc, stop, request_id)
    request = service_pb2.RestoreSessionRequest(request_id=request_id, snapshot=packer.pack(snapshot.file))
    restored = _call_with(packer, rpc, "RestoreSession", request, service_pb2.RestoreSessionResponse, stop)
    return _lease_of(restored.session, restored.writer_token)


def _call_with(
    packer: Packer, rpc: Rpc, name: str, request: Message, response: type[Response], stop: Stop
) -> Response:
    """Keeps the uploads while it is unknown whether the server took the call, because the retry needs them."""
    try:
        answer = rpc.call(name, request, response, stop)
    except LpdeformError as error:
        if not is_undecided(error):
            packer.discard()
        raise
    packer.discard()
    return answer


def route_of(error: LpdeformError) -> str:
    """The header that leads to a session on another of several servers; empty if the error does not name one."""
    said = "lpdeform-session: "
    is_elsewhere = error.reason == "SESSION_ELSEWHERE" and error.limit.startswith(said)
    return error.limit[len(said) :] if is_elsewhere else ""


def join_session(rpc: Rpc, name: str, as_writer: bool, stop: Stop) -> Lease:
    get = service_pb2.GetSessionRequest(session=name)
    found = rpc.call("GetSession", get, service_pb2.GetSessionResponse, stop)
    lease = _lease_of(found.session, "")
    if not as_writer:
        return lease
    acquire = service_pb2.AcquireWriterRequest(session=name)
    acquired = rpc.call("AcquireWriter", acquire, service_pb2.AcquireWriterResponse, stop)
    return replace(
        lease, writer_token=acquired.writer_token, epoch=acquired.epoch, input_seq=acquired.input_seq
    )


def check_vertex_count(count: int, wanted: int) -> None:
    """Raises DATA_LOSS FRAME_VERTICES if a server reports `count` vertices for a mesh that has `wanted`."""
    if count != wanted:
        text = f"The server speaks of {count} vertices of a mesh that has {wanted}."
        raise make(Code.DATA_LOSS, text, "FRAME_VERTICES", "", f"vertices = {wanted}")


def _lease_of(session: service_pb2.Session, writer_token: str) -> Lease:
    report = _wire.report_from_wire(session.mesh)
    return Lease(session.name, writer_token, session.epoch, session.input_seq, report, session.route)
