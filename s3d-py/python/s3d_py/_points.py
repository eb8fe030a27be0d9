"""Samples points from a mesh, and lets points vote for the labels of its faces."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from . import _native
from ._checks import MOST_SEED, colors_of, number, rows, whole
from ._errors import Error, UsageError
from ._files import replaced
from ._mesh import Mesh, MeshLike, as_mesh
from ._names import NameInRoom
from ._progress import Progress, sink


# The class, its number in the room, and the room: its type and number.
_NAME = re.compile(r"(.+?)_(\d{1,9})_(.+_\d+)")


@dataclass(frozen=True, eq=False, repr=False)
class PointCloud:
    """N coloured points on the surface of a mesh."""

    xyz: npt.NDArray[np.float32]
    """(N, 3), world metres."""
    rgb: npt.NDArray[np.uint8]
    """(N, 3), sRGB."""
    face: npt.NDArray[np.int32]
    """(N,), index of the face under each point."""

    def __len__(self) -> int:
        return len(self.xyz)

    def save(self, path: str | PathLike[str]) -> None:
        """Writes positions and colours: see `save_points`."""
        save_points(path, self.xyz, self.rgb)

    def __repr__(self) -> str:
        return f"PointCloud({len(self):,} points)"


@dataclass(frozen=True, eq=False, repr=False)
class LabelledPoints(PointCloud):
    """The sampled points of an area of a data set."""

    label: npt.NDArray[np.int32]
    """(N,), index into `DataSet.labels`; 0 without a label."""

    def save(self, path: str | PathLike[str]) -> None:
        """Writes positions, colours and labels: see `save_points`."""
        save_points(path, self.xyz, self.rgb, self.label)


@dataclass(frozen=True, eq=False, repr=False)
class AnnotatedPoints:
    """N annotated points of an area, instance by instance."""

    xyz: npt.NDArray[np.float32]
    """(N, 3), world metres."""
    rgb: npt.NDArray[np.uint8]
    """(N, 3), sRGB; black where the files have no colours."""
    label: npt.NDArray[np.int32]
    """(N,), index into `names` for each point."""
    names: list[NameInRoom]
    """The instances, in the form that `export` takes: class, number of the instance in the room, type and
    number of the room: "chair_1_office_2".
    """

    def __len__(self) -> int:
        return len(self.xyz)

    def save(self, path: str | PathLike[str]) -> None:
        """Writes positions, colours and names as `.npz`, which `read_points(path, room_column="room")` reads
        again: see `save_points`.
        """
        save_points(path, self.xyz, self.rgb, self.label, names=self.names)

    def __repr__(self) -> str:
        return f"AnnotatedPoints({len(self):,} points of {len(self.names):,} instances)"


@dataclass(frozen=True, eq=False, repr=False)
class Votes:
    """The votes of points for the label of each of F faces. A face without votes has the label −1 and counts
    of 0.
    """

    mesh: Mesh
    label: npt.NDArray[np.int32]
    """(F,), the label with the most votes, the smallest label in a tie; −1 without votes."""
    votes: npt.NDArray[np.uint32]
    """(F,), number of votes for `label`."""
    runner_up: npt.NDArray[np.int32]
    """(F,), the label with the second most votes; −1 if there is none."""
    runner_up_votes: npt.NDArray[np.uint32]
    """(F,), number of votes for `runner_up`."""
    total: npt.NDArray[np.uint32]
    """(F,), number of all votes."""
    mean_distance: npt.NDArray[np.float32]
    """(F,), mean distance of the voters from the face in metres; NaN without votes."""
    max_distance: npt.NDArray[np.float32]
    """(F,), distance of the farthest voter from the face in metres; NaN without votes."""

    @property
    def margin(self) -> npt.NDArray[np.uint32]:
        """(F,), `votes` minus `runner_up_votes`; 0 in a tie."""
        return self.votes - self.runner_up_votes

    @property
    def share(self) -> npt.NDArray[np.float64]:
        """(F,), the share of the votes that were for `label`; NaN without votes."""
        with np.errstate(invalid="ignore"):
            return np.true_divide(self.votes, self.total, dtype=np.float64)

    def filled(self, within: float) -> npt.NDArray[np.int32]:
        """Returns the labels, (F,). Faces without votes get the label of the surface next to them: see
        `fill`.
        """
        return fill(self.mesh, self.label, within)

    def __repr__(self) -> str:
        labelled = int((self.label >= 0).sum())
        labels = len(np.unique(self.label[self.label >= 0]))
        return f"Votes({labelled:,} of {len(self.label):,} faces labelled, {labels} labels)"


PointsLike = Union[npt.ArrayLike, PointCloud, AnnotatedPoints, Any]
"""Positions (N, 3) in world metres; a `PointCloud` or `AnnotatedPoints`; points of laspy; or a pandas data
frame with columns x, y, z.
"""


# Messages name the keys of a scene file.
_KEYS = (
    "Here keys of [annotations] are arguments: `classes` and `room`, and for columns `class_column`, "
    "`instance_column`, `room_column` and `columns`"
)


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
    ScanNet, PLY, NPY, NPZ, LAS, LAZ, E57, PCD, text, SemanticKITTI's `.label` or a folder of Pointcept's
    arrays. Several files make one area.

    - `taxonomy`: "s3dis", "nyu40", "scannet20", "scannet200" or "matterport40".
    - `classes`: the class for each name or number in the files; None leaves its points out.
    - `class_column`, `instance_column`, `room_column`: names of columns that differ from the format's.
    - `columns`: the names of the columns of a file that does not name them: a plain NPY array, a text.
    - `room`: the room of points whose file names none: "office_1".
    - `offset`: metres, subtracted in 64 bits from points far from the origin, like `Mesh.offset`.
    - `lenient`: skip faulty annotations and count them; unknown classes become clutter.

    Raises `FileError` with file and line, and `UsageError` for an invalid class or room.
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
    try:
        xyz, rgb, label, names = _native.read_points([fspath(path) for path in files], how, sink(progress))
    except Error as error:
        if "[annotations" in str(error):
            error.args = (f"{error}. {_KEYS}", *error.args[1:])
        raise
    return AnnotatedPoints(xyz, rgb, label, [NameInRoom(name) for name in names])


def save_points(
    path: str | PathLike[str],
    xyz: npt.ArrayLike,
    rgb: npt.ArrayLike | None = None,
    labels: npt.ArrayLike | None = None,
    *,
    names: Sequence[str] | None = None,
) -> None:
    """Writes N points, completely or not at all. An existing file is replaced. The ending of the path tells the
    form: `.ply` (binary), `.las` (1.4, steps of 0.1 mm, labels as the extra dimension `label`), or `.npz`
    (`xyz`, `rgb`, `label`).

    - `xyz`: (N, 3), metres.
    - `rgb`: (N, 3), sRGB, whole numbers from 0 to 255 or floats from 0 to 1; black if None.
    - `labels`: (N,), whole numbers of 32 bits.
    - `names`: the instance that each label is the index of, such as "chair_1_office_2". They are written as the
      columns `class`, `instance` and `room` in place of `label`, only as `.npz`. `read_points(path,
      room_column="room")` reads them.
    """
    ending = Path(path).suffix.lower()
    if ending not in (".ply", ".las", ".npz"):
        raise UsageError(f"{fspath(path)}: points are written as .ply, .las or .npz")
    positions = rows("xyz", xyz, 3, np.float32)
    colors = None if rgb is None else colors_of(rgb, "rgb")
    column = None if labels is None else whole("labels", labels, np.int32)
    for what, of_points in (("colours", colors), ("labels", column)):
        if of_points is not None and len(of_points) != len(positions):
            raise UsageError(f"{len(of_points)} {what} for {len(positions)} points: one for each")
    if column is not None and column.ndim != 1:
        raise UsageError(f"labels: an array (N,), not of shape {column.shape}")
    if names is not None:
        if ending != ".npz" or column is None:
            raise UsageError("names are written with labels, and only as .npz")
        _save_named(path, positions, colors, column, names)
        return
    if ending != ".npz":
        _native.write_points(fspath(path), positions, colors, column, ending == ".las")
        return
    _save_arrays(path, {"xyz": positions, "rgb": colors, "label": column})


def _save_named(
    path: str | PathLike[str],
    xyz: npt.NDArray[np.float32],
    rgb: npt.NDArray[np.uint8] | None,
    labels: npt.NDArray[np.int32],
    names: Sequence[str],
) -> None:
    """Writes points with the class, the number and the room of their instances."""
    parts = [_NAME.fullmatch(name) for name in names]
    odd = next((name for name, part in zip(names, parts) if part is None), None)
    if odd is not None:
        raise UsageError(f'names: {odd!r} is not of the form "chair_1_office_2"')
    if len(labels) and not (0 <= labels.min() and labels.max() < len(names)):
        found = f"from {labels.min()} to {labels.max()}"
        raise UsageError(f"labels {found} for {len(names)} names: indices into the names")
    words = [part.groups() for part in parts if part]
    columns = {
        "class": np.array([word[0] for word in words], dtype=np.str_),
        "instance": np.array([int(word[1]) for word in words], dtype=np.int32),
        "room": np.array([word[2] for word in words], dtype=np.str_),
    }
    of_points = {name: column[labels] for name, column in columns.items()}
    _save_arrays(path, {"xyz": xyz, "rgb": rgb, **of_points})


def _save_arrays(path: str | PathLike[str], arrays: Mapping[str, npt.NDArray[Any] | None]) -> None:
    """Writes arrays as NPZ, completely or not at all."""
    given: dict[str, Any] = {name: array for name, array in arrays.items() if array is not None}
    with replaced(Path(path)) as file:
        np.savez(file, **given)


def sample(
    mesh: MeshLike,
    points_per_m2: float = 10_000.0,
    *,
    points: int | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress = None,
) -> PointCloud:
    """Samples points evenly over a mesh, in the order of its faces, with the mesh's colours. Their number
    follows from the density `points_per_m2`, or is `points`. The same mesh, density and seed give the same
    bits. Each point takes 19 bytes of memory: `TooLargeError` (a `MemoryError`) if that is more than is free.
    """
    native = as_mesh(mesh)._native
    if points is not None:
        points = number("points", points, 0)
    seed = number("seed", seed, 0, MOST_SEED)
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
    """Labels faces from labelled points. Each point votes for the face nearest to it, at any distance.

    - `xyz`: N points in the frame of the mesh. For a mesh far from its origin, subtract `Mesh.offset`.
    - `labels`: (N,), numbers from 0 to 855,307; or the name of a column of `xyz`, such as "classification"
      for laspy's points.

    Raises `InputError` for a point that is not finite, and `UsageError` for other labels or lengths.
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
    """Returns the labels (F,) of faces. A face with −1 gets the label of the labelled surface next to it,
    within `within` metres along the surface and not around an edge of more than 45°.
    """
    return _native.fill(as_mesh(mesh)._native, whole("labels", labels, np.int64), within)


def _positions(points: Any) -> npt.ArrayLike:
    if hasattr(points, "xyz"):
        return np.asarray(points.xyz)
    if hasattr(points, "columns") and {"x", "y", "z"} <= set(points.columns):
        points = points[["x", "y", "z"]]
    return np.asarray(points)
