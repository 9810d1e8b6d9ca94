"""Certificates of every kind of handle against an independent solver: handle_certificates_test.py CLI [unittest arguments].

Like convex_step_test.py, with the terms of handles in core/constraints/soft_terms.h: soft handles add s l^(p-2) |x - t|^2 at p <=
2, orientations add the same for their edges; points and locks are linear equations. clarabel finds the optimum for the rotations
of lpdeform's result. The certificate must be a bound of it, far from the optimum as well as near it.
"""

import json
import math
import os
import sys
import tempfile
import unittest

import clarabel
import numpy as np
import scipy.sparse as sparse

import convex_step_test
from convex_step_test import Cells, read_off

EXACT = 1e-7  # of the energy
SOLVED = 1e-8  # of the energy: how far clarabel's bounds of the optimum may lie apart
ANGLE, CENTRE, SHIFT = 40, np.array([2, 2, 10.0]), np.array([0.3, -0.2, 0.4])
AXIS = np.array([1, 2, 3]) / math.sqrt(14)
WEIGHTS = {"soft": 2, "soft_point": 30, "orientation": 100}


def turn():
    c, s = math.cos(math.radians(ANGLE)), math.sin(math.radians(ANGLE))
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def moved(point):
    return turn() @ (point - CENTRE) + CENTRE + SHIFT


class Program:
    """min x.P.x / 2 + q.x over b - A x in cones, x the moves of free vertices from where they are and then the E_i.

    Lengths are in units of the p-th root of the mean E_i^p, so that clarabel's numbers are near 1.
    """

    def __init__(self, free, extra):
        self.column = {v: 3 * k for k, v in enumerate(free)}
        self.size, self.moves = 3 * len(free) + extra, 3 * len(free)
        self.entries, self.bounds, self.cones = [], [], []
        self.squares, self.constants = [], []

    def row(self, terms, constant, sign=-1, more=()):
        """b - A x = constant + sum of (vertex, axis, factor), the other way round where sign is 1; more: (column, factor)."""
        for vertex, axis, factor in terms:
            if vertex in self.column:
                self.entries.append((len(self.bounds), self.column[vertex] + axis, sign * factor))
        self.entries += [(len(self.bounds), column, factor) for column, factor in more]
        self.bounds.append(constant)

    def square(self, terms, constant):
        """Adds (constant + sum of (vertex, axis, factor))^2 to what is minimised."""
        for vertex, axis, factor in terms:
            if vertex in self.column:
                self.squares.append((len(self.constants), self.column[vertex] + axis, factor))
        self.constants.append(constant)

    @staticmethod
    def matrix(entries, shape):
        rows, columns, values = zip(*entries) if entries else ((), (), ())
        return sparse.csc_matrix((values, (rows, columns)), shape=shape)

    def solve(self, linear):
        """The moves of the free vertices, and a lower bound of the optimum."""
        constants = np.array(self.constants)
        factor = self.matrix(self.squares, (len(constants), self.size))
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_rel = settings.tol_gap_abs = settings.tol_feas = 1e-10
        # Without more refinement, rounding keeps some processors from this feasibility.
        settings.iterative_refinement_reltol = settings.iterative_refinement_abstol = 1e-16
        settings.iterative_refinement_max_iter = 50
        solution = clarabel.DefaultSolver(sparse.triu(2 * factor.T @ factor).tocsc(), linear + 2 * factor.T @ constants,
                                          self.matrix(self.entries, (len(self.bounds), self.size)), np.array(self.bounds),
                                          self.cones, settings).solve()
        assert solution.r_dual < 1e-9, solution.r_dual  # else its objective is no bound
        return np.reshape(solution.x[:self.moves], (-1, 3)), solution.obj_val_dual + constants @ constants


