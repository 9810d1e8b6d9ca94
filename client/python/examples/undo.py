"""Steps are taken back and done again."""

import lpdeform
from shapes import grid

vertices, faces = grid(20, 4)
with lpdeform.open(vertices, faces) as session:
    session.set_handle("left", vertices[:, 0] == 0)
    session.set_handle("right", vertices[:, 0] == 20)
    session.move("right", translation=[0, 0, 6])
    session.undo()
    print("undone:", session.settle().positions[:, 2].max().round(3))
    session.redo()
    print("again:", session.settle().positions[:, 2].max().round(3))
