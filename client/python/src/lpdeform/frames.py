"""Frames: states of the surface on their way to the result."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from lpdeform.types import Floats

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


class FrameHeader(NamedTuple):
    """The scalars of a frame."""

    input_seq: int = 0
    frame_seq: int = 0
    epoch: int = 0
    skipped_inputs: int = 0
    iteration: int = 0
    energy: float = 0.0
    soft_energy: float = 0.0
    is_final: bool = False
    stop_reason: str = "running"
    solve_seconds: float = 0.0
    method: str = ""
    optimality_gap: float | None = None


class Frame:
    """A state of the surface on its way to the result.

    Arrays are read-only views of the received bytes, or of the solver's where it is in this process; copy them to change them. For a quantized frame they are computed when they
    are first read.
    """

    def __init__(self, header: FrameHeader) -> None:
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
        self.stop_reason: str = header.stop_reason
        self.solve_seconds: float = header.solve_seconds
        self.method: str = header.method
        """"quasi_newton" and so on; empty before the first solve."""
        self.optimality_gap: float | None = header.optimality_gap
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
        return sealed((vertices[:, :3] * (extent / _most_unsigned) + origin).astype(np.float32))

    @cached_property
    def distortion(self) -> Floats:
        """E_i of each vertex, in the mesh's unit of length; empty if it was not requested."""
        if self.quantized is None:
            return self._raw["distortion"]
        scale = self.quantized.distortion_extent / _most_unsigned
        return sealed((self.quantized.vertices[:, 3] * scale).astype(np.float32))

    @cached_property
    def normals(self) -> Floats:
        """n x 3, of length 1; 0 x 3 if they were not requested."""
        if self.quantized is None:
            return self._raw["normals"]
        return sealed((self.quantized.normals[:, :3] / _most_signed).astype(np.float32))

    def __repr__(self) -> str:
        state = self.stop_reason if self.is_final else f"iteration {self.iteration}"
        count = len(self._raw["positions"] if self.quantized is None else self.quantized.vertices)
        return f"<Frame of {count} vertices: {state}, energy {self.energy:.6g}, update {self.input_seq}>"


def sealed(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    array.flags.writeable = False
    return array
