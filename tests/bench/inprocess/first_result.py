"""From import to the first result, by lpdeform and by libigl, in turns and each time in a new process; see run.

Times begin when NumPy is there and the arrays are read. A program's time to 1 % is that of its import, its set-up and its iterations
until E^(1/2) is within 1 % of the best that either found. Energies are those of tests/bench/peers, and never count in a time.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "peers"))
from compare import Energy, read_handles, read_off  # noqa: E402

NEAR = 1.01
LONGEST = 20  # seconds of libigl's iterations


def by_lpdeform(vertices, faces, held, targets):
    start = time.perf_counter()
    import lpdeform

    imported = time.perf_counter() - start
    handles = {"held": (held, targets)}
    result = lpdeform.deform(vertices, faces, handles, p=2, certify=False)
    whole = time.perf_counter() - start
    before = whole - result.solve_seconds  # import, arrays, set-up
    end = Energy(vertices, faces)(result.positions, 2) ** 0.5
    unit = end / result.energy ** 0.5
    steps = [(before + record.seconds, unit * record.energy ** 0.5) for record in result.trace]
    return {"import": imported, "whole": whole, "steps": [*steps, (whole, end)]}


def by_libigl(vertices, faces, held, targets):
    energy = Energy(vertices, faces)
    start = time.perf_counter()
    import igl

    imported = total = time.perf_counter() - start
    start = time.perf_counter()
    faces, order = faces.astype(np.int64), held.astype(np.int64)
    x = vertices + igl.harmonic(vertices, faces, order, targets - vertices[held], 1)
    data = igl.ARAPData()
    data.max_iter = 1
    igl.arap_precomputation(vertices, faces, 3, held.astype(np.int32), data)
    total += time.perf_counter() - start
    steps, limit = [], total + LONGEST
    while total < limit:
        start = time.perf_counter()
        x = igl.arap_solve(targets, data, x)
        total += time.perf_counter() - start
        steps.append((total, energy(x, 2) ** 0.5))
        if len(steps) > 20 and abs(steps[-20][1] - steps[-1][1]) < 1e-6 * steps[-1][1]:
            break
    return {"import": imported, "whole": total, "steps": steps}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--make", help="the program lpdeform_peer")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--one", help="of a child: NAME and the task, without its ending", nargs=2)
    options = parser.parse_args()
    if options.one:
        name, task = options.one[0], pathlib.Path(options.one[1])
        arrays = (*read_off(task.with_suffix(".off")), *read_handles(task.with_suffix(".txt")))
        print(json.dumps({"lpdeform": by_lpdeform, "libigl": by_libigl}[name](*arrays)))
        return
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([options.make, "make", folder], check=True)
        runs = {"lpdeform": [], "libigl": []}
        for _ in range(options.rounds):
            for name, each in runs.items():
                command = [sys.executable, __file__, "--one", name, f"{folder}/creature_10k"]
                each.append(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))
    best = min(root for each in runs.values() for run in each for _, root in run["steps"])
    print("| program | import | to 1 % | to its own end |\n|:--|--:|--:|--:|")
    to = {}
    for name, each in runs.items():
        to[name] = statistics.median(
            next((at for at, root in run["steps"] if root <= NEAR * best), float("inf")) for run in each)
        ends = [statistics.median(run[key] for run in each) for key in ("import", "whole")]
        print(f"| {name} | {1e3 * ends[0]:.0f} ms | {1e3 * to[name]:.0f} ms | {1e3 * ends[1]:.0f} ms |")
    print(f"\nTo 1 %, libigl's time over lpdeform's: {to['libigl'] / to['lpdeform']:.1f} (medians of {options.rounds} rounds)")


if __name__ == "__main__":
    main()
