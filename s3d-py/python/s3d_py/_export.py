"""Makes data sets from scenes."""

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
from ._checks import whole
from ._errors import UsageError
from ._mesh import Mesh, MeshLike, as_mesh, read_mesh
from ._progress import Progress, sink

if TYPE_CHECKING:
    from typing_extensions import Unpack

Labels = Union[Sequence[str], npt.NDArray[np.str_], tuple[Sequence[str], npt.ArrayLike]]
"""The labels of the F faces of a mesh. Either one name for each face, "" for none; or a tuple of the
different names and, (F,), the index of each face's name among them, −1 for none. A name is
CLASS_INSTANCE_ROOM_NUMBER: "chair_1_office_2".
"""


@dataclass(frozen=True, eq=False)
class Area:
    """One area of a data set, with a mesh in memory."""

    mesh: MeshLike
    area: int = 1
    """The number of the area, from 1."""
    locations: Sequence[PoseLike] = ()
    """The poses at which panoramas and views are made. If there are none, the options `see` and
    `place_cameras` say how locations are placed.
    """
    labels: Labels | None = None
    """The labels of the faces; None makes a data set without labels."""
    taxonomy: str = "s3dis"
    """The taxonomy of the labels: "s3dis", "nyu40", "scannet20", "scannet200" or "matterport40"."""


class ExportOptions(TypedDict, total=False):
    """The options of `export`. A missing option has the default of `s3d export --help`, which is the paper's
    value where the paper names one.
    """

    seed: int
    """Determines everything random: the same input and seed give the same bytes."""
    place_cameras: float
    """Places scan locations on the floor of every room, at least this far apart in metres, instead of reading
    them.
    """
    see: float
    """Places as few scan locations as see this share of the visible surface, instead of reading them."""
    views: int
    """The number of candidate views at each scan location; default 72."""
    size: int
    """Width and height of a view in pixels; default 1080."""
    pano_width: int
    """Width of a panorama in pixels, even; default 4096."""
    pool: str
    """The pool of candidates from which views are selected: "dataset", "area" or "location"."""
    points_per_m2: float
    """Density of the point cloud in points per m²; default 10,000."""
    lenient: bool
    """Skips faulty annotations, and counts them."""
    fill: float
    """Gives faces without a vote the label of the surface next to them, up to this distance in metres."""
    trim_strays: float
    """Leaves out annotated points that are farther than this from every face of the mesh, in metres."""
    entropy_stride: int
    """The score of a candidate view counts the classes of every n-th pixel along both axes; default 4."""
    modalities: list[str]
    """What to write of an image:
    rgb, depth, normal, semantic, semantic_pretty, semantic_class, global_xyz, pose, objects,
    depth_euclidean, reshading, principal_curvature, edge_occlusion, edge_texture, keypoints2d,
    keypoints3d, segment_unsup2d, segment_unsup25d, mask_valid, edge_instance, boundary_distance,
    semantic_refined, semantic_moved.
    """
    keep_all: bool
    """Writes every candidate view."""
    only: list[str]
    """Writes only the images of these scan locations, by uuid."""
    normals: str
    """ "flat" or "smooth"."""
    rgb_samples: int
    """The number of samples for the colour of a pixel where surfaces end or bend; default 1."""
    semantic_glb: bool
    """Writes the mesh of each area with its textures and labels as 3d/semantic.glb."""
    compression: str
    """ "fast", "balanced" or "small"; the pixels are the same."""
    xyz: str
    """Images of world coordinates as "half" or "float" numbers, or "none"."""
    normal_axes: str
    """The axes of normals in views: "paper" or "opencv"."""
    depth_units: str
    """The unit of depth: "512" steps a metre, or "mm"."""
    pad_labels: str
    """The number of entries to which the table of labels is padded, or "off"."""
    profiles: list[str]
    """Loaders for which profiles are written as well: pointcept, open3d-ml, mmdet3d, pointnet."""


SceneLike = Union[str, PathLike[str], Area, MeshLike]
"""The input of `export`: the path of a scene file (scene.toml), of a published area's folder, or of a mesh;
an `Area`; or a mesh.
"""


