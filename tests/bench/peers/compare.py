"""Runs lpdeform and its peers on the same tasks; see run.

Every program starts from the Laplacian deformation and stores its positions after its iterations. Energies are evaluated here, by
one function that shares no code with any of them, and never count in a time. A peer's time to 1 % is the time of its iterations
until E^(1/p) is within 1 % of the best energy that any program found.
"""

import argparse
import importlib.util
import json
import math
import pathlib
import statistics
import subprocess
import time

import numpy as np

PEER_SECONDS = 60
SETUPS = 5
LIMITS = (1.01, 1.001)


def read_off(path):
    tokens = " ".join(line.split("#")[0] for line in path.read_text().splitlines()).split()
    n, m = int(tokens[1]), int(tokens[2])
    vertices = np.array(tokens[4:4 + 3 * n], float).reshape(n, 3)
    faces = np.array(tokens[4 + 3 * n:4 + 3 * n + 4 * m], int).reshape(m, 4)[:, 1:]
    return vertices, faces


def read_handles(path):
    table = np.loadtxt(path, ndmin=2)
    return table[:, 0].astype(int), table[:, 1:]


class Energy:
    """E of Eq. 3 with clamped cotangent weights and rotations by SVD."""

    def __init__(self, vertices, faces):
        sums = {}
        for k in range(3):
            a, b, c = faces[:, k], faces[:, (k + 1) % 3], faces[:, (k + 2) % 3]
            u, v = vertices[a] - vertices[c], vertices[b] - vertices[c]
            area = np.linalg.norm(np.cross(u, v), axis=1)
            cotangents = np.divide((u * v).sum(1), area, out=np.zeros(len(area)), where=area > 0)
            for i, j, cotangent in zip(a, b, cotangents):
                key = (min(i, j), max(i, j))
                sums[key] = sums.get(key, 0.0) + cotangent / 2
        edges = np.array(list(sums))
        weights = np.maximum(np.array(list(sums.values())), 0)
        self.i = np.concatenate([edges[:, 0], edges[:, 1]])
        self.j = np.concatenate([edges[:, 1], edges[:, 0]])
        self.w = np.concatenate([weights, weights])
        self.rest = vertices[self.i] - vertices[self.j]
        self.n = len(vertices)

    def cells(self, x):
        moved = x[self.i] - x[self.j]
        outer = (self.w[:, None, None] * moved[:, :, None] * self.rest[:, None, :]).reshape(-1, 9)
        sums = np.stack([np.bincount(self.i, outer[:, k], self.n) for k in range(9)], 1).reshape(-1, 3, 3)
        u, _, vt = np.linalg.svd(sums)
        u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
        rotated = np.einsum("nij,nj->ni", (u @ vt)[self.i], self.rest)
        return np.bincount(self.i, self.w * ((moved - rotated) ** 2).sum(1), self.n)

    def __call__(self, x, p):
        return (self.cells(x) ** (p / 2)).sum()


class Run:
    """What one program did on one task: seconds of set-up and at each kept iteration, and E^(1/p) there."""

    def __init__(self, setup, seconds, kept, roots):
        self.setup, self.iterations = setup, len(seconds)
        self.per_iteration = seconds[-1] / len(seconds)
        self.seconds = np.array(seconds)[np.array(kept, int) - 1]
        self.roots = np.array(roots)
        self.total = seconds[-1]

    def time_to(self, root):
        reached = np.nonzero(self.roots <= root)[0]
        return self.seconds[reached[0]] if len(reached) else math.inf


def stored_run(out, n, energy, p):
    info = json.loads(pathlib.Path(f"{out}.json").read_text())
    states = np.fromfile(f"{out}.f64").reshape(-1, n, 3)
    run = Run(info["setup"], info["seconds"], info["kept"], [energy(x, p) ** (1 / p) for x in states])
    pathlib.Path(f"{out}.f64").unlink()
    return run


def program(command, out, n, energy, p):
    subprocess.run([str(part) for part in command], check=True)
    return stored_run(out, n, energy, p)


def with_median_setup(run, command_for, out):
    """Repeats the set-up with almost no solving: the median of SETUPS, the first of which had a cold start."""
    setups = [run.setup]
    while len(setups) < SETUPS:
        subprocess.run([str(part) for part in command_for(0.001)], check=True)
        setups.append(json.loads(pathlib.Path(f"{out}.json").read_text())["setup"])
    pathlib.Path(f"{out}.f64").unlink()
    run.setup = statistics.median(setups)
    return run


