"""Data sets: read them image by image, check, compare and score them, and pack them for trainers."""

from __future__ import annotations

import importlib
import io
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Union, overload

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import UsageError
from ._mesh import Mesh
from ._names import NameInArea
from ._packages import package
from ._pairs import Correspondences, Pairs, read_pairs
from ._points import LabelledPoints
from ._progress import Progress, sink
from ._results import (
    Comparison,
    Evaluation,
    PathLike,
    Statistics,
    VerifyReport,
    compare,
    evaluate,
    root_of,
    verify,
)
from ._scene import Picture, Scene
from ._viewers import fiftyone_samples, log_to_rerun
from ._views import Image, Panorama, TorchDataset, View, Views, image_at


@dataclass(frozen=True)
class Label:
    """An instance, as an entry of the table of labels."""

    index: int
    """The index that pixels of `View.labels` have."""
    name: NameInArea
    """Class, number, room, area: "chair_3_office_5_1"."""
    class_name: str | None
    """The class; None for the entry that stands for no label."""
    instance: int
    """The number among the instances of its class in the area, from 1."""
    room: str
    """Type and number: "office_5"."""
    area: int


@dataclass(frozen=True)
class Room:
    """A room of an area."""

    area: int
    name: str
    """Type and number: "office_5"."""

    @property
    def type(self) -> str:
        """The type: "office"."""
        return self.name.rpartition("_")[0]


@dataclass(frozen=True)
class Instance:
    """An instance of an area, with the bounding box of its points."""

    label: NameInArea
    """The name in the table of labels."""
    index: int
    """The index in the table of labels."""
    class_name: str
    room: str
    number_in_room: int
    """The number among the instances of its class in the room, from 1, as in `AnnotatedPoints.names`."""
    points: int
    """The number of annotated points."""
    bounds: list[float]
    """xmin, ymin, zmin, xmax, ymax, zmax, in world metres."""


@dataclass(frozen=True, eq=False)
class Outline:
    """A part of the floor of a room, seen from above: counter-clockwise, its holes clockwise."""

    outer: npt.NDArray[np.float64]
    """(N, 2), world x and y, metres."""
    holes: list[npt.NDArray[np.float64]]


@dataclass(frozen=True)
class Split:
    """A fold: areas to train on, and areas of another building to test on."""

    fold: int
    train_areas: list[int]
    test_areas: list[int]


@dataclass(frozen=True)
class Candidate:
    """A view that was drawn at a scan location, kept or dropped by the selection."""

    location: str
    """The name of the scan location."""
    number: int
    yaw: float
    """Radians to the left of the location's original camera."""
    pitch: float
    """Radians above the horizon."""
    fov: float
    """Horizontal angle of view in radians."""
    entropy: float
    """The entropy of the classes of its pixels in nats, which is its score."""
    frame: int | None
    """The number of the view, if it was kept; None if it was dropped."""


@dataclass(frozen=True, eq=False, repr=False)
class FaceVotes:
    """The votes of annotated points for the label of each of the F faces of `DataSet.mesh`."""

    label: npt.NDArray[np.uint32]
    """(F,), index of the label with the most votes, or of the label that filled the face; 0 for none."""
    votes: npt.NDArray[np.uint32]
    """(F,), number of votes for `label`."""
    runner_up: npt.NDArray[np.uint32]
    """(F,), index of the label with the second most votes; 0 if all votes were for one label."""
    runner_up_votes: npt.NDArray[np.uint32]
    """(F,), number of votes for `runner_up`."""
    total: npt.NDArray[np.uint32]
    """(F,), number of all votes."""
    max_distance: npt.NDArray[np.float32]
    """(F,), distance of the farthest voter from the face in metres; 0 without votes."""

    def __repr__(self) -> str:
        return f"FaceVotes({int((self.label > 0).sum()):,} of {len(self.label):,} faces labelled)"


@dataclass(frozen=True, eq=False, repr=False)
class SourceFaces:
    """Where each of the F faces of `DataSet.mesh` comes from. With labels of the faces of the scan's own file,
    `labels[source.face]` are labels of the data set's faces."""

    files: list[str]
    """The files of the scan's mesh, named as in the manifest."""
    file: npt.NDArray[np.uint32]
    """(F,), the file of each face, as a place in `files`."""
    face: npt.NDArray[np.uint32]
    """(F,), its number in this file, from 0."""

    def __repr__(self) -> str:
        return f"SourceFaces({len(self.face):,} faces of {', '.join(self.files)})"


