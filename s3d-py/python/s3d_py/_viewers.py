"""Hands data sets to Rerun and FiftyOne. Their packages are imported at the first call."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._errors import UsageError
from ._packages import package

if TYPE_CHECKING:
    from ._dataset import DataSet
    from ._views import Image


def log_to_rerun(data: DataSet, views: Iterable[Image], mesh: bool, recording: Any) -> None:
    rr = package("rerun", "rerun-sdk")

    def log(path: str, what: Any, *, static: bool = False) -> None:
        rr.log(path, what, static=static, recording=recording)

    log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    colors = data.class_colors
    if data.classes is not None and colors is not None:
        names = enumerate(zip(data.classes, colors.tolist()), 1)
        legend = [(0, "no label", (0, 0, 0)), *((i, name, tuple(color)) for i, (name, color) in names)]
        log("/", rr.AnnotationContext(legend), static=True)
    for area in data.areas:
        if mesh:
            _log_mesh(rr, log, data, area)
        _log_instances(rr, log, data, area)

    for view in views:
        rr.set_time("image", sequence=view.index, recording=recording)
        place = f"{'panorama' if view.is_panorama else 'world'}/area_{view.area}"
        if not view.is_panorama:
            place += "/camera"
            to_world = view.T_world_cam
            log(place, rr.Transform3D(translation=to_world[:3, 3], mat3x3=to_world[:3, :3]))
            axes = rr.ViewCoordinates.RDF
            log(place, rr.Pinhole(image_from_camera=view.K, resolution=view.size, camera_xyz=axes))
        log(f"{place}/name", rr.TextDocument(view.name))
        if "rgb" in view.files:
            log(f"{place}/rgb", rr.EncodedImage(path=view.path("rgb")))
        if "depth" in view.files:
            log(f"{place}/depth", rr.DepthImage(np.nan_to_num(view.depth), meter=1.0))
        if "semantic" in view.files:
            log(f"{place}/classes", rr.SegmentationImage((view.classes + 1).astype(np.uint16)))


def _log_mesh(rr: Any, log: Any, data: DataSet, area: int) -> None:
    """Logs the mesh of an area: a part for each texture, since a mesh of Rerun has one at most."""
    mesh = data.mesh(area)
    texture_of_face = mesh.texture_of_face
    corners = mesh.vertices[mesh.faces]
    for texture in np.unique(texture_of_face):
        faces = texture_of_face == texture
        columns: dict[str, Any] = {"vertex_positions": corners[faces].reshape(-1, 3)}
        if texture >= 0 and mesh.uv is not None and mesh.face_uv is not None:
            uv = mesh.uv[mesh.face_uv[faces].reshape(-1)]
            # Rerun counts downwards.
            columns["vertex_texcoords"] = np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1)
            columns["albedo_texture"] = mesh.textures[texture]
        elif mesh.vertex_colors is not None:
            columns["vertex_colors"] = mesh.vertex_colors[mesh.faces[faces]].reshape(-1, 3)
        name = f"texture_{texture}" if texture >= 0 else "colors"
        log(f"world/area_{area}/mesh/{name}", rr.Mesh3D(**columns), static=True)


def _log_instances(rr: Any, log: Any, data: DataSet, area: int) -> None:
    """Logs the boxes of the instances of an area, by class."""
    classes = data.classes or []
    by_class: dict[str, list[Any]] = {}
    for instance in data.instances(area):
        by_class.setdefault(instance.class_name, []).append(instance)
    for name, instances in by_class.items():
        bounds = np.array([instance.bounds for instance in instances])
        boxes = rr.Boxes3D(
            mins=bounds[:, :3],
            sizes=bounds[:, 3:] - bounds[:, :3],
            labels=[instance.label for instance in instances],
            class_ids=[classes.index(name) + 1] * len(instances),
            show_labels=False,
        )
        log(f"world/area_{area}/instances/{name}", boxes, static=True)


def fiftyone_samples(data: DataSet, views: Iterable[Image]) -> list[Any]:
    """The samples of `DataSet.to_fiftyone`."""
    fo = package("fiftyone", "fiftyone")
    return [_sample(fo, data, view) for view in views]


def _sample(fo: Any, data: DataSet, view: Image) -> Any:
    if "rgb" not in view.files:
        raise UsageError(f"{view.name} has no rgb: samples of FiftyOne are images")
    fields: dict[str, Any] = {
        "area": view.area,
        "room": view.room,
        "location": view.location,
        "is_panorama": view.is_panorama,
        "T_world_cam": view.T_world_cam.tolist(),
        "K": None if view.K is None else view.K.tolist(),
    }
    if "semantic" in view.files:
        fields["instances"] = fo.Detections(
            detections=[
                fo.Detection(
                    label=data.labels[index].class_name,
                    index=index,
                    bounding_box=box,
                    mask=mask,
                    instance_name=data.labels[index].name,
                )
                for index, box, mask in instances_of(view.instances)
            ]
        )
        kind = np.uint8 if len(data.classes or ()) < 256 else np.uint16
        fields["classes"] = fo.Segmentation(mask=(view.classes + 1).astype(kind))
    return fo.Sample(filepath=str(view.path("rgb")), **fields)


def instances_of(image: npt.NDArray[np.int32]) -> Iterable[tuple[int, list[float], npt.NDArray[np.bool_]]]:
    """Of each instance of an image its index, the box of its pixels as shares of the image (left, top, width,
    height), and its pixels within the box.
    """
    height, width = image.shape
    rows, columns = np.nonzero(image >= 0)
    found = image[rows, columns]
    order = np.argsort(found, kind="stable")
    rows, columns, found = rows[order], columns[order], found[order]
    starts = np.flatnonzero(np.diff(found, prepend=-1))
    for start, end in zip(starts, [*starts[1:], len(found)]):
        y, x = rows[start:end], columns[start:end]
        top, left, bottom, right = y.min(), x.min(), y.max() + 1, x.max() + 1
        index = int(found[start])
        box = [left / width, top / height, (right - left) / width, (bottom - top) / height]
        yield index, [float(share) for share in box], image[top:bottom, left:right] == index