def igl_run(task, energy, limit):
    """libigl's arap, one iteration a call, from the Laplacian deformation. It does not clamp its weights."""
    import igl

    vertices, faces = read_off(task.with_suffix(".off"))
    held, targets = read_handles(task.with_suffix(".txt"))
    faces = faces.astype(np.int64)
    laplacian = igl.harmonic(vertices, faces, held.astype(np.int64), targets - vertices[held], 1)
    x = vertices + laplacian
    setups = []
    for _ in range(SETUPS):
        data = igl.ARAPData()
        data.max_iter = 1
        start = time.perf_counter()
        igl.arap_precomputation(vertices, faces, 3, held.astype(np.int32), data)
        setups.append(time.perf_counter() - start)
    setup = statistics.median(setups)
    seconds, roots, total = [], [], 0.0
    while total < limit:
        start = time.perf_counter()
        x = igl.arap_solve(targets, data, x)
        total += time.perf_counter() - start
        seconds.append(total)
        roots.append(energy(x, 2) ** 0.5)
        if not np.isfinite(roots[-1]) or roots[-1] > 10 * roots[0]:
            break  # it diverges on obtuse meshes
        if len(roots) > 20 and abs(roots[-20] - roots[-1]) < 1e-6 * roots[-1]:
            break
    return Run(setup, seconds, range(1, len(seconds) + 1), roots)


def open3d_run(task, energy, limit):
    """Open3D's deform_as_rigid_as_possible, whose first iteration is the Laplacian deformation. Each call
    starts from scratch, so runs of increasing length are timed, less one without iterations. Doubling ends at the limit."""
    import open3d

    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    vertices, faces = read_off(task.with_suffix(".off"))
    held, targets = read_handles(task.with_suffix(".txt"))
    mesh = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(vertices), open3d.utility.Vector3iVector(faces))
    ids, positions = open3d.utility.IntVector(held.astype(np.int32)), open3d.utility.Vector3dVector(targets)

    def call(iterations):
        start = time.perf_counter()
        result = mesh.deform_as_rigid_as_possible(ids, positions, max_iter=iterations)
        return time.perf_counter() - start, np.asarray(result.vertices)

    setup = statistics.median(call(0)[0] for _ in range(SETUPS))
    seconds, kept, roots, count = [], [], [], 1
    while setup + 3 * (seconds[-1] if seconds else 0) < limit:
        taken, x = call(count)
        seconds.append(max(taken - setup, 1e-6))
        kept.append(count)
        roots.append(energy(x, 2) ** 0.5)
        if len(roots) > 2 and abs(roots[-2] - roots[-1]) < 1e-6 * roots[-1]:
            break
        count = max(count + 1, round(1.3 * count))
    if not seconds:
        return None
    every = np.interp(np.arange(1, kept[-1] + 1), kept, np.maximum.accumulate(seconds))
    return Run(setup, list(every), kept, roots)


def loads(name):
    """Whether a Python peer is there and works on this machine."""
    if importlib.util.find_spec(name) is None:
        return False
    try:
        importlib.import_module(name)
    except (ImportError, OSError) as error:
        print(f"{name} does not load here: {error}")
        return False
    return True


def geometric_mean(values):
    """Of what is known; a ratio is 0 where lpdeform itself did not get there, and then so is the mean."""
    values = [value for value in values if math.isfinite(value)]
    if 0 in values:
        return 0.0
    return math.exp(sum(map(math.log, values)) / len(values)) if values else math.nan


def shown(seconds):
    return "-" if not math.isfinite(seconds) else f"{1e3 * seconds:.1f}"


