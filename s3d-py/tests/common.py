"""Shared by the tests."""

from __future__ import annotations

import numpy as np

import s3d_py as s3d


def box(size: tuple[float, float, float] = (4.0, 3.0, 2.5)) -> s3d.Mesh:
    """A closed room whose faces have their fronts inside, with a table top of 1 m² in a corner, 0.7 m
    high.
    """
    w, d, h = size
    quads = [
        [(0, 0, 0), (w, 0, 0), (w, d, 0), (0, d, 0)],
        [(0, 0, h), (0, d, h), (w, d, h), (w, 0, h)],
        [(0, 0, 0), (0, 0, h), (w, 0, h), (w, 0, 0)],
        [(0, d, 0), (w, d, 0), (w, d, h), (0, d, h)],
        [(0, 0, 0), (0, d, 0), (0, d, h), (0, 0, h)],
        [(w, 0, 0), (w, 0, h), (w, d, h), (w, d, 0)],
        [(0, 0, 0.7), (1, 0, 0.7), (1, 1, 0.7), (0, 1, 0.7)],
    ]
    vertices = np.array(quads, np.float32).reshape(-1, 3)
    faces = [
        [4 * q + a, 4 * q + b, 4 * q + c] for q in range(len(quads)) for a, b, c in ((0, 1, 2), (0, 2, 3))
    ]
    colors = np.repeat(np.arange(len(quads), dtype=np.uint8) * 30 + 20, 4)[:, None].repeat(3, 1)
    return s3d.Mesh(vertices, faces, vertex_colors=colors)


K = s3d.intrinsics((64, 48), fov=90)
# In the middle of the box, looking along +X at the wall 2 m away.
AHEAD = s3d.look_at((2.0, 1.5, 1.2), (4.0, 1.5, 1.2))
