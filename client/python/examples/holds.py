"""Kinds of handles: exact, soft, locked to a line or a plane, and turned without being held."""

import numpy as np

import lpdeform
from shapes import grid

vertices, faces = grid(20, 10)
middle = np.flatnonzero((vertices[:, 0] == 10) & (vertices[:, 1] == 5))
up = lpdeform.RigidMotion(translation=(0, 0, 4))
turn = lpdeform.RigidMotion(axis=(0, 1, 0), angle=-0.5)
with lpdeform.open(vertices, faces) as session:
    session.set_handle("rim", (vertices[:, 0] == 0) | (vertices[:, 0] == 20))
    for hold in (lpdeform.Exact(), lpdeform.Soft(0.5), lpdeform.AxisLock((1, 0, 0)), lpdeform.PlaneLock((0, 0, 1))):
        session.set_handle("middle", middle, up, hold=hold)
        print(type(hold).__name__, session.settle().positions[middle[0]].round(2).tolist())
    session.set_handle("middle", middle, turn, hold=lpdeform.Orientation())
    print("Orientation", session.settle().positions[middle[0]].round(2).tolist())