def at_two(tasks, programs, limit):
    """Table 1: p = 2 against CGAL, libigl and Open3D."""
    print("\np = 2; milliseconds; times to 1 % and 0.1 % of the best E^(1/p) any of them found; a ratio > is a bound:\n"
          "CGAL did not get there in its time")
    header = ("task", "vertices", "who", "set-up", "iteration", "to 1 %", "to 0.1 %", "x at 1 %", "x at 0.1 %", "x iteration")
    print("".join(f"{cell:>14}" for cell in header))
    ratios = {"lpdeform 1 thread": ([], [], []), "lpdeform 2 threads": ([], [], [])}
    rows = []
    for task in tasks:
        vertices, faces = read_off(task.with_suffix(".off"))
        energy, n = Energy(vertices, faces), len(vertices)
        mesh, handles, out = task.with_suffix(".off"), task.with_suffix(".txt"), task.with_suffix("")
        commands = {"CGAL": (lambda limit: [programs / "cgal_peer", mesh, handles, limit, f"{out}.cgal"], f"{out}.cgal")}
        for threads in (1, 2):
            commands[f"lpdeform {threads} thread{'s' * (threads > 1)}"] = (
                lambda limit, threads=threads: [programs / "lpdeform_peer", "solve", mesh, handles, 2, "auto", threads, limit,
                                                f"{out}.lp"], f"{out}.lp")
        runs = {who: with_median_setup(program(command_for(limit), name, n, energy, 2), command_for, name)
                for who, (command_for, name) in commands.items()}
        if loads("igl"):
            runs["libigl"] = igl_run(task, energy, min(limit, 20))
        if loads("open3d"):
            runs["Open3D"] = open3d_run(task, energy, min(limit, 20))
        runs = {who: run for who, run in runs.items() if run is not None}
        best = min(run.roots[np.isfinite(run.roots)].min() for run in runs.values())
        cgal = runs["CGAL"]
        for who, run in runs.items():
            times = [run.time_to(limit_ * best) for limit_ in LIMITS]
            factors = [min(cgal.time_to(limit_ * best), cgal.total) / t for limit_, t in zip(LIMITS, times)]
            bounds = [not math.isfinite(cgal.time_to(limit_ * best)) for limit_ in LIMITS] + [False]
            factors.append(cgal.per_iteration / run.per_iteration)
            if who in ratios:
                for factor, column in zip(factors, ratios[who]):
                    column.append(factor)
            print(f"{task.name:>14}{n:>14}{who:>20}{1e3 * run.setup:>8.1f}{1e3 * run.per_iteration:>14.2f}"
                  + "".join(f"{shown(t):>14}" for t in times)
                  + "".join(f"{'>' * bound + format(factor, '.1f'):>14}" for factor, bound in zip(factors, bounds)),
                  flush=True)
            rows.append({"task": task.name, "vertices": n, "who": who, "setup": run.setup,
                         "iteration": run.per_iteration, "to": times, "factors": factors, "bounds": bounds})
    for who, columns in ratios.items():
        print(f"geometric mean, {who}: " + ", ".join(
            f"x{geometric_mean(column):.1f} {name}" for column, name in zip(columns, header[-3:])))
    return rows


def against_line_search(tasks, programs, limit):
    """Table 2: our default method against the paper's, to the energy at which that meets its own stop."""
    print(f"\nagainst line_search, the paper's method on the same cell pass ({limit} s at most: then a bound)")
    rows = []
    for task in tasks:
        vertices, faces = read_off(task.with_suffix(".off"))
        energy, n = Energy(vertices, faces), len(vertices)
        for p in (1, 1.5, 6):
            runs = []
            for method in ("line_search", "auto"):
                command = [programs / "lpdeform_peer", "solve", task.with_suffix(".off"), task.with_suffix(".txt"), p,
                           method, 1, limit, f"{task}.{method}"]
                runs.append(program(command, f"{task}.{method}", n, energy, p))
            theirs, ours = runs
            reached = theirs.roots.min()
            bound = theirs.total + 2 * theirs.per_iteration >= limit  # its own stop was not reached
            factor = theirs.total / ours.time_to(reached)
            print(f"{task.name:>14}  p = {p:<4} {theirs.total:8.2f} s to E^(1/p) = {reached:.6g}, ours "
                  f"{1e3 * ours.time_to(reached):.1f} ms and on to {ours.roots.min():.6g}: "
                  f"x{'>' * bound}{factor:.0f}")
            rows.append({"task": task.name, "p": p, "factor": factor, "is_bound": bool(bound)})
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", type=pathlib.Path, required=True)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--meshes", type=pathlib.Path, help="a folder with more tasks, NAME.off and NAME.txt")
    parser.add_argument("--quick", action="store_true", help="the small tasks only, 5 s each")
    parser.add_argument("--seconds", type=float, default=PEER_SECONDS, help="of solving a task at p = 2, at most")
    options = parser.parse_args()
    tasks_folder = options.work / "tasks"
    tasks_folder.mkdir(parents=True, exist_ok=True)
    subprocess.run([options.programs / "lpdeform_peer", "make", tasks_folder], check=True)
    names = ["bar", "sheet", "block"] + ([] if options.quick else ["creature_10k", "bumpy_plane", "creature_100k"])
    tasks = [tasks_folder / name for name in names]
    if options.meshes:
        tasks += [path.with_suffix("") for path in sorted(options.meshes.glob("*.off"))]
    results = {"p2": at_two(tasks, options.programs, 5 if options.quick else options.seconds)}
    results["line_search"] = against_line_search(tasks[:2], options.programs, 5 if options.quick else PEER_SECONDS)
    (options.work / "results.json").write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
