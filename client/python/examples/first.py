"""One deformation in one call: a bar bends, its foot held and its head moved."""

import lpdeform
from shapes import box

vertices, faces = box(4, 4, 20)
turn = lpdeform.RigidMotion(axis=(0, 1, 0), angle=0.8, center=(2, 2, 20), translation=(6, 0, -2))
result = lpdeform.deform(
    vertices, faces, {"foot": vertices[:, 2] == 0, "head": (vertices[:, 2] == 20, turn)}, p=1.5
)
print(result)
