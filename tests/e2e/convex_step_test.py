"""Certificates against an independent solver: convex_step_test.py CLI [unittest arguments].

At a result of lpdeform the rotations are held, which leaves a convex problem: minimise over x the sum of the E_i^p with E_i^2 =
sum_j w_ij |(x_i - x_j) - R_i (p_i - p_j)|^2, with handles at their targets. clarabel finds its optimum to nine digits. Weights,
rotations and energies are computed here from the two meshes alone. The certificate promises

    energy (1 - gap)  <=  optimum  <=  energy
"""

import json
import os
import subprocess
import sys
import tempfile
import unittest

import clarabel
import numpy as np
import scipy.sparse as sparse

CLI = None
PATIENCE = 280  # seconds that anything may take; never reached where all is well
EXACT = 1e-8  # of an energy: what clarabel leaves at its tolerances, ten times over
NORMS = (1, 1.5, 2, 6)


class Cells:
    """The directed edges of a mesh, as cells i around which they lie, with clamped cotangent weights."""

    def __init__(self, rest, faces):
        self.rest = rest
        weights = {}
        for a, b, c in (faces[:, turn].T for turn in ((0, 1, 2), (1, 2, 0), (2, 0, 1))):
            u, v = rest[a] - rest[c], rest[b] - rest[c]
            cotangents = np.sum(u * v, axis=1) / np.linalg.norm(np.cross(u, v), axis=1)
            for i, j, cotangent in zip(a, b, cotangents):
                for edge in ((i, j), (j, i)):
                    weights[edge] = weights.get(edge, 0) + cotangent / 2
        self.clamped = sum(w < 0 for w in weights.values()) // 2
        self.i, self.j = np.array(list(weights)).T
        self.w = np.maximum(list(weights.values()), 0)

    def count(self):
        return len(self.rest)

    def rotations(self, x):
        """The best for each cell, by singular values (Sorkine & Alexa 2007)."""
        moments = np.zeros((self.count(), 3, 3))
        before, after = self.rest[self.i] - self.rest[self.j], x[self.i] - x[self.j]
        np.add.at(moments, self.i, self.w[:, None, None] * after[:, :, None] * before[:, None, :])
        u, _, v = np.linalg.svd(moments)
        flip = np.ones((self.count(), 3))
        flip[:, 2] = np.linalg.det(u) * np.linalg.det(v)
        return (u * flip[:, None, :]) @ v

    def residuals(self, x, rotations):
        """sqrt(w_ij) ((x_i - x_j) - R_i (p_i - p_j)), a row an edge."""
        turned = np.einsum("eab,eb->ea", rotations[self.i], self.rest[self.i] - self.rest[self.j])
        return np.sqrt(self.w)[:, None] * (x[self.i] - x[self.j] - turned)

    def energies(self, x, rotations):
        return np.sqrt(np.bincount(self.i, np.sum(self.residuals(x, rotations) ** 2, axis=1), self.count()))


class ConeProgram:
    """min q.v over v with b - A v in a product of cones, as clarabel takes it."""

    def __init__(self):
        self.entries, self.bounds, self.cones = [], [], []

    def entry(self, row, column, value):
        self.entries.append((row, column, value))

    def solve(self, linear):
        rows, columns, values = zip(*self.entries)
        matrix = sparse.csc_matrix((values, (rows, columns)), shape=(len(self.bounds), len(linear)))
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_rel = settings.tol_gap_abs = settings.tol_feas = 1e-10
        return clarabel.DefaultSolver(sparse.csc_matrix((len(linear), len(linear))), linear, matrix,
                                      np.array(self.bounds), self.cones, settings).solve()


def optimum(cells, x, rotations, held, p):
    """The lowest sum of E_i^p with these rotations and the held vertices of x: clarabel's bounds from below and above."""
    n = cells.count()
    unit = np.mean(cells.energies(x, rotations) ** p) ** (1 / p)
    free = np.setdiff1d(np.arange(n), held)
    column = np.full(n, -1)
    column[free] = np.arange(len(free))
    moves = 3 * len(free)  # unknowns: moves of the free vertices from x, over `unit`; then E_i; then what bounds E_i^p
    is_power = p > 1

    program = ConeProgram()
    order = np.argsort(cells.i, kind="stable")
    start = np.searchsorted(cells.i[order], np.arange(n + 1))
    constant = cells.residuals(x, rotations) / unit
    for i in range(n):  # (E_i, z_i) in a second-order cone
        program.entry(len(program.bounds), moves + i, -1)
        program.bounds.append(0)
        for e in order[start[i]:start[i + 1]]:
            for axis in range(3):
                for vertex, sign in ((cells.i[e], 1), (cells.j[e], -1)):
                    if column[vertex] >= 0:
                        program.entry(len(program.bounds), 3 * column[vertex] + axis, -sign * np.sqrt(cells.w[e]))
                program.bounds.append(constant[e, axis])
        program.cones.append(clarabel.SecondOrderConeT(1 + 3 * int(start[i + 1] - start[i])))
    for i in range(n if is_power else 0):  # (t_i, 1, E_i) in a power cone: t_i^(1/p) >= E_i
        program.entry(len(program.bounds), moves + n + i, -1)
        program.entry(len(program.bounds) + 2, moves + i, -1)
        program.bounds += [0, 1, 0]
        program.cones.append(clarabel.PowerConeT(1 / p))

    linear = np.zeros(moves + n + (n if is_power else 0))
    linear[-n:] = 1
    solution = program.solve(linear)
    found = x.copy()
    found[free] += unit * np.reshape(solution.x[:moves], (-1, 3))
    return solution.obj_val_dual * unit ** p, np.sum(cells.energies(found, rotations) ** p)


