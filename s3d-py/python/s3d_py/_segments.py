"""Cuts a mesh into segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from . import _native
from ._mesh import MeshLike, as_mesh
from ._progress import Progress, sink


@dataclass(frozen=True, eq=False, repr=False)
class Segments:
    """S segments of a mesh with F faces, and the tree of M merges that joins them two by two.

    Nodes of the tree are numbered. Node `i` is segment `i`; node `S + i` is merge `i`.
    """

    of_face: npt.NDArray[np.int32]
    """(F,), the segment of each face, from 0."""
    children: npt.NDArray[np.int32]
    """(M, 2), the two earlier nodes that each merge joins."""
    cost: npt.NDArray[np.float32]
    """(M,), how much the two differ: not below the cost of the nodes under it, and without a unit."""

    def __len__(self) -> int:
        return int(self.of_face.max()) + 1

    def at(self, cost: float) -> npt.NDArray[np.int32]:
        """Returns for each face (F,) the largest node around it whose cost is at most `cost`."""
        count = len(self)
        node = np.arange(count + len(self.cost), dtype=np.int32)
        # From the roots down: a node within the cost passes its own largest node on.
        for merge in np.flatnonzero(self.cost <= cost)[::-1]:
            node[self.children[merge]] = node[count + merge]
        return node[self.of_face]

    def __repr__(self) -> str:
        return f"Segments({len(self):,} segments of {len(self.of_face):,} faces)"


def segments(
    mesh: MeshLike,
    *,
    scale_m2: float = 0.002,
    smallest_m2: float = 0.003,
    color: float = 1.0,
    threads: int | None = None,
    progress: Progress = None,
) -> Segments:
    """Cuts a mesh into patches that belong together, by Felzenszwalb and Huttenlocher's method on the turn of
    the surface and its colours.

    - `scale_m2`: the larger, the larger the segments, in m².
    - `smallest_m2`: a smaller segment joins a neighbour, m².
    - `color`: how much colours count against shape; 0: not at all.

    The same mesh gives the same segments for any number of threads. Raises `UsageError` for other values.
    """
    native = as_mesh(mesh)._native
    of_face, children, cost = _native.segments(
        native, scale_m2, smallest_m2, color, threads, sink(progress)
    )
    return Segments(of_face.view(np.int32), children.view(np.int32), cost)
