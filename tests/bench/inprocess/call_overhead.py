"""What a call of lpdeform.deform costs over one of lpdeform::core::deform, on the same meshes, in turns; see run."""

from __future__ import annotations

import argparse
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "peers"))
from compare import read_handles, read_off  # noqa: E402

CALLS = 5  # of a process; the first does not count


def write_grid(task, side):
    """A flat square whose right edge is lifted."""
    y, x = np.mgrid[0:side, 0:side]
    vertices = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1)
    faces = np.concatenate([np.stack([corner, corner + 1, corner + side], 1),
                            np.stack([corner + 1, corner + side + 1, corner + side], 1)])
    lines = [f"OFF\n{len(vertices)} {len(faces)} 0"]
    lines += ["%d %d %d" % tuple(one) for one in vertices] + ["3 %d %d %d" % tuple(one) for one in faces]
    task.with_suffix(".off").write_text("\n".join(lines) + "\n")
    ends = [(k, *one) for k, one in enumerate(vertices) if one[0] in (0, side - 1)]
    task.with_suffix(".txt").write_text("".join(f"{k} {x} {y} {side / 2 if x else 0}\n" for k, x, y, _ in ends))


def by_python(task, p):
    import lpdeform

    vertices, faces = read_off(task.with_suffix(".off"))
    held, targets = read_handles(task.with_suffix(".txt"))
    for _ in range(CALLS):
        start = time.perf_counter()
        result = lpdeform.deform(vertices, faces, {"held": (held, targets)}, p=p, certify=False)
        print(f"{time.perf_counter() - start:.9f} {result.iterations}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--make", help="the program lpdeform_peer")
    parser.add_argument("--core", help="the program core_call")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--one", help="of a child: the task, without its ending, and p", nargs=2)
    options = parser.parse_args()
    if options.one:
        by_python(pathlib.Path(options.one[0]), float(options.one[1]))
        return
    print("| mesh | p | C++ | Python | Python over C++ |\n|:--|--:|--:|--:|--:|")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([options.make, "make", folder], check=True)
        for side in (10, 32):
            write_grid(pathlib.Path(folder, f"grid_{side * side}"), side)
        for name, p in (("grid_100", 2), ("grid_1024", 2), ("creature_10k", 2), ("creature_10k", 1.5)):
            task = pathlib.Path(folder, name)
            commands = {
                "C++": [options.core, f"{task}.off", f"{task}.txt", str(p), str(CALLS)],
                "Python": [sys.executable, __file__, "--one", str(task), str(p)],
            }
            seconds, iterations = {name: [] for name in commands}, set()
            for _ in range(options.rounds):
                for program, command in commands.items():
                    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split("\n")[1:CALLS]
                    seconds[program] += [float(line.split()[0]) for line in lines]
                    iterations |= {line.split()[1] for line in lines}
            if len(iterations) != 1:
                sys.exit(f"{name}: the programs did not do the same: {iterations} iterations")
            cpp, python = (statistics.median(each) for each in seconds.values())
            print(f"| {name} | {p} | {1e3 * cpp:.2f} ms | {1e3 * python:.2f} ms | {1e3 * (python - cpp):.2f} ms, {python / cpp:.3f} times |")


if __name__ == "__main__":
    main()
