"""Frames from parts, without a network and with numbers made by hand."""

import numpy as np
import pytest

from lpdeform import FrameAssembly, LpdeformError
from lpdeform.errors import Code, make
from lpdeform.v1 import data_pb2, frame_pb2, service_pb2


def raw_part(first: int, positions: list[float], last: bool, total: int = 0) -> frame_pb2.FramePart:
    count = len(positions) // 3
    part = frame_pb2.FramePart(
        frame_seq=7,
        first_vertex=first,
        vertex_count=count,
        last=last,
        positions=np.array(positions, "<f4").tobytes(),
        distortion=np.full(count, 0.5, "<f4").tobytes(),
    )
    if total:
        part.header.CopyFrom(frame_pb2.FrameHeader(frame_seq=7, input_seq=3, vertex_count=total, is_final=True))
    return part


def test_parts_are_put_together_in_order() -> None:
    assembly = FrameAssembly(3)
    assert assembly.add(raw_part(0, [1, 2, 3], False, total=3)) is None
    frame = assembly.add(raw_part(1, [4, 5, 6, 7, 8, 9], True))
    assert frame is not None
    assert frame.positions.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    assert frame.distortion.tolist() == [0.5, 0.5, 0.5]
    assert frame.normals.shape == (0, 3)
    assert (frame.input_seq, frame.is_final, frame.optimality_gap) == (3, True, None)
    with pytest.raises(ValueError, match="read-only"):
        frame.positions[0, 0] = 0


def test_doubles_come_bit_for_bit() -> None:
    part = raw_part(0, [0, 0, 0], True, total=1)
    part.header.scalar = data_pb2.SCALAR_FLOAT64
    part.positions = np.array([0.1, 1e300, -3]).tobytes()
    part.distortion = b""
    frame = FrameAssembly(1).add(part)
    assert frame is not None
    assert frame.positions.tolist() == [[0.1, 1e300, -3]]
    assert frame.distortion.shape == (0,)


def quantized_part() -> frame_pb2.FramePart:
    part = frame_pb2.FramePart(frame_seq=1, vertex_count=2, last=True)
    part.positions = np.array([[0, 65535, 13107, 65535], [65535, 0, 0, 0]], "<u2").tobytes()
    part.normals = np.array([[32767, 0, 0, 0], [0, -32767, 0, 0]], "<i2").tobytes()
    header = part.header
    header.frame_seq, header.vertex_count, header.encoding = 1, 2, frame_pb2.ENCODING_QUANTIZED
    header.quantization.origin.CopyFrom(data_pb2.Vector3(x=-1, y=2, z=10))
    header.quantization.extent.CopyFrom(data_pb2.Vector3(x=4, y=6, z=5))
    header.quantization.distortion_extent = 3
    return part


def test_quantized_numbers_are_what_the_contract_says() -> None:
    frame = FrameAssembly(2).add(quantized_part())
    assert frame is not None
    assert np.allclose(frame.positions, [[-1, 8, 11], [3, 2, 10]], rtol=0, atol=1e-6)  # float32 of numbers up to 11
    assert frame.distortion.tolist() == [3, 0]
    assert frame.normals.tolist() == [[1, 0, 0], [0, -1, 0]]
    assert frame.quantized is not None
    assert frame.quantized.vertices[0].tolist() == [0, 65535, 13107, 65535]


def test_what_does_not_fit_is_refused() -> None:
    def refused(assembly: FrameAssembly, part: frame_pb2.FramePart) -> str:
        with pytest.raises(LpdeformError) as caught:
            assembly.add(part)
        assert caught.value.reason == "FRAME_PARTS"
        return str(caught.value)

    assert "3 vertices, the mesh 2" in refused(FrameAssembly(2), raw_part(0, [1, 2, 3], True, total=3))
    assert "does not follow" in refused(FrameAssembly(2), raw_part(0, [1, 2, 3], True))
    assert "ends after 1 of 2" in refused(FrameAssembly(2), raw_part(0, [1, 2, 3], True, total=2))
    gap = FrameAssembly(3)
    gap.add(raw_part(0, [1, 2, 3], False, total=3))
    assert "does not follow" in refused(gap, raw_part(2, [1, 2, 3], True))
    short = raw_part(0, [1, 2, 3], True, total=1)
    short.positions = short.positions[:-1]
    assert "wrong number of bytes" in refused(FrameAssembly(1), short)
    broken = quantized_part()
    broken.header.encoding = frame_pb2.ENCODING_COMPRESSED
    assert "wrong number of bytes" in refused(FrameAssembly(2), broken)
    unknown = quantized_part()
    unknown.header.encoding = 9  # type: ignore[assignment]
    assert "not asked for" in refused(FrameAssembly(2), unknown)
