"""A drag: no call waits. The newest position wins, and so does the newest frame."""

import numpy as np

import lpdeform
from shapes import grid

vertices, faces = grid(40, 10)
with lpdeform.open(vertices, faces) as session:
    session.set_handle("left", vertices[:, 0] == 0)
    session.set_handle("right", vertices[:, 0] == 40)
    shown = 0
    for height in np.linspace(0, 15, 60):
        session.drag("right", translation=[-5, 0, height])
        if session.poll() is not None:
            shown += 1
    print(f"{shown} frames on the way; at the end {session.settle()}")