class HandleCertificates(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.mesh = os.path.join(cls.folder.name, "bar.off")
        convex_step_test.ConvexStep.run_cli("shape", "bar", "--out", cls.mesh)
        cls.rest, cls.faces = read_off(cls.mesh)
        cls.cells = Cells(cls.rest, cls.faces)
        height = cls.rest[:, 2]
        cls.low, cls.top = (np.flatnonzero(height == end).tolist() for end in (height.min(), height.max()))
        cap = [face for face, corners in enumerate(cls.faces) if set(corners) <= set(cls.top)]
        cls.points = [{"face": face, "barycentric": [0.2, 0.3, 0.5]} for face in (cap[0], cap[-1])]
        edges = {tuple(sorted(edge)) for face in cls.faces.tolist() for edge in zip(face, face[1:] + face[:1])}
        cls.length_unit = np.mean([np.linalg.norm(cls.rest[a] - cls.rest[b]) for a, b in edges])

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def handle(self, kind):
        return {"soft": {"vertices": self.top, "soft": WEIGHTS["soft"]},
                "soft_point": {"points": self.points, "soft": WEIGHTS["soft_point"]},
                "point": {"points": self.points[:1]},
                "orientation": {"vertices": self.top, "orientation": WEIGHTS["orientation"]},
                "axis_lock": {"vertices": self.top, "axis_lock": AXIS.tolist()},
                "plane_lock": {"vertices": self.top, "plane_lock": AXIS.tolist()}}[kind]

    def deform(self, kind, p, options):
        motion = {"rotate": {"axis": [1, 0, 0], "angle_degrees": ANGLE, "center": CENTRE.tolist()}, "translate": SHIFT.tolist()}
        handles, out, report = (os.path.join(self.folder.name, name) for name in ("handles.json", "out.off", "report.json"))
        with open(handles, "w") as file:
            json.dump({"handles": [{"name": "base", "vertices": self.low}, {"name": "it", **motion, **self.handle(kind)}]}, file)
        convex_step_test.ConvexStep.run_cli("deform", self.mesh, "--handles", handles, "--p", p, "--out", out, "--report", report,
                                            *options)
        with open(report) as file:
            return read_off(out)[0], json.load(file)

    def wishes(self, kind):
        """What soft terms ask: (vertices with their shares, where that is to be, weight)."""
        if kind == "soft":
            return [([(v, 1.0)], moved(self.rest[v]), WEIGHTS[kind]) for v in self.top]
        if kind == "soft_point":
            return [(shares, moved(at), WEIGHTS[kind]) for shares, at in map(self.point_of, self.points)]
        if kind == "orientation":
            cells, is_top = self.cells, set(self.top)
            return [([(i, 1.0), (j, -1.0)], turn() @ (self.rest[i] - self.rest[j]), WEIGHTS[kind] * w)
                    for i, j, w in zip(cells.i, cells.j, cells.w) if i in is_top]
        return []

    def equations(self, kind):
        """(vertices with their shares, direction, how far along it that is)."""
        if kind == "point":
            shares, at = self.point_of(self.points[0])
            return [(shares, axis, axis @ moved(at)) for axis in np.eye(3)]
        across = np.cross(AXIS, [0, 0, 1])
        across /= np.linalg.norm(across)
        directions = {"axis_lock": [across, np.cross(AXIS, across)], "plane_lock": [AXIS]}.get(kind, [])
        return [([(v, 1.0)], d, d @ moved(self.rest[v])) for v in self.top for d in directions]

    def point_of(self, point):
        corners = self.faces[point["face"]]
        return list(zip(corners.tolist(), point["barycentric"])), np.array(point["barycentric"]) @ self.rest[corners]

    def energy(self, x, rotations, p, wishes):
        scale = self.length_unit ** (p - 2)
        soft = sum(w * np.sum((sum(share * x[v] for v, share in at) - to) ** 2) for at, to, w in wishes)
        return np.sum(self.cells.energies(x, rotations) ** p) + scale * soft

    def checked(self, kind, p, options=()):
        x, report = self.deform(kind, p, options)
        cells, rotations, wishes = self.cells, self.cells.rotations(x), self.wishes(kind)
        energy = self.energy(x, rotations, p, wishes)
        self.assertAlmostEqual(report["energy"] / energy, 1, delta=1e-9)

        n = cells.count()
        unit = np.mean(cells.energies(x, rotations) ** p) ** (1 / p)
        residuals = cells.residuals(x, rotations) / unit
        free = np.setdiff1d(np.arange(n), self.low).tolist()
        program = Program(free, n if p == 1 else 0)
        for at, direction, to in self.equations(kind):
            terms = [(v, axis, share * direction[axis]) for v, share in at for axis in range(3)]
            program.row(terms, (to - sum(share * direction @ x[v] for v, share in at)) / unit, sign=1)
            program.cones.append(clarabel.ZeroConeT(1))
        for at, to, weight in wishes:
            factor = math.sqrt(self.length_unit ** (p - 2) * unit ** (2 - p) * weight)
            off = (sum(share * x[v] for v, share in at) - to) / unit
            for axis in range(3):
                program.square([(v, axis, factor * share) for v, share in at], factor * off[axis])
        edges = [((cells.i[e], 1), (cells.j[e], -1)) for e in range(len(cells.i))]
        edge_terms = [[[(v, axis, sign * math.sqrt(cells.w[e])) for v, sign in ends] for axis in range(3)]
                      for e, ends in enumerate(edges)]
        linear = np.zeros(program.size)
        if p == 1:
            linear[program.moves:] = 1
            around = [np.flatnonzero(cells.i == i) for i in range(n)]
            for i in range(n):  # (E_i, its residuals) in a second-order cone
                program.row([], 0.0, more=[(program.moves + i, -1.0)])
                for e in around[i]:
                    for axis in range(3):
                        program.row(edge_terms[e][axis], residuals[e, axis])
                program.cones.append(clarabel.SecondOrderConeT(1 + 3 * len(around[i])))
        else:
            for e, terms in enumerate(edge_terms):
                for axis in range(3):
                    program.square(terms[axis], residuals[e, axis])
        if not program.bounds:  # clarabel wants a row
            program.row([(free[0], 0, 0.0)], 0.0)
            program.cones.append(clarabel.ZeroConeT(1))
        moves, below = program.solve(linear)
        below *= unit ** p
        found = x.copy()
        found[free] += unit * moves
        for at, direction, to in self.equations(kind):
            self.assertLess(abs(sum(share * direction @ found[v] for v, share in at) - to), SOLVED * self.length_unit)
        optimum = self.energy(found, rotations, p, wishes)
        self.assertLess(abs(optimum - below), SOLVED * energy, "clarabel did not find the optimum")
        self.assertLessEqual(optimum, energy * (1 + EXACT))
        self.assertLessEqual(energy * (1 - report["optimality_gap"]), optimum + EXACT * energy)
        return report["optimality_gap"], (energy - optimum) / energy

    def test_bounds_every_kind_of_handle(self):
        for kind in ("soft", "soft_point", "point", "orientation", "axis_lock", "plane_lock"):
            for p in (1, 2):
                with self.subTest(kind=kind, p=p):
                    gap, _ = self.checked(kind, p)
                    self.assertLess(gap, 1e-4)
                    gap, true = self.checked(kind, p, ("--max-iterations", 3))
                    self.assertGreater(true, 0.01)
                    self.assertLess(gap, 1.1 * true)


if __name__ == "__main__":
    convex_step_test.CLI = sys.argv.pop(1)
    unittest.main()
