"""Converts values, which were checked and copied by _checks, to messages of the contract, and back."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from lpdeform import types
from lpdeform._numbers import Copied, is_single_precision
from lpdeform._rpc import Packer
from lpdeform._wire_holds import hold_from_wire, hold_to_wire, vector_from_wire, vector_to_wire
from lpdeform.types import FrameOptions
from lpdeform.v1 import data_pb2, frame_pb2, handle_pb2, report_pb2, service_pb2

_methods: dict[types.Method, handle_pb2.Method] = {
    "auto": handle_pb2.METHOD_UNSPECIFIED,
    "quasi_newton": handle_pb2.METHOD_QUASI_NEWTON,
    "line_search": handle_pb2.METHOD_LINE_SEARCH,
    "local_global": handle_pb2.METHOD_LOCAL_GLOBAL,
    "conic": handle_pb2.METHOD_CONIC,
    "multiresolution": handle_pb2.METHOD_MULTIRESOLUTION,
}
_guesses: dict[types.InitialGuess, handle_pb2.InitialGuess] = {
    "current": handle_pb2.INITIAL_GUESS_UNSPECIFIED,
    "laplacian": handle_pb2.INITIAL_GUESS_LAPLACIAN,
    "rest": handle_pb2.INITIAL_GUESS_REST,
}
_weights: dict[types.WeightKind, report_pb2.WeightKind] = {
    "cotangent": report_pb2.WEIGHT_KIND_COTANGENT,
    "uniform": report_pb2.WEIGHT_KIND_UNIFORM,
    "intrinsic_delaunay": report_pb2.WEIGHT_KIND_INTRINSIC_DELAUNAY,
}
_free_components: dict[types.FreeComponents, service_pb2.FreeComponents] = {
    "error": service_pb2.FREE_COMPONENTS_ERROR,
    "stay": service_pb2.FREE_COMPONENTS_STAY,
    "follow": service_pb2.FREE_COMPONENTS_FOLLOW,
}
_encodings: dict[types.Encoding, frame_pb2.Encoding] = {
    "float64": frame_pb2.ENCODING_RAW,
    "float32": frame_pb2.ENCODING_RAW,
    "quantized": frame_pb2.ENCODING_QUANTIZED,
    "compressed": frame_pb2.ENCODING_COMPRESSED,
}


def scalar_of(array: Copied) -> data_pb2.Scalar:
    return data_pb2.SCALAR_FLOAT32 if is_single_precision(array) else data_pb2.SCALAR_FLOAT64


def _packed(array: npt.ArrayLike, packer: Packer) -> data_pb2.Buffer:
    return packer.pack(np.asarray(array).tobytes())


def mesh_to_wire(vertices: Copied, faces: Copied, packer: Packer) -> data_pb2.Mesh:
    return data_pb2.Mesh(
        vertex_count=len(vertices),
        face_count=len(faces),
        scalar=scalar_of(vertices),
        data=packer.pack(vertices.tobytes() + faces.tobytes()),
    )


def weld_to_wire(weld: Copied | float, packer: Packer) -> data_pb2.Weld:
    """`weld`: one number per vertex, or the tolerance of a weld by position."""
    if isinstance(weld, float):
        return data_pb2.Weld(position=data_pb2.WeldByPosition(tolerance=weld))
    return data_pb2.Weld(groups=_packed(weld, packer))


def normals_to_wire(normals: Copied, packer: Packer) -> data_pb2.Normals:
    return data_pb2.Normals(scalar=scalar_of(normals), data=_packed(normals, packer))


def weights_to_wire(weights: types.WeightKind) -> report_pb2.WeightKind:
    return _weights[weights]


def free_components_to_wire(free_components: types.FreeComponents) -> service_pb2.FreeComponents:
    return _free_components[free_components]


def frame_options_to_wire(options: FrameOptions) -> frame_pb2.FrameOptions:
    asked = _encodings[options.encoding]
    lowest = asked if options.lowest_encoding is None else max(asked, _encodings[options.lowest_encoding])
    return frame_pb2.FrameOptions(
        credit=options.credit,
        scalar=data_pb2.SCALAR_FLOAT64 if options.encoding == "float64" else data_pb2.SCALAR_FLOAT32,
        without_distortion=not options.with_distortion,
        max_frames_per_second=options.max_frames_per_second,
        with_normals=options.with_normals,
        encoding=asked,
        lowest_encoding=lowest,
        certify=options.certify,
    )


def update_to_wire(update: types.Update, input_seq: int, packer: Packer) -> service_pb2.Update:
    message = service_pb2.Update(
        input_seq=input_seq, settings=settings_to_wire(update.settings, packer), begins_step=update.begins_step
    )
    for name, change in update.handles.items():
        message.handles.append(_change_to_wire(name, change, packer))
    if update.resize is not None:
        message.resize.CopyFrom(_resize_to_wire(update.resize))
    return message


def settings_to_wire(settings: types.Settings, packer: Packer) -> handle_pb2.SettingsUpdate:
    message = handle_pb2.SettingsUpdate()
    if settings.p is not None:
        message.p.CopyFrom(_field_to_wire(settings.p, packer))
    if settings.stiffness is not None:
        message.stiffness.CopyFrom(_field_to_wire(settings.stiffness, packer))
    if settings.length_unit is not None:
        message.length_unit.length = settings.length_unit
        message.length_unit.SetInParent()
    if (solver := settings.solver) is not None:
        message.solver.SetInParent()
        message.solver.method = _methods[solver.method]
        message.solver.tolerance = solver.tolerance
        message.solver.max_iterations = solver.max_iterations
        message.solver.time_limit_seconds = solver.time_limit
        message.solver.initial = _guesses[solver.initial]
        if (search := solver.search) is not None:
            message.solver.search.SetInParent()
            if search.effort is not None:
                message.solver.search.effort = search.effort
            message.solver.search.show = search.show
            message.solver.search.least_share = search.least_share
    if settings.region is not None:
        message.region.SetInParent()
        if np.size(settings.region):
            message.region.vertices.CopyFrom(_packed(settings.region, packer))
    return message


def _field_to_wire(value: types.Field, packer: Packer) -> data_pb2.Field:
    if isinstance(value, types.Automatic):
        return data_pb2.Field(automatic=data_pb2.AutomaticField(strength=value.strength))
    if isinstance(value, float):
        return data_pb2.Field(uniform=value)
    array = np.asarray(value)
    return data_pb2.Field(per_vertex=data_pb2.FieldValues(scalar=scalar_of(array), values=_packed(array, packer)))


def _change_to_wire(name: str, change: types.Change, packer: Packer) -> handle_pb2.HandleUpdate:
    if isinstance(change, types.Handle):
        return handle_pb2.HandleUpdate(name=name, set=_handle_to_wire(change, packer))
    if isinstance(change, types.Removal):
        return handle_pb2.HandleUpdate(name=name, remove=handle_pb2.Removal())
    return handle_pb2.HandleUpdate(name=name, move=_motion_to_wire(change, packer))


def _handle_to_wire(handle: types.Handle, packer: Packer) -> handle_pb2.Handle:
    message = handle_pb2.Handle(motion=_motion_to_wire(handle.motion, packer), footprint_radius=handle.footprint)
    vertices = np.asarray(handle.vertices)  # indices, by now
    if handle.points is None or vertices.size:
        message.vertices.CopyFrom(_packed(vertices, packer))
    if handle.points is not None:
        barycentric = np.asarray(handle.points.barycentric)
        points = handle_pb2.SurfacePoints(
            faces=_packed(handle.points.faces, packer),
            scalar=scalar_of(barycentric),
            barycentric=_packed(barycentric, packer),
        )
        message.points.CopyFrom(points)
    hold_to_wire(handle.hold, message)
    return message


def _motion_to_wire(motion: types.Motion, packer: Packer) -> handle_pb2.Motion:
    if isinstance(motion, types.Targets):
        positions = np.asarray(motion.positions)
        targets = handle_pb2.TargetPositions(scalar=scalar_of(positions), positions=_packed(positions, packer))
        return handle_pb2.Motion(targets=targets)
    if isinstance(motion, types.RigidMotion):
        rigid = handle_pb2.RigidMotion(
            axis=vector_to_wire(motion.axis),
            angle_radians=motion.angle,
            center=vector_to_wire(motion.center),
            translation=vector_to_wire(motion.translation),
        )
        return handle_pb2.Motion(rigid=rigid)
    return handle_pb2.Motion(fixed=handle_pb2.Fixed())


def _resize_to_wire(resize: types.Resize) -> data_pb2.Resize:
    message = data_pb2.Resize(scale=vector_to_wire(resize.scale))
    if resize.origin is not None:
        message.origin.CopyFrom(vector_to_wire(resize.origin))
    if resize.axes is not None:
        message.x_axis.CopyFrom(vector_to_wire(resize.axes[0]))
        message.y_axis.CopyFrom(vector_to_wire(resize.axes[1]))
    return message


# From the wire.


def notice_from_wire(notice: service_pb2.Notice) -> types.Notice:
    if notice.reason == service_pb2.NOTICE_REASON_OVERLOADED:
        return types.Notice("overloaded", notice.text)
    if notice.reason == service_pb2.NOTICE_REASON_BETTER_SHAPE:
        return types.Notice("better_shape", notice.text, notice.input_seq, notice.energy, notice.saved_share)
    return types.Notice("recovered" if notice.reason == service_pb2.NOTICE_REASON_RECOVERED else "other", notice.text)


def report_from_wire(report: report_pb2.MeshReport) -> types.MeshReport:
    defects = tuple(types.Defect(one.kind, one.count, tuple(one.first)) for one in report.defects)
    return types.MeshReport(
        vertices=report.vertices,
        faces=report.faces,
        edges=report.edges,
        components=report.components,
        boundary_loops=report.boundary_loops,
        defects=defects,
        welded_vertices=report.welded_vertices,
        notices=types.mesh_notices(defects),
    )


def changes_from_wire(changes: Iterable[handle_pb2.HandleUpdate]) -> types.Update:
    """Converts changes of handles that the server made."""
    handles: dict[str, types.Change] = {}
    for message in changes:
        kind = message.WhichOneof("change")
        if kind == "set":
            handles[message.name] = _handle_from_wire(message.set)
        elif kind == "move":
            handles[message.name] = _motion_from_wire(message.move)
        else:
            handles[message.name] = types.Removal()
    return types.Update(handles)


def _handle_from_wire(handle: handle_pb2.Handle) -> types.Handle:
    points = None
    if handle.HasField("points"):
        faces = np.frombuffer(handle.points.faces.inline, "<u4")
        points = types.SurfacePoints(faces, _unpacked(handle.points.barycentric, handle.points.scalar))
    return types.Handle(
        vertices=np.frombuffer(handle.vertices.inline, "<u4"),
        motion=_motion_from_wire(handle.motion),
        hold=hold_from_wire(handle),
        points=points,
        footprint=handle.footprint_radius,
    )


def _motion_from_wire(motion: handle_pb2.Motion) -> types.Motion:
    if motion.HasField("rigid"):
        rigid = motion.rigid
        return types.RigidMotion(
            vector_from_wire(rigid.axis),
            rigid.angle_radians,
            vector_from_wire(rigid.center),
            vector_from_wire(rigid.translation),
        )
    if motion.HasField("targets"):
        return types.Targets(_unpacked(motion.targets.positions, motion.targets.scalar))
    return types.Fixed()


def _unpacked(buffer: data_pb2.Buffer, scalar: data_pb2.Scalar) -> Copied:
    """k x 3."""
    return np.frombuffer(buffer.inline, "<f8" if scalar == data_pb2.SCALAR_FLOAT64 else "<f4").reshape(-1, 3)
