"""A session follows changes: each call of move() waits for the finished result."""

import lpdeform
from shapes import box

vertices, faces = box(3, 3, 24)
with lpdeform.open(vertices, faces, p=2) as session:
    session.set_handle("foot", lambda v: v[:, 2] < 0.5)
    session.set_handle("head", lambda v: v[:, 2] > 23.5)
    for height in (0, -4, -8):
        frame = session.move("head", translation=[6, 0, height])
        print(f"height {24 + height}: energy {frame.energy:.4g}")
