"""Only a region moves; the rest of the mesh stays where it is."""

import numpy as np

import lpdeform
from shapes import box

vertices, faces = box(3, 3, 30)
region = vertices[:, 2] > 15
up = lpdeform.RigidMotion(translation=(5, 0, -2))
result = lpdeform.deform(vertices, faces, {"head": (vertices[:, 2] == 30, up)}, region=region, p=1.5)
print("outside the region the largest movement is", np.abs(result.positions - vertices)[~region].max())