class DataSet(Sequence[Union[View, Panorama]]):
    """A complete data set: all its images, by area, location and number. Everything read is checked against
    its list of files. Threads may share it. It can be pickled; the copy opens the same folder.
    """

    def __init__(self, folder: PathLike) -> None:
        """Raises `FileError` if there is no data set, its export did not finish, or a table is damaged."""
        self._native = _native.DataSet.open(Path(folder))
        self._images = self._native.images
        # The image that was read last, and its arrays.
        self._last: tuple[int, dict[str, npt.NDArray[Any]]] = -1, {}

    def __reduce__(self) -> tuple[Any, ...]:
        return DataSet, (self.root,)

    @property
    def root(self) -> Path:
        """The folder of the data set."""
        return self._native.root

    @property
    def version(self) -> str:
        """The version of s3d that made it."""
        return self._native.version

    @property
    def seed(self) -> int:
        """The seed of its export."""
        return self._native.seed

    @cached_property
    def options(self) -> dict[str, Any]:
        """The options of its export."""
        return json.loads(self._native.options)  # type: ignore[no-any-return]

    @property
    def areas(self) -> list[int]:
        """The numbers of its areas."""
        return self._native.areas

    @cached_property
    def classes(self) -> list[str] | None:
        """The names of its classes; None without labels."""
        found = self._native.classes
        return None if found is None else [name for name, _ in found]

    @cached_property
    def class_colors(self) -> npt.NDArray[np.uint8] | None:
        """(classes, 3), the palette of its classes, sRGB; None without labels."""
        found = self._native.classes
        return None if found is None else np.array([list(color) for _, color in found], np.uint8)

    @cached_property
    def labels(self) -> list[Label]:
        """The table of labels. Pixels of `View.labels` are indices into it. Empty without labels."""
        names = self.classes or []
        return [
            Label(index, NameInArea(name), names[of_class] if of_class >= 0 else None, instance, room, area)
            for index, (name, of_class, instance, room, area) in enumerate(self._native.labels)
        ]

    @cached_property
    def class_of_label(self) -> npt.NDArray[np.int16]:
        """(labels,), the index in `classes` of the class of each label; −1 for none."""
        return self._native.class_of_label

    @cached_property
    def rooms(self) -> list[Room]:
        """The rooms of the labels; without labels, the rooms of the images."""
        found = self._native.rooms() or sorted({(image[0], image[2]) for image in self._images})
        return [Room(area, name) for area, name in found]

    @property
    def locations(self) -> list[str]:
        """The names of its scan locations, in the order of its images."""
        return list(dict.fromkeys(image[1] for image in self._images))

    def __len__(self) -> int:
        return len(self._images)

    @overload
    def __getitem__(self, index: int | str) -> View | Panorama: ...
    @overload
    def __getitem__(self, index: slice) -> Views[View | Panorama]: ...
    def __getitem__(self, index: int | str | slice) -> View | Panorama | Views[View | Panorama]:
        """Returns an image by its index or its `View.name`, or several images by a slice."""
        if isinstance(index, str):
            found = self._by_name.get(index)
            if found is None:
                raise KeyError(f"no image is called {index!r}")
            return image_at(self, found)
        everything = range(len(self._images))
        if isinstance(index, slice):
            return Views(self, everything[index])
        return image_at(self, everything[index])

    def __iter__(self) -> Iterator[View | Panorama]:
        return (image_at(self, index) for index in range(len(self)))

    @cached_property
    def _by_name(self) -> dict[str, int]:
        return {view.name: view.index for view in self}

    def views(
        self,
        *,
        area: int | None = None,
        room: str | Sequence[str] | None = None,
        location: str | None = None,
        min_share: Mapping[str, float] | None = None,
        where: Callable[[View], bool] | None = None,
        progress: Progress = None,
    ) -> Views[View]:
        """Returns its perspective views, all or a selection: an area, a room ("office_5") or several, a scan
        location (its name or its beginning), views in which each class of `min_share` has at least its share of
        the pixels, and views for which `where` is true. For `min_share` the images of labels are read once;
        shares are kept.
        """
        return self._select(False, area, room, location, min_share, where, progress)

    def panoramas(
        self,
        *,
        area: int | None = None,
        room: str | Sequence[str] | None = None,
        location: str | None = None,
        min_share: Mapping[str, float] | None = None,
        where: Callable[[Panorama], bool] | None = None,
        progress: Progress = None,
    ) -> Views[Panorama]:
        """Returns its panoramas, selected like `views`."""
        return self._select(True, area, room, location, min_share, where, progress)

    def _select(
        self,
        panoramas: bool,
        area: int | None,
        room: str | Sequence[str] | None,
        location: str | None,
        min_share: Mapping[str, float] | None,
        where: Callable[[Any], bool] | None,
        progress: Progress,
    ) -> Views[Any]:
        rooms = None if room is None else {room} if isinstance(room, str) else set(room)
        asked = [("room", name) for name in sorted(rooms or ())]
        for what, value in [("area", area), *asked]:
            all_of = self.areas if what == "area" else [one.name for one in self.rooms]
            if value is not None and value not in all_of:
                raise UsageError(
                    f"{what}={value!r}: the data set has {', '.join(map(str, dict.fromkeys(all_of)))}"
                )
        if location is not None and not any(name.startswith(location) for name in self.locations):
            raise UsageError(f"location={location!r}: the data set has no such scan location")
        indices = [
            index
            for index, (of_area, of_location, of_room, frame, _) in enumerate(self._images)
            if (frame is None) == panoramas
            and area in (None, of_area)
            and (rooms is None or of_room in rooms)
            and (location is None or of_location.startswith(location))
        ]
        if min_share:
            if self.classes is None:
                raise UsageError("min_share: the data set has no labels")
            unknown = [name for name in min_share if name not in self.classes]
            if unknown:
                raise UsageError(
                    f"min_share: no class is called {unknown[0]!r}; there are {', '.join(self.classes)}"
                )
            wanted = [(self.classes.index(name), share) for name, share in min_share.items()]
            shares = self._class_shares(indices, progress)
            indices = [
                index
                for index, found in zip(indices, shares)
                if all(found[place] >= share for place, share in wanted)
            ]
        if where is not None:
            indices = [index for index in indices if where(image_at(self, index))]
        return Views(self, indices)

    @cached_property
    def _known_shares(self) -> dict[int, list[float]]:
        return {}

    def _class_shares(self, indices: Sequence[int], progress: Progress = None) -> list[list[float]]:
        known = self._known_shares
        missing = [index for index in indices if index not in known]
        if missing:
            known.update(zip(missing, self._native.class_shares(missing, None, sink(progress))))
        return [known[index] for index in indices]

    def torch(
        self,
        modalities: Sequence[str],
        transform: Callable[[dict[str, Any]], Any] | None = None,
        *,
        size: tuple[int, int] | None = None,
    ) -> TorchDataset:
        """Returns its perspective views as a map-style data set for torch. For other images, call
        `dataset.views(room=…).torch(…)` or `dataset.panoramas().torch(…)`. The first sample imports torch.

        A sample is a dict of tensors: each of `modalities` and "index". The modalities are words of `ARRAYS` and
        `REFINED`, as (C, H, W) or (H, W) with indices as int64 (−1 for none: `ignore_index=-1`), "points", "K" and
        "T_world_cam". With `size`, width and height, images are resampled as `View.at` does. `transform` turns a sample into the value that the loader returns. The data set can be
        pickled, so any number of workers read at the same time.
        """
        return self.views().torch(modalities, transform, size=size)

    def show(self, image: Image, modality: str = "rgb") -> Picture:
        """Returns a modality of an image in colours, which notebooks show: see `View.picture`."""
        return image.picture(modality)

    def to_pandas(self) -> Any:
        """Returns a pandas data frame with a row for each image: its `name`, `area`, `room`, `location` and `frame`
        (missing for a panorama), whether it `is_panorama`, and of a view the `yaw`, `pitch`, `fov` (radians) and
        `entropy` (nats) of its candidate. The index is that of the data set. No image is read.
        """
        drawn = {(number, c.location, c.frame): c for number in self.areas for c in self.candidates(number)}
        table = []
        for image in self:
            row = {"name": image.name, "area": image.area, "room": image.room, "location": image.location}
            candidate = drawn.get((image.area, image.location, image.frame)) if image.frame is not None else None
            for column in ("yaw", "pitch", "fov", "entropy"):
                row[column] = None if candidate is None else getattr(candidate, column)
            table.append({**row, "frame": image.frame, "is_panorama": image.is_panorama})
        frame = package("pandas", "pandas").DataFrame(table, index=range(len(table)))
        return frame.astype({"frame": "Int64"})

    def mesh(self, area: int | None = None, *, progress: Progress = None) -> Mesh:
        """Returns the coloured mesh of an area, in the frame of its images and the face order of its file."""
        return Mesh._of(self._native.mesh(self._area(area), sink(progress)))

    def scene(self, area: int | None = None) -> Scene:
        """Returns the mesh of an area as a scene to render."""
        return Scene(self.mesh(area))

    def points(self, area: int | None = None, *, progress: Progress = None) -> LabelledPoints:
        """Returns the sampled points of an area, those of `3d/pointcloud.ply`, with indices into `labels`."""
        xyz, rgb, label, face = self._native.cloud(self._area(area), sink(progress))
        return LabelledPoints(xyz, rgb, face, label)

    def votes(self, area: int | None = None) -> FaceVotes | None:
        """Returns the votes of points for each face of `mesh(area)`; None without labels."""
        found = self._native.votes(self._area(area))
        return None if found is None else FaceVotes(*found)

    def source_faces(self, area: int | None = None) -> SourceFaces | None:
        """Returns the file and the number in it of each face of `mesh(area)`; None if no file held the mesh."""
        found = self._native.source_faces(self._area(area))
        return None if found is None else SourceFaces(*found)

    def instances(self, area: int | None = None) -> list[Instance]:
        """Returns the instances of an area, or of all areas, with their boxes. Empty without labels."""
        areas = self.areas if area is None else [area]
        found = (entry for number in areas for entry in self._native.instances(number))
        return [Instance(NameInArea(entry[0]), *entry[1:]) for entry in found]

    def outlines(self, area: int | None = None) -> dict[str, list[Outline]]:
        """Returns the outlines of the floors of an area's rooms, by their names. Empty without labels."""
        name = f"area_{self._area(area)}/3d/rooms.json"
        found = json.loads(self._native.read(name)) if self.classes else []
        return {
            room["room"]: [
                Outline(np.array(part["outer"]), [np.array(hole) for hole in part["holes"]])
                for part in room["outline"]
            ]
            for room in found
        }

    def voxels(self, area: int | None = None) -> dict[str, npt.NDArray[Any]]:
        """Returns the arrays of `3d/instances.npz` of an area: 6 × 6 × 6 voxels of each instance with their points.
        """
        with np.load(io.BytesIO(self._native.read(f"area_{self._area(area)}/3d/instances.npz"))) as arrays:
            return {name: arrays[name] for name in arrays.files}

    @property
    def splits(self) -> list[Split]:
        """The folds that its areas allow, as published. Empty for a single area."""
        folds = json.loads(self._native.read("splits.json"))["folds"]
        return [Split(fold["fold"], fold["train_areas"], fold["test_areas"]) for fold in folds]

    def candidates(self, area: int | None = None) -> list[Candidate]:
        """Returns every candidate view of an area, or of all areas, whether it was kept or dropped."""
        areas = self.areas if area is None else [area]
        return [Candidate(*entry) for number in areas for entry in self._native.candidates(number)]

    def pairs(self, area: int | None = None) -> Pairs:
        """Returns the images of an area that see the same surface, which `s3d pairs` found. `UsageError` if it
        was not called yet.
        """
        path = Path(self.root) / f"area_{self._area(area)}" / "pairs.npz"
        if not path.exists():
            raise UsageError(f"{path}: there are no pairs yet: call s3d pairs {self.root}")
        return read_pairs(path)

    def correspondences(self, a: Image, b: Image, count: int = 1000) -> Correspondences:
        """Returns up to `count` places that two of its images show, views or panoramas of one area: they are
        spread over all that `a` shares with `b`, and fewer if that is less. The mesh of an area is read at the
        first call and kept.
        """
        if a.area != b.area:
            raise UsageError(f"a, b: images of areas {a.area} and {b.area}: give two of one area")
        if count < 0:
            raise UsageError(f"count={count}: give a number that is not negative")
        if a.area not in self._scenes:
            votes = self.votes(a.area)
            label = None if votes is None else votes.label.astype(np.int32)
            self._scenes[a.area] = self.scene(a.area), label
        scene, label = self._scenes[a.area]
        cameras = [
            (None if view.K is None else view.K.tolist(), view.T_world_cam.tolist(), view.size)
            for view in (a, b)
        ]
        pixels, xyz, face = scene._native.correspondences(cameras, count)
        of_face = None if label is None else label[face]
        return Correspondences((pixels[:, :2], pixels[:, 2:]), xyz, face, of_face)

    @cached_property
    def _scenes(self) -> dict[int, tuple[Scene, npt.NDArray[np.int32] | None]]:
        return {}

    def _area(self, area: int | None) -> int:
        if area is not None:
            return area
        if len(self.areas) != 1:
            raise UsageError(f"area: name one of {', '.join(map(str, self.areas))}")
        return self.areas[0]

    def verify(
        self, *, full: bool = False, threads: int | None = None, progress: Progress = None
    ) -> VerifyReport:
        """Reads every file back and renders every image again: see `s3d_py.verify`."""
        return verify(self, full=full, threads=threads, progress=progress)

    def evaluate(self, protocol: str, pred: PathLike, **options: Any) -> Evaluation:
        """Scores predictions against it: see `s3d_py.evaluate`."""
        return evaluate(protocol, self, pred, **options)

    def compare(
        self, other: DataSet | PathLike, *, full: bool = False, progress: Progress = None
    ) -> Comparison:
        """Returns the differences between it and another data set: see `s3d_py.compare`."""
        return compare(self, other, full=full, progress=progress)

    def statistics(self) -> Statistics:
        """Returns the paper's tables of statistics, counted from its files."""
        data, markdown = _native.statistics(self.root)
        return Statistics(json.loads(data), markdown)

    def report(
        self,
        to: PathLike | None = None,
        *,
        against: DataSet | PathLike | None = None,
        scores: Sequence[PathLike] = (),
        poster: PathLike | None = None,
        single: bool = False,
        verify: bool = False,
        overwrite: bool = False,
        pano_width: int = 2048,
        thumbs: int = 256,
        mesh_faces: int = 300_000,
        threads: int | None = None,
        progress: Progress = None,
    ) -> Path:
        """Writes a page that shows the data set and opens from the disk, and returns the path of the page.

        - `to`: the folder of the report, or its file if it is `single`; beside the data set by default.
        - `against`: another data set, shown beside this one where both differ.
        - `scores`: files that `s3d eval --json` wrote, or `json.dump(evaluation.data, …)`.
        - `poster`: a file for a picture of the building from above, half in colours and half in classes: a PNG
          of 1600 × 1000 pixels.
        - `pano_width`, `thumbs`: width of panoramas and of views in the report, in pixels.
        - `mesh_faces`: a mesh with more faces is simplified.
        - `verify`: verify the data set as well, and show the result.
        """
        how = SimpleNamespace(
            pano_width=pano_width,
            thumbs=thumbs,
            mesh_faces=mesh_faces,
            verify=verify,
            single=single,
            scores=[Path(path) for path in scores],
            overwrite=overwrite,
            poster=_path(poster),
        )
        return _native.report(
            self.root, _path(to), None if against is None else root_of(against), how, threads, sink(progress)
        )

    def pack(
        self,
        kind: str,
        to: PathLike | None = None,
        *,
        overwrite: bool = False,
        areas: Sequence[int] = (),
        images: str | None = None,
        modalities: Sequence[str] | None = None,
        max_size: int | None = None,
        max_count: int | None = None,
        prefix: str | None = None,
        shuffle: int | None = None,
        points: int | None = None,
        binary: bool = False,
        copy_images: bool = False,
        depth: str | None = None,
        stuff: Sequence[str] | None = None,
        compression: str | None = None,
        threads: int | None = None,
        progress: Progress = None,
    ) -> Path:
        """Packs the data set for a trainer, and returns the path of the package. `kind` is "webdataset",
        "colmap", "nerfstudio", "coco", "parquet", "huggingface", "dust3r", "wai", "vggt", "pointcept",
        "scene-graph", "habitat", "usd", "concerto", "objects" or "spatial-qa". `to` is the folder of the
        package, or its file for Parquet and objects; beside the data set by default. `s3d pack --help`
        explains the other arguments. An empty `stuff` means none.
        """
        how = SimpleNamespace(
            output=_path(to),
            overwrite=overwrite,
            areas=list(areas),
            images=images,
            modalities=None if modalities is None else list(modalities),
            max_size=max_size,
            max_count=max_count,
            prefix=prefix,
            shuffle=shuffle,
            points=points,
            binary=binary,
            copy_images=copy_images,
            depth=depth,
            stuff=None if stuff is None else list(stuff),
            compression=compression,
        )
        return _native.pack(self.root, kind, how, threads, sink(progress))

    def to_rerun(
        self, views: Iterable[Image] | None = None, *, mesh: bool = True, recording: Any = None
    ) -> None:
        """Logs the data set to Rerun: `rerun.init("scan", spawn=True)`, and then this.

        - `views`: the images that the timeline "image" leads through, by their index; all by default, which
          takes the memory of all their files. A view moves the camera of its area, with its colours, depth and
          classes; a panorama is a picture beside the scene.
        - `mesh`: whether the meshes are logged, too, with their textures. Boxes of instances always are.
        - `recording`: a recording of Rerun; the active one by default.

        Raises `UsageError` if rerun-sdk is not installed.
        """
        log_to_rerun(self, self if views is None else views, mesh, recording)

    def to_fiftyone(self, views: Iterable[Image] | None = None, *, name: str | None = None) -> Any:
        """Returns a data set of FiftyOne with a sample for each of `views`, all by default, and `name`, which
        must be free.

        A sample has its image of colours, "area", "room", "location", "is_panorama", "K" (None for a
        panorama) and "T_world_cam" as lists, "classes" as a segmentation (1 + the index in `classes`, 0 for
        none), and "instances" as detections: the class, the index in `labels`, box, mask and
        "instance_name". The files stay where they are.

        Raises `UsageError` if fiftyone is not installed, or an image has no colours.
        """
        samples = fiftyone_samples(self, self if views is None else views)
        fiftyone: Any = importlib.import_module("fiftyone")
        made = fiftyone.Dataset(name)
        if self.classes is not None:
            made.default_mask_targets = {0: "no label", **dict(enumerate(self.classes, 1))}
        made.add_samples(samples, progress=False)
        return made

    def profile(self, *loaders: str, overwrite: bool = False, progress: Progress = None) -> Path:
        """Writes the files that loaders of point clouds read into `profiles/` of the data set, and returns
        that folder. The loaders are "pointcept", "open3d-ml", "mmdet3d" and "pointnet".
        """
        _native.profile(self.root, list(loaders), overwrite, sink(progress))
        return self.root / "profiles"

    def refine_labels(
        self, *, overwrite: bool = False, threads: int | None = None, progress: Progress = None
    ) -> DataSet:
        """Adds labels whose borders are at the edges of the pictures, and returns the data set with the new images:
        `view.refined_labels`, `view.refined_classes` and `view.moved`.
        """
        _native.refine(self.root, overwrite, threads, sink(progress))
        return DataSet(self.root)

    def write_xyz(
        self,
        kind: str = "half",
        *,
        overwrite: bool = False,
        threads: int | None = None,
        progress: Progress = None,
    ) -> DataSet:
        """Computes the images of world coordinates again from depth and pose, in "half" or "float" precision,
        and returns the data set with the new images.
        """
        _native.write_xyz(self.root, kind, overwrite, threads, sink(progress))
        return DataSet(self.root)

    def __repr__(self) -> str:
        panoramas = sum(image[3] is None for image in self._images)
        what = f"{len(self) - panoramas} views, {panoramas} panoramas, {len(self.rooms)} rooms"
        labels = "no labels" if self.classes is None else f"{len(self.classes)} classes"
        return f"DataSet({str(self.root)!r}: areas {self.areas}, {what}, {labels})"


def _path(path: PathLike | None) -> Path | None:
    return None if path is None else Path(path)


def open(folder: PathLike) -> DataSet:  # noqa: A001
    """Opens the data set in a folder for reading."""
    return DataSet(folder)