def export(
    scene: SceneLike | Sequence[SceneLike],
    output: str | PathLike[str],
    *,
    locations: Sequence[PoseLike] = (),
    labels: Labels | None = None,
    up: str | None = None,
    units: str | None = None,
    to: str | None = None,
    allow: str | Sequence[str] = (),
    overwrite: bool = False,
    threads: int | None = None,
    progress: Progress = None,
    **options: Unpack[ExportOptions],
) -> dict[str, Any] | None:
    """Makes a data set in the folder `output`. The page "Files and formats" of the documentation describes
    its files.

    - `scene`: scene files, areas in memory, or a mesh. Several scenes make a data set of several areas;
      several files of meshes make one area.
    - `locations`, `labels`: for a single mesh in memory, as in `Area`.
    - `up`, `units`: of the files of meshes, as in `read_mesh`.
    - `to`: write a package of this kind instead of a data set, without a file for each image on the way:
      `"webdataset"`, `"huggingface"`, `"dust3r"`, `"wai"` or `"vggt"`. `DataSet.pack` makes the same.
    - `allow`: conditions of usefulness that need not be met. An error that stops an export names its
      condition.
    - `overwrite`: replace an earlier data set, or the unfinished one of another call. Other files stay.
    - `options`: see `ExportOptions`.

    If an export is stopped by Ctrl-C, a full disk or a kill, the same call resumes it and ends with the same
    bytes. Returns a summary (areas, locations, images by kind, seconds by stage), or None if the data set was
    complete already.

    Raises `UsageError` for options out of range or a folder with other content, and `InputError`,
    `FileError`, `TemporaryError` or `CancelledError`.
    """
    scenes = list(scene) if isinstance(scene, (list, tuple)) else [scene]
    paths = [fspath(one) for one in scenes if isinstance(one, (str, PathLike))]
    if not scenes:
        raise UsageError("scene: there is none: name one")
    meshes_in_memory = [one for one in scenes if not isinstance(one, (str, PathLike))]
    if meshes_in_memory and (up is not None or units is not None):
        raise UsageError("up, units: of the files of meshes; give what is in memory Z up, in metres")
    given: list[str] | list[_Area]
    if paths and labels is None and not len(locations):
        if len(paths) < len(scenes):
            raise UsageError("scene: either all paths, or none: read meshes by read_mesh")
        given = paths
    else:
        if isinstance(scenes[0], (str, PathLike)):
            scenes[0] = read_mesh(scenes[0], up=up, units=units)
        areas = [
            one if isinstance(one, Area) else Area(one, locations=locations, labels=labels) for one in scenes
        ]
        if (labels is not None or len(locations)) and (len(scenes) != 1 or isinstance(scenes[0], Area)):
            raise UsageError(
                "locations, labels: of a single mesh; give several as Area(mesh, area, locations, labels)"
            )
        given = [_Area(area) for area in areas]
    allowed = [allow] if isinstance(allow, str) else list(allow)
    summary = _native.export(
        given, fspath(output), json.dumps(options), allowed, (up, units), to, overwrite, threads, sink(progress)
    )
    return None if summary is None else json.loads(summary)


class _Area:
    """An `Area` in the form for the compiled part."""

    def __init__(self, area: Area) -> None:
        self.area = area.area
        mesh: Mesh = as_mesh(area.mesh)
        self.mesh = mesh._native
        self.labels = None if area.labels is None else (*_places(area.labels), area.taxonomy)
        self.locations = [_location(pose) for pose in area.locations]


def _places(labels: Labels) -> tuple[list[str], npt.NDArray[np.int32]]:
    """Returns the different names, and the index of each face's name among them."""
    if isinstance(labels, tuple) and len(labels) == 2 and not isinstance(labels[1], str):
        return [str(name) for name in labels[0]], whole("labels", labels[1], np.int32)
    names, places = np.unique(np.asarray(labels, np.str_), return_inverse=True)
    none = int(names.size > 0 and names[0] == "")
    return names[none:].tolist(), (places - none).astype(np.int32)


def _location(pose: PoseLike) -> tuple[str, list[list[float]]]:
    matrix = pose_of(pose).tolist()
    return (pose.uuid if isinstance(pose, Location) else _native.uuid_of_name(f"s3d_py {matrix}")), matrix
