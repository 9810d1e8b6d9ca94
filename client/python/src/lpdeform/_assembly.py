"""Frames, assembled from the server's messages."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import numpy.typing as npt

from lpdeform import _codec
from lpdeform.errors import Code, LpdeformError, make
from lpdeform.frames import Frame, FrameHeader, QuantizedSurface, sealed
from lpdeform.v1 import data_pb2, frame_pb2, handle_pb2


def header_of(header: frame_pb2.FrameHeader) -> FrameHeader:
    return FrameHeader(
        input_seq=header.input_seq,
        frame_seq=header.frame_seq,
        epoch=header.epoch,
        skipped_inputs=header.skipped_inputs,
        iteration=header.iteration,
        energy=header.energy,
        soft_energy=header.soft_energy,
        is_final=header.is_final,
        stop_reason=stop_reason_name(header.stop_reason),
        solve_seconds=header.solve_seconds,
        method=method_name(header.method),
        optimality_gap=header.certificate.relative_gap if header.HasField("certificate") else None,
    )


class FrameAssembly:
    """Assembles frames from their parts; a part that does not fit is an error (FRAME_PARTS)."""

    def __init__(self, vertex_count: int) -> None:
        self._vertex_count = vertex_count
        self._frame: Frame | None = None
        self._is_compressed = False
        self._scalar = "<f4"
        self._quantization: frame_pb2.Quantization | None = None
        self._received = 0
        self._whole: dict[str, npt.NDArray[Any]] = {}
        self._given: dict[str, int] = {}  # for how many vertices values have come

    def add(self, part: frame_pb2.FramePart) -> Frame | None:
        """The frame, if this part completes it."""
        frame = self._begin(part.header) if part.HasField("header") else self._frame
        self._frame = None
        count, first = part.vertex_count, part.first_vertex
        if (
            frame is None
            or part.frame_seq != frame.frame_seq
            or first != self._received
            or count > self._vertex_count - first
        ):
            raise _misfit(f"The part of frame {part.frame_seq} from vertex {first} on does not follow what came before.")
        if self._quantization is None:
            self._append_raw(part)
        else:
            self._append_quantized(part)
        frame.wire_bytes += len(part.positions) + len(part.distortion) + len(part.normals)
        self._received += count
        if not part.last:
            self._frame = frame
            return None
        if self._received != self._vertex_count:
            raise _misfit(f"Frame {part.frame_seq} ends after {self._received} of {self._vertex_count} vertices.")
        if any(count != self._vertex_count for count in self._given.values()):
            raise _misfit(f"Frame {part.frame_seq} has distortion or normals for a part of its vertices.")
        self._finish(frame)
        return frame

    def _begin(self, header: frame_pb2.FrameHeader) -> Frame:
        if header.vertex_count != self._vertex_count:
            raise _misfit(f"A frame has {header.vertex_count} vertices, the mesh {self._vertex_count}.")
        if not frame_pb2.ENCODING_UNSPECIFIED <= header.encoding <= frame_pb2.ENCODING_COMPRESSED:
            raise _misfit(f"A frame comes in encoding {header.encoding}, which was not asked for.")
        self._received = 0
        self._whole, self._given = {}, {}
        self._is_compressed = header.encoding == frame_pb2.ENCODING_COMPRESSED
        is_quantized = self._is_compressed or header.encoding == frame_pb2.ENCODING_QUANTIZED
        self._quantization = header.quantization if is_quantized else None
        self._scalar = "<f8" if header.scalar == data_pb2.SCALAR_FLOAT64 else "<f4"
        return Frame(header_of(header))

    def _append_raw(self, part: frame_pb2.FramePart) -> None:
        for name, data, width in (
            ("positions", part.positions, 3),
            ("distortion", part.distortion, 1),
            ("normals", part.normals, 3),
        ):
            if name != "positions" and not data:
                continue
            if len(data) != width * part.vertex_count * np.dtype(self._scalar).itemsize:
                raise _wrong_size(part)
            self._join(name, np.frombuffer(data, self._scalar).reshape(-1, width), part)

    def _append_quantized(self, part: frame_pb2.FramePart) -> None:
        for name, data in (("vertices", part.positions), ("normals", part.normals)):
            if name == "normals" and not data:
                continue
            if self._is_compressed:
                values = _codec.decompress(data, part.vertex_count)
            else:
                values = np.frombuffer(data, "<u2").reshape(-1, 4) if len(data) == 8 * part.vertex_count else None
            if values is None:
                raise _wrong_size(part)
            self._join(name, values if name == "vertices" else values.view("<i2"), part)

    def _join(self, name: str, values: npt.NDArray[Any], part: frame_pb2.FramePart) -> None:
        """Stores `values` at their place in the whole array; a part with all vertices becomes the whole array."""
        self._given[name] = self._given.get(name, 0) + part.vertex_count
        if part.vertex_count == self._vertex_count:
            self._whole[name] = values
            return
        if name not in self._whole:
            self._whole[name] = np.zeros((self._vertex_count, values.shape[1]), values.dtype)
        if part.vertex_count > 0:  # the array may be a read-only view of an earlier part
            self._whole[name][part.first_vertex : part.first_vertex + part.vertex_count] = values

    def _finish(self, frame: Frame) -> None:
        whole, self._whole = self._whole, {}
        if self._quantization is None:
            none = np.zeros((0, 3), self._scalar)
            frame._raw = {
                "positions": sealed(whole.get("positions", none)),
                "distortion": sealed(whole.get("distortion", none).reshape(-1)),
                "normals": sealed(whole.get("normals", none)),
            }
        else:
            origin, extent = self._quantization.origin, self._quantization.extent
            frame.quantized = QuantizedSurface(
                sealed(whole["vertices"]),
                sealed(whole.get("normals", np.zeros((0, 4), "<i2"))),
                np.array([origin.x, origin.y, origin.z]),
                np.array([extent.x, extent.y, extent.z]),
                self._quantization.distortion_extent,
            )
        frame.received_at = time.perf_counter()


def _misfit(text: str) -> LpdeformError:
    return make(Code.DATA_LOSS, text, "FRAME_PARTS")


def _wrong_size(part: frame_pb2.FramePart) -> LpdeformError:
    return _misfit(f"A part of frame {part.frame_seq} has the wrong number of bytes for {part.vertex_count} vertices.")


def stop_reason_name(reason: int) -> str:
    """"converged" and so on; "running" if there is none."""
    known = frame_pb2.StopReason.items()
    names = {number: name.removeprefix("STOP_REASON_").lower() for name, number in known}
    return "running" if reason == frame_pb2.STOP_REASON_UNSPECIFIED else names.get(reason, "running")


def method_name(method: int) -> str:
    """"quasi_newton" and so on; empty if no method runs."""
    names = {number: name.removeprefix("METHOD_").lower() for name, number in handle_pb2.Method.items()}
    return "" if method == handle_pb2.METHOD_UNSPECIFIED else names.get(method, "")
