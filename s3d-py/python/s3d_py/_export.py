"""Scenes to data sets."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, TypedDict, Union

import numpy as np
import numpy.typing as npt

from . import _native
from ._camera import Location, PoseLike, pose_of
from ._errors import UsageError
from ._mesh import Mesh, MeshLike, as_mesh
from ._progress import Progress, sink

if TYPE_CHECKING:
    from typing_extensions import Unpack

Labels = Union[Sequence[str], npt.NDArray[np.str_], tuple[Sequence[str], npt.ArrayLike]]
"""Labels of the F faces of a mesh: their names, one a face, "" for none; or a tuple of the different names
and of the place of each face's among them, (F,), −1 for none. A name is CLASS_INSTANCE_ROOM_NUMBER:
"chair_1_office_2".
"""


@dataclass(frozen=True, eq=False)
class Area:
    """One area of a data set, whose mesh is at hand."""

    mesh: MeshLike
    area: int = 1
    """Its number, from 1."""
    locations: Sequence[PoseLike] = ()
    """Where panoramas and views are made. If there are none, some are placed: the options `see` and
    `place_cameras`.
    """
    labels: Labels | None = None
    """What its faces are; None makes a data set without labels."""
    taxonomy: str = "s3dis"
    """Whose classes these are: "s3dis", "nyu40", "scannet20", "scannet200" or "matterport40"."""


class ExportOptions(TypedDict, total=False):
    """Options of `export`; what is left out has the default of `s3d export --help`, which is the paper's
    where it names one.
    """

    seed: int
    """Everything random comes from it: the same input and seed give the same bytes."""
    place_cameras: float
    """Put scan locations on the floor of every room, no two nearer than this, metres, instead of reading
    some.
    """
    see: float
    """Put as few scan locations as see this share of the visible surface, instead of reading some."""
    views: int
    """Candidate views a scan location; 72."""
    size: int
    """Width and height of a view, pixels; 1080."""
    pano_width: int
    """Width of a panorama, pixels, even; 4096."""
    pool: str
    """Among which candidates views are selected: "dataset", "area" or "location"."""
    points_per_m2: float
    """Density of the point cloud; 10,000."""
    lenient: bool
    """Skip and count what is not as it should be in the annotations."""
    fill: float
    """Give faces without a vote the label of the surface next to them, if it is no farther than this,
    metres.
    """
    entropy_stride: int
    """The classes of a candidate view are counted on every which pixel of both axes; 4."""
    modalities: list[str]
    """Which images: rgb, depth, normal, semantic, semantic_pretty, semantic_class, global_xyz, pose."""
    keep_all: bool
    """Write every candidate view."""
    only: list[str]
    """Write the images of these scan locations only, by uuid."""
    normals: str
    """ "flat" or "smooth"."""
    rgb_samples: int
    """How many places of a pixel tell its colour where surfaces end or turn; 1."""
    compression: str
    """ "fast", "balanced" or "small"; the pixels are the same."""
    xyz: str
    """World coordinates as "half" floats, as "float", or "none"."""
    normal_axes: str
    """Axes of normals in views: "paper" or "opencv"."""
    depth_units: str
    """ "512" a metre, or "mm"."""
    pad_labels: str
    """How many entries the table of labels is filled up to, or "off"."""
    profiles: list[str]
    """What is written for loaders besides: pointcept, open3d-ml, mmdet3d, pointnet."""


SceneLike = Union[str, PathLike[str], Area, MeshLike]
"""What is exported: the path of a scene file (scene.toml), of a published area's folder, or of a mesh; an
`Area`; a mesh.
"""


def export(
    scene: SceneLike | Sequence[SceneLike],
    output: str | PathLike[str],
    *,
    locations: Sequence[PoseLike] = (),
    labels: Labels | None = None,
    allow: Sequence[str] = (),
    overwrite: bool = False,
    threads: int | None = None,
    progress: Progress = None,
    **options: Unpack[ExportOptions],
) -> dict[str, Any] | None:
    """Makes a data set in the folder `output`; docs/formats.md says what is in it.

    - `scene`: scene files, areas in memory, or a mesh; several make a data set of several areas, and several
      files of meshes one area. `locations` and `labels` belong to a single mesh in memory: they are those of
      an `Area`.
    - `allow`: conditions of usefulness that need not be met; an error that stops an export names its
      condition.
    - `overwrite`: replace an earlier data set, or an unfinished one of another call. Other files stay.
    - `options`: see `ExportOptions`.

    An export that was stopped, by Ctrl-C, a full disk or a kill, goes on where it was when the same call is
    made again, and ends with the same bytes. Returns a summary: areas, locations, images by kind, seconds by
    stage; None if all was there already.

    Raises `UsageError` for options out of range or a folder that holds something else, `InputError`,
    `FileError`, `TemporaryError`, `CancelledError`.
    """
    scenes = list(scene) if isinstance(scene, (list, tuple)) else [scene]
    paths = [fspath(one) for one in scenes if isinstance(one, (str, PathLike))]
    given: list[str] | list[_Area]
    if paths and labels is None and not len(locations):
        if len(paths) < len(scenes):
            raise UsageError("scene: either all paths, or none: read meshes by read_mesh")
        given = paths
    else:
        areas = [
            one if isinstance(one, Area) else Area(one, locations=locations, labels=labels) for one in scenes
        ]
        if (labels is not None or len(locations)) and (len(scenes) != 1 or isinstance(scenes[0], Area)):
            raise UsageError(
                "locations, labels: of a single mesh; give several as Area(mesh, area, locations, labels)"
            )
        given = [_Area(area) for area in areas]
    summary = _native.export(
        given, fspath(output), json.dumps(options), list(allow), overwrite, threads, sink(progress)
    )
    return None if summary is None else json.loads(summary)


class _Area:
    """An `Area` as the compiled part takes it."""

    def __init__(self, area: Area) -> None:
        self.area = area.area
        mesh: Mesh = as_mesh(area.mesh)
        self.mesh = mesh._native
        self.labels = None if area.labels is None else (*_places(area.labels), area.taxonomy)
        self.locations = [_location(pose) for pose in area.locations]


def _places(labels: Labels) -> tuple[list[str], npt.NDArray[np.int32]]:
    """The different names, and which of them each face has."""
    if isinstance(labels, tuple) and len(labels) == 2 and not isinstance(labels[1], str):
        return [str(name) for name in labels[0]], np.asarray(labels[1]).astype(np.int32)
    names, places = np.unique(np.asarray(labels, np.str_), return_inverse=True)
    none = int(names.size > 0 and names[0] == "")
    return names[none:].tolist(), (places - none).astype(np.int32)


def _location(pose: PoseLike) -> tuple[str, list[list[float]]]:
    matrix = pose_of(pose).tolist()
    return (pose.uuid if isinstance(pose, Location) else _native.uuid_of_name(f"s3d_py {matrix}")), matrix
