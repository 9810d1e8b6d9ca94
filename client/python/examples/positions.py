"""Handles as other libraries have them: indices b, and their positions bc."""

import numpy as np

import lpdeform
from shapes import grid

vertices, faces = grid(30, 6)
b = np.flatnonzero((vertices[:, 0] == 0) | (vertices[:, 0] == 30))
bc = vertices[b].copy()
bc[bc[:, 0] == 30] += [-10, 0, 8]
result = lpdeform.deform(vertices, faces, {"held": (b, bc)}, p=2)
print(f"energy {result.energy:.4g}, largest distortion {result.distortion.max():.3g}")
