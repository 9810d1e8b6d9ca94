"""Frames, and how they are assembled from the server's messages."""

from __future__ import annotations

import time
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from lpdeform import _codec
from lpdeform.errors import Code, LpdeformError, make
from lpdeform.types import Floats
from lpdeform.v1 import data_pb2, frame_pb2, handle_pb2

_most_unsigned, _most_signed = 65535.0, 32767.0


class QuantizedSurface(NamedTuple):
    """The received integers of a frame in encoding "quantized" or "compressed"."""

    vertices: npt.NDArray[np.uint16]
    """n x 4: x, y, z and distortion; a position is origin + q / 65535 * extent, per component."""
    normals: npt.NDArray[np.int16]
    """n x 4: x, y, z and 0, as integers with 32767 for 1; 0 x 4 if they were not requested."""
    origin: npt.NDArray[np.float64]
    extent: npt.NDArray[np.float64]
    distortion_extent: float
    """E_i = q / 65535 * distortion_extent."""


class Frame:
    """A state of the surface on its way to the optimum.

    Arrays are read-only views of the received bytes; copy them to change them. For a quantized frame they are computed when they
    are first read.
    """

    def __init__(self, header: frame_pb2.FrameHeader) -> None:
        self.input_seq: int = header.input_seq
        """The newest update that the frame answers; never falls."""
        self.frame_seq: int = header.frame_seq
        """Rises within an epoch."""
        self.epoch: int = header.epoch
        self.skipped_inputs: int = header.skipped_inputs
        """Updates since the previous frame that no frame answers."""
        self.iteration: int = header.iteration
        self.energy: float = header.energy
        """E of the positions, Eq. 3 of the paper, in the mesh's unit, including soft terms."""
        self.soft_energy: float = header.soft_energy
        """The part of the energy that soft and orientation handles have."""
        self.is_final: bool = header.is_final
        """The result for input_seq, however its solve ended (stop_reason). No further frame comes until there is a new update,
        except the same frame with its gap, and a better shape that is taken or shown (MinimaSearch)."""
        self.stop_reason: str = stop_reason_name(header.stop_reason)
        self.solve_seconds: float = header.solve_seconds
        self.method: str = method_name(header.method)
        """"quasi_newton" and so on; empty before the first solve."""
        self.optimality_gap: float | None = header.certificate.relative_gap if header.HasField("certificate") else None
        """(E - lower bound) / E of the convex problem with its rotations held; see `certify` of open()."""
        self.quantized: QuantizedSurface | None = None
        self.wire_bytes: int = 0
        """Bytes of positions, distortion and normals as received."""
        self.received_at: float = 0.0
        """When its last part came, on the clock of time.perf_counter()."""
        self._raw: dict[str, Floats] = {}

    @cached_property
    def positions(self) -> Floats:
        """n x 3: float32, or float64 if that was requested."""
        if self.quantized is None:
            return self._raw["positions"]
        vertices, _, origin, extent, _ = self.quantized
        return _sealed((vertices[:, :3] * (extent / _most_unsigned) + origin).astype(np.float32))

    @cached_property
    def distortion(self) -> Floats:
        """E_i of each vertex, in the mesh's unit of length; empty if it was not requested."""
        if self.quantized is None:
            return self._raw["distortion"]
        scale = self.quantized.distortion_extent / _most_unsigned
        return _sealed((self.quantized.vertices[:, 3] * scale).astype(np.float32))

    @cached_property
    def normals(self) -> Floats:
        """n x 3, of length 1; 0 x 3 if they were not requested."""
        if self.quantized is None:
            return self._raw["normals"]
        return _sealed((self.quantized.normals[:, :3] / _most_signed).astype(np.float32))

    def __repr__(self) -> str:
        state = self.stop_reason if self.is_final else f"iteration {self.iteration}"
        count = len(self._raw["positions"] if self.quantized is None else self.quantized.vertices)
        return f"<Frame of {count} vertices: {state}, energy {self.energy:.6g}, update {self.input_seq}>"


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
        return Frame(header)

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
                "positions": _sealed(whole.get("positions", none)),
                "distortion": _sealed(whole.get("distortion", none).reshape(-1)),
                "normals": _sealed(whole.get("normals", none)),
            }
        else:
            origin, extent = self._quantization.origin, self._quantization.extent
            frame.quantized = QuantizedSurface(
                _sealed(whole["vertices"]),
                _sealed(whole.get("normals", np.zeros((0, 4), "<i2"))),
                np.array([origin.x, origin.y, origin.z]),
                np.array([extent.x, extent.y, extent.z]),
                self._quantization.distortion_extent,
            )
        frame.received_at = time.perf_counter()


def _sealed(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    array.flags.writeable = False
    return array


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
