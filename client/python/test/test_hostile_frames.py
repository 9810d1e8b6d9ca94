"""Damaged frames: each gives a valid frame or the error FRAME_PARTS, and never anything else."""

import base64
import json
import random
from pathlib import Path

import pytest
from google.protobuf.message import DecodeError

from lpdeform import FrameAssembly, LpdeformError
from lpdeform.frames import Frame
from lpdeform.v1 import frame_pb2, service_pb2

RECORDED = json.loads((Path(__file__).parents[3] / "tests/golden/frames.json").read_text())["streams"]
VERTICES = 22  # of the recorded mesh
NUMBERS = [0, 1, 2, VERTICES - 1, VERTICES, VERTICES + 1, 2**16, 2**31 - 1, 2**31, 2**32 - 1]
BYTES = ("positions", "distortion", "normals")


def recorded_parts(stream: dict[str, list[str]]) -> list[frame_pb2.FramePart]:
    responses = [service_pb2.DeformResponse.FromString(base64.b64decode(text)) for text in stream["responses"]]
    return [response.event.frame for response in responses if response.event.HasField("frame")]


def halves(part: frame_pb2.FramePart, at: int) -> list[frame_pb2.FramePart]:
    """A recorded frame in one part and in two, with bytes that can be cut."""
    first, second = frame_pb2.FramePart(), frame_pb2.FramePart()
    first.CopyFrom(part)
    second.CopyFrom(part)
    second.ClearField("header")
    first.vertex_count, first.last = at, False
    second.vertex_count, second.first_vertex = VERTICES - at, at
    for name in BYTES:
        data = getattr(part, name)
        cut = len(data) // VERTICES * at
        setattr(first, name, data[:cut])
        setattr(second, name, data[cut:])
    return [first, second]


def damage(parts: list[frame_pb2.FramePart], chance: random.Random) -> None:
    part = chance.choice(parts)
    way = chance.randrange(8)
    if way == 0:
        setattr(part, chance.choice(["first_vertex", "vertex_count"]), chance.choice(NUMBERS))
    elif way == 1:
        part.last = not part.last
    elif way == 2 and part.HasField("header"):
        part.ClearField("header")
    elif way == 3:
        part.header.vertex_count = chance.choice(NUMBERS)
    elif way == 4:
        part.header.encoding = chance.choice([-1, 0, 1, 2, 3, 4, 2**31 - 1])
        part.header.scalar = chance.choice([-1, 0, 1, 2, 7])
    elif way == 5:
        name = chance.choice(BYTES)
        data = bytearray(getattr(part, name))
        if chance.random() < 0.5:
            del data[chance.randrange(len(data) + 1) :]
        else:
            data += chance.randbytes(chance.choice([1, 3, 8, 400]))
        setattr(part, name, bytes(data))
    elif way == 6:
        parts[:] = chance.choices(parts, k=chance.randrange(1, 5))
    else:  # any bytes of the message, as long as that is still one
        wire = bytearray(part.SerializeToString())
        for _ in range(chance.randrange(1, 4) if wire else 0):
            wire[chance.randrange(len(wire))] = chance.randrange(256)
        try:
            part.CopyFrom(frame_pb2.FramePart.FromString(bytes(wire)))
        except DecodeError:
            part.Clear()


def check_whole(frame: Frame) -> None:
    assert frame.positions.shape == (VERTICES, 3)
    assert frame.distortion.shape in ((0,), (VERTICES,))
    assert frame.normals.shape in ((0, 3), (VERTICES, 3))
    assert repr(frame)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # numbers that overflow are numbers
def test_damaged_frames_are_refused_and_whole_ones_taken() -> None:
    chance = random.Random(2012)
    taken = refused = 0
    for turn in range(20_000):
        parts = []
        for part in chance.sample(recorded_parts(chance.choice(RECORDED)), 1):
            can_be_cut = part.header.encoding != frame_pb2.ENCODING_COMPRESSED and chance.random() < 0.5
            parts += halves(part, chance.randrange(VERTICES + 1)) if can_be_cut else [part]
        if turn % 10 != 0:
            for _ in range(chance.randrange(1, 4)):
                damage(parts, chance)
        assembly = FrameAssembly(VERTICES)
        for part in parts:
            try:
                frame = assembly.add(part)
            except LpdeformError as error:
                assert error.reason == "FRAME_PARTS"
                refused += 1
            else:
                if frame is not None:
                    check_whole(frame)
                    taken += 1
                elif turn % 10 == 0:
                    assert part is not parts[-1]
    assert taken > 2_000 and refused > 2_000, (taken, refused)


def test_a_frame_with_normals_for_a_part_of_its_vertices_is_refused() -> None:
    whole = recorded_parts(RECORDED[0])[0]
    for missing in BYTES[1:]:
        for at in (0, 1):
            parts = halves(whole, 11)
            assert getattr(parts[at], missing)
            parts[at].ClearField(missing)
            assembly = FrameAssembly(VERTICES)
            assembly.add(parts[0])
            with pytest.raises(LpdeformError, match="for a part of its vertices"):
                assembly.add(parts[1])
