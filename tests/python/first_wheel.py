"""What a wheel can do where nothing else is installed: first_wheel.py [--remote]. Ends with "1 passed, 0 failed"."""

import platform
import sys
import time

start = time.perf_counter()
import lpdeform  # noqa: E402
import numpy as np  # noqa: E402

SIDE = 101


def sheet():
    y, x = np.mgrid[0:SIDE, 0:SIDE].astype(float)
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).reshape(-1)
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + SIDE], 1), np.stack([corner + 1, corner + SIDE + 1, corner + SIDE], 1)]
    )
    return np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3), faces


def main() -> None:
    if "--remote" in sys.argv:
        try:
            lpdeform.open(*sheet(), address="localhost:1")
        except lpdeform.Unavailable as error:
            print(f"lpdeform[remote] answers: {error}")
        else:
            sys.exit("a server answered that is not there")
    vertices, faces = sheet()
    right = vertices[:, 0] == SIDE - 1
    up = lpdeform.RigidMotion(axis=(0, 1, 0), angle=-1.0, center=(SIDE - 1, 0, 0), translation=(-20, 0, 40))
    first = lpdeform.SolverSettings(search=lpdeform.MinimaSearch(effort=0))
    for p in (2, 1):
        result = lpdeform.deform(vertices, faces, {"left": vertices[:, 0] == 0, "right": (right, up)}, p=p, solver=first)
        assert result.stop_reason == "converged" and np.isfinite(result.positions).all() and result.optimality_gap is not None
        print(f"{len(vertices)} vertices, p = {p}: {result.stop_reason} after {result.iterations} iterations, gap {result.optimality_gap:.1e}")
    print(f"Python {platform.python_version()}, glibc {platform.libc_ver()[1]}, {time.perf_counter() - start:.1f} s from import on")
    print("1 passed, 0 failed")


main()
