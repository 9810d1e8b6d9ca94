"""How the Python client reads the golden recordings: see replay.py.   replay_python.py ADDRESS NUMBER_OF_ERRORS"""

import struct
import sys

import lpdeform
import numpy as np
from lpdeform.errors import Code

numbers = {code: number for number, code in enumerate(Code, start=1)}

x = np.repeat(np.arange(11.0), 2)
strip = np.stack([x, np.tile([0.0, 1.0], 11), 0 * x], axis=1)
faces = np.concatenate([[[k, k + 2, k + 3], [k, k + 3, k + 1]] for k in range(0, 20, 2)])


def tell(name, what, values):
    bits = np.asarray(values, "<f4").reshape(-1).view("<u4")
    print(f"{name} {what}:" + "".join(f" {number:08x}" for number in bits))


def tell_error(where, error):
    print(f"{where} {numbers[error.code]} {error.reason} | {error.element} | {error.limit} | {error.args[0]}")


def open_strip(address, encoding):
    """With both handles."""
    handles = {
        "base": lpdeform.Handle([0, 1]),
        "tip": lpdeform.Handle([20, 21], lpdeform.RigidMotion(translation=(-4, 0, 3))),
    }
    return lpdeform.open(strip, faces, address=address, encoding=encoding, with_normals=True, handles=handles)


def tell_frame(name, frame):
    energy = struct.pack(">d", frame.energy).hex()
    print(f"{name}: result {frame.is_final:d}, {frame.stop_reason}, iteration {frame.iteration}, energy {energy}")
    tell(name, "positions", frame.positions)
    tell(name, "distortion", frame.distortion)
    tell(name, "normals", frame.normals)


def settle_again(session):
    """What settle() says that may not wait."""
    try:
        frame = session.settle(0)
        print(f"settled again: {frame.stop_reason}, iteration {frame.iteration}")
    except lpdeform.Timeout as error:
        print(f"settled again: {error.reason}")


def tell_calls(address):
    with open_strip(address, "float32") as session:
        session.settle(30)
        settle_again(session)
        session.drag("tip", translation=[0, 0, 1])
        settle_again(session)
        session.undo()
        tell_frame("undo", session.settle(30))
        settle_again(session)
        file = session.snapshot()
        print(f"snapshot: {len(file)} bytes")
    with lpdeform.restore(file, address=address) as restored:
        print(f"restored: {restored.name}")


def main(address, errors):
    sys.stdout.reconfigure(encoding="utf-8")
    for encoding in ("float64", "float32", "quantized", "compressed"):
        with open_strip(address, encoding) as session:
            tell_frame(encoding, session.settle(30))
            print(f"{encoding} notice: {session.notice.reason}, {session.notice.text}")
    tell_calls(address)
    for k in range(errors):
        try:
            lpdeform.open(np.zeros((1000 + k, 3)), [[0, 1, 2]], address=address)
        except lpdeform.LpdeformError as error:
            tell_error("call", error)
    with lpdeform.open(strip, faces, address=address) as session:
        for k in range(errors):
            session.drag(str(k), lpdeform.Fixed())
            try:
                session.next_frame(30)
            except lpdeform.LpdeformError as error:
                tell_error("fault", error)


main(sys.argv[1], int(sys.argv[2]))