def read_off(path):
    """Points and faces."""
    with open(path) as file:
        words = file.read().split()
    assert words[0] == "OFF", path
    n, m = int(words[1]), int(words[2])
    points = np.array(words[4:4 + 3 * n], dtype=float).reshape(n, 3)
    return points, np.array(words[4 + 3 * n:4 + 3 * n + 4 * m], dtype=int).reshape(m, 4)[:, 1:]


def uneven_sheet():
    """A hilly sheet with thin and obtuse triangles, some of whose cotangents are clamped: OFF, and handles that bend it."""
    across, along, chance = 7, 14, np.random.default_rng(7)
    u, v = np.meshgrid(np.arange(across), np.arange(along), indexing="ij")
    points = np.stack([u, v, np.sin(0.8 * u) * np.cos(0.5 * v)], axis=-1).astype(float)
    points[1:-1, 1:-1, :2] += chance.uniform(-0.42, 0.42, (across - 2, along - 2, 2))
    a = np.arange(across * along).reshape(across, along)
    corners = [c.ravel() for c in (a[:-1, :-1], a[1:, :-1], a[1:, 1:], a[:-1, 1:])]
    faces = np.concatenate([np.stack([corners[k] for k in turn], axis=1) for turn in ((0, 1, 2), (0, 2, 3))])
    lines = ["OFF", f"{across * along} {len(faces)} 0", *(" ".join(map(repr, map(float, p))) for p in points.reshape(-1, 3)),
             *("3 " + " ".join(map(str, face)) for face in faces)]
    end = {"name": "end", "vertices": a[:, -1].tolist(), "translate": [0, -4, 3],
           "rotate": {"axis": [1, 0, 0.3], "angle_degrees": 100, "center": [3, 13, 0]}}
    return "\n".join(lines) + "\n", {"handles": [{"name": "start", "vertices": a[:, 0].tolist()}, end]}


class ConvexStep(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.run_cli("shape", "bar", "--out", cls.at("bar.off"), "--handles", cls.at("bar.json"))
        mesh, handles = uneven_sheet()
        with open(cls.at("sheet.off"), "w") as off, open(cls.at("sheet.json"), "w") as file:
            off.write(mesh)
            json.dump(handles, file)
        cls.cells, cls.held = {}, {}
        for name in ("bar", "sheet"):
            cls.cells[name] = Cells(*read_off(cls.at(f"{name}.off")))
            with open(cls.at(f"{name}.json")) as file:
                cls.held[name] = sum((handle["vertices"] for handle in json.load(file)["handles"]), [])

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def at(cls, name):
        return os.path.join(cls.folder.name, name)

    @staticmethod
    def run_cli(*arguments):
        done = subprocess.run([CLI, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE)
        assert done.returncode == 0, done.stderr

    def deform(self, name, p, *options):
        """The result's positions, and its report."""
        self.run_cli("deform", self.at(f"{name}.off"), "--handles", self.at(f"{name}.json"), "--p", p, "--out",
                     self.at("out.off"), "--report", self.at("report.json"), *options)
        with open(self.at("report.json")) as file:
            return read_off(self.at("out.off"))[0], json.load(file)

    def checked(self, name, p, x, report):
        """The shares of the energy that the certificate leaves open, and that clarabel finds to be there."""
        cells, energy = self.cells[name], report["energy"]
        rotations = cells.rotations(x)
        self.assertAlmostEqual(np.sum(cells.energies(x, rotations) ** p) / energy, 1, delta=1e-9)
        below, above = optimum(cells, x, rotations, self.held[name], p)
        self.assertLess(above - below, EXACT * energy, "clarabel did not find the optimum")
        self.assertLessEqual(energy * (1 - report["optimality_gap"]), above + EXACT * energy)
        self.assertLessEqual(below, energy + EXACT * energy)
        return report["optimality_gap"], (energy - above) / energy

    def test_a_result_is_as_near_the_optimum_as_its_certificate_says(self):
        for name in ("bar", "sheet"):
            for p in NORMS:
                with self.subTest(mesh=name, p=p):
                    gap, _ = self.checked(name, p, *self.deform(name, p))
                    self.assertLess(gap, 1e-4)

    def test_far_from_the_optimum_the_certificate_says_so(self):
        for p in NORMS:
            with self.subTest(p=p):
                gap, there = self.checked("sheet", p, *self.deform("sheet", p, "--max-iterations", 3))
                self.assertGreater(there, 1e-3)
                self.assertLess(gap, there + 2e-4)  # and is not far off

    def test_it_bounds_what_conic_finds(self):
        for name in ("bar", "sheet"):
            with self.subTest(mesh=name):
                x, report = self.deform(name, 1)
                lowest = report["energy"] * (1 - report["optimality_gap"])
                cells, rotations = self.cells[name], self.cells[name].rotations(x)
                by_conic, conic = self.deform(name, 1, "--method", "conic", "--initial", self.at("out.off"))
                self.assertGreaterEqual(np.sum(cells.energies(by_conic, rotations)), lowest)
                self.checked(name, 1, by_conic, conic)

    def test_the_sheet_has_clamped_weights(self):
        self.assertGreater(self.cells["sheet"].clamped, 5)


if __name__ == "__main__":
    CLI = sys.argv[1]
    unittest.main(argv=sys.argv[:1] + sys.argv[2:], verbosity=2)
