"""Points of a mesh: sampled from it, and voting for the labels of its faces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from types import SimpleNamespace
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import UsageError
from ._mesh import Mesh, MeshLike, as_mesh, colors_of, rows
from ._progress import Progress, sink


@dataclass(frozen=True, eq=False, repr=False)
class PointCloud:
    """N coloured points of a mesh's surface."""

    xyz: npt.NDArray[np.float32]
    """(N, 3), world metres."""
    rgb: npt.NDArray[np.uint8]
    """(N, 3), sRGB."""
    face: npt.NDArray[np.int32]
    """(N,), the face that each lies on."""

    def __len__(self) -> int:
        return len(self.xyz)

    def save(self, path: str | PathLike[str]) -> None:
        """Writes a binary PLY file of positions and colours, whole or not at all; one that is there is
        replaced.
        """
        save_points(path, self.xyz, self.rgb)

    def __repr__(self) -> str:
        return f"PointCloud({len(self):,} points)"


@dataclass(frozen=True, eq=False, repr=False)
class AnnotatedPoints:
    """N annotated points of an area, instance by instance."""

    xyz: npt.NDArray[np.float32]
    """(N, 3), world metres."""
    rgb: npt.NDArray[np.uint8]
    """(N, 3), sRGB; black where the files have no colours."""
    label: npt.NDArray[np.int32]
    """(N,), of each point the place in `names`."""
    names: list[str]
    """The instances, as `export` takes them: class, number among those of the room, room, its number:
    "chair_1_office_2".
    """

    def __len__(self) -> int:
        return len(self.xyz)

    def __repr__(self) -> str:
        return f"AnnotatedPoints({len(self):,} points of {len(self.names):,} instances)"


@dataclass(frozen=True, eq=False, repr=False)
class Votes:
    """How points voted for the label of each of F faces. A face without a vote has the label −1 and counts of
    0.
    """

    mesh: Mesh
    label: npt.NDArray[np.int32]
    """(F,), the label of most votes, the smallest of several; −1 where no point voted."""
    votes: npt.NDArray[np.uint32]
    """(F,), its votes."""
    runner_up: npt.NDArray[np.int32]
    """(F,), the label of the second most votes; −1 if there is none."""
    runner_up_votes: npt.NDArray[np.uint32]
    """(F,), its votes."""
    total: npt.NDArray[np.uint32]
    """(F,), all votes."""
    mean_distance: npt.NDArray[np.float32]
    """(F,), metres from the voters to the face, NaN without a vote."""
    max_distance: npt.NDArray[np.float32]
    """(F,), metres from the farthest voter to the face, NaN without a vote."""

    @property
    def margin(self) -> npt.NDArray[np.uint32]:
        """(F,), by how many votes the label won; 0 in a tie."""
        return self.votes - self.runner_up_votes

    @property
    def share(self) -> npt.NDArray[np.float64]:
        """(F,), the winner's share of all votes; NaN without a vote."""
        with np.errstate(invalid="ignore"):
            return np.true_divide(self.votes, self.total, dtype=np.float64)

    def filled(self, within: float) -> npt.NDArray[np.int32]:
        """(F,), the labels, where faces without a vote have that of the labelled surface next to them: see
        `fill`.
        """
        return fill(self.mesh, self.label, within)

    def __repr__(self) -> str:
        labelled = int((self.label >= 0).sum())
        labels = len(np.unique(self.label[self.label >= 0]))
        return f"Votes({labelled:,} of {len(self.label):,} faces labelled, {labels} labels)"


PointsLike = Union[npt.ArrayLike, PointCloud, AnnotatedPoints, Any]
"""Positions (N, 3), world metres; a `PointCloud` or `AnnotatedPoints`; points of laspy; a data frame of
pandas with columns x, y, z.
"""


