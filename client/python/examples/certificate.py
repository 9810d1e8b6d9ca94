"""How far a result can be from the optimum for its rotations, how it got there, and which other minima were seen."""

import lpdeform
from shapes import box

vertices, faces = box(4, 4, 20)
turn = lpdeform.RigidMotion(axis=(1, 0, 0), angle=1.4, center=(2, 2, 10))
result = lpdeform.deform(
    vertices,
    faces,
    {"foot": vertices[:, 2] == 0, "head": (vertices[:, 2] == 20, turn)},
    p=1.5,
    solver=lpdeform.SolverSettings(search=lpdeform.MinimaSearch(effort=1)),
)
print(f"gap {result.optimality_gap:.2g} for its rotations; {result.searched}")
print(f"energy {result.trace[0].energy:.4g} at the beginning, {result.energy:.4g} after {result.iterations} iterations")
