"""Shapes that the examples deform: n x 3 vertices in units of a cell, and m x 3 triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Vertices = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int64]


def grid(columns: int, rows: int) -> tuple[Vertices, Faces]:
    """A flat rectangle in the plane z = 0."""
    x, y = np.meshgrid(np.arange(columns + 1.0), np.arange(rows + 1.0))
    vertices = np.asarray(np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3), np.float64)
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1)
    right, up = corner + 1, corner + columns + 1
    return vertices, np.concatenate([np.stack([corner, right, up], 1), np.stack([right, up + 1, up], 1)])


def box(nx: int, ny: int, nz: int) -> tuple[Vertices, Faces]:
    """The closed surface of a box of nx x ny x nz cells."""
    sizes = (nx, ny, nz)
    squares: list[npt.NDArray[np.int_]] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        i, j = (one.reshape(-1) for one in np.meshgrid(np.arange(sizes[u]), np.arange(sizes[v])))
        for end in (0, sizes[axis]):
            corners = np.zeros((len(i), 4, 3), int)
            corners[:, :, axis] = end
            for k, (di, dj) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
                corners[:, k, u], corners[:, k, v] = i + di, j + dj
            squares.append(corners if end else corners[:, ::-1])
    corners = np.concatenate(squares)
    vertices, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    index = index.reshape(-1, 4)
    return vertices.astype(float), np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]])