def read_points(
    paths: str | PathLike[str] | Sequence[str | PathLike[str]],
    *,
    taxonomy: str = "s3dis",
    classes: Mapping[str, str | None] | None = None,
    class_column: str | None = None,
    instance_column: str | None = None,
    room_column: str | None = None,
    columns: Sequence[str] = (),
    room: str | None = None,
    offset: Sequence[float] = (0.0, 0.0, 0.0),
    lenient: bool = False,
    progress: Progress = None,
) -> AnnotatedPoints:
    """Reads the annotated points of an area: the folder of an S3DIS area, `pointcloud.mat`, a scan of
    ScanNet, PLY, NPY, NPZ, LAS, LAZ or E57; several files together.

    - `taxonomy`: "s3dis", "nyu40", "scannet20", "scannet200" or "matterport40".
    - `classes`: which class a name or number of the files means; None leaves its points out.
    - `class_column`, `instance_column`, `room_column`: where they are, if not where the format has them;
      `columns` names those of a plain NPY array.
    - `room`: that of points whose file names none: "office_1".
    - `offset`: metres, subtracted in 64 bits from points far from the origin, as `Mesh.offset` was.
    - `lenient`: skip and count what is not as it should be; unknown classes are clutter.

    Raises `FileError` with file and line, `UsageError` for a class or room that is none.
    """
    how = SimpleNamespace(
        taxonomy=taxonomy,
        classes=dict(classes or {}),
        class_column=class_column,
        instance_column=instance_column,
        room_column=room_column,
        columns=list(columns),
        room=room,
        offset=[float(metres) for metres in offset],
        lenient=lenient,
    )
    files = [paths] if isinstance(paths, (str, PathLike)) else list(paths)
    return AnnotatedPoints(*_native.read_points([fspath(path) for path in files], how, sink(progress)))


def save_points(path: str | PathLike[str], xyz: npt.ArrayLike, rgb: npt.ArrayLike) -> None:
    """Writes N points as a binary PLY file, whole or not at all; one that is there is replaced. `xyz` is
    (N, 3), metres; `rgb` (N, 3), sRGB, uint8, or floats from 0 to 1.
    """
    _native.write_points(fspath(path), rows("xyz", xyz, 3, np.float32), colors_of(rgb, "rgb"))


def sample(
    mesh: MeshLike,
    points_per_m2: float = 10_000.0,
    *,
    points: int | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress = None,
) -> PointCloud:
    """Points spread evenly over a mesh, in the order of its faces, with the mesh's colours there: so many a
    square metre, or `points` in all. The same mesh, density and seed give the same bits. They take 19 bytes
    each of memory.
    """
    native = as_mesh(mesh)._native
    if points is not None and points < 0:
        raise UsageError(f"points={points}: must be at least 0")
    xyz, rgb, face = _native.sample(native, points_per_m2, points, seed, threads, sink(progress))
    return PointCloud(xyz, rgb, face.view(np.int32))


def vote(
    mesh: MeshLike,
    xyz: PointsLike,
    labels: npt.ArrayLike | str,
    *,
    threads: int | None = None,
    progress: Progress = None,
) -> Votes:
    """Labels of faces from labelled points: each votes for the face that is nearest to it, however far.

    `xyz` are N points in the frame of the mesh (of a mesh far from its origin, less `Mesh.offset`); `labels`
    (N,) are numbers from 0 to 855,307, or the name of a column of `xyz`, such as "classification" of laspy's
    points.

    Raises `InputError` for a point that is not finite, `UsageError` for other labels or lengths.
    """
    table: Any = xyz
    column = np.asarray(table[labels] if isinstance(labels, str) else labels)
    if column.ndim != 1 or column.dtype.kind not in "iu":
        raise UsageError(f"labels: whole numbers of shape (N,), not {column.dtype} of shape {column.shape}")
    whole = as_mesh(mesh)
    positions = rows("xyz", _positions(xyz), 3, np.float32)
    columns = _native.vote(whole._native, positions, column.astype(np.int64), threads, sink(progress))
    return Votes(whole, *columns)


def fill(mesh: MeshLike, labels: npt.ArrayLike, within: float) -> npt.NDArray[np.int32]:
    """Labels (F,) of faces, where each of −1 has become that of the labelled surface next to it, if that is
    no farther than `within` metres along the surface and not around an edge of more than 45°.
    """
    return _native.fill(as_mesh(mesh)._native, np.ascontiguousarray(labels, np.int64), within)


def _positions(points: Any) -> npt.ArrayLike:
    if hasattr(points, "xyz"):
        return np.asarray(points.xyz)
    if hasattr(points, "columns") and {"x", "y", "z"} <= set(points.columns):
        points = points[["x", "y", "z"]]
    return np.asarray(points)
