"""Data sets: read them image by image, check, compare and score them, and pack them for trainers."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from . import _native
from ._camera import Matrix
from ._errors import UsageError
from ._mesh import Mesh
from ._pairs import Correspondences, Pairs, read_pairs
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
from ._scene import Scene, picture
from ._viewers import fiftyone_samples, log_to_rerun

ARRAYS = ("rgb", "depth", "normal", "xyz", "labels", "classes", "instances", "pretty")
"""The arrays of a view. `View` describes each."""

_FILE_OF = {
    "labels": "semantic",
    "classes": "semantic",
    "instances": "semantic",
    "pretty": "semantic_pretty",
    "xyz": "global_xyz",
}


@dataclass(frozen=True)
class Label:
    """An instance, as an entry of the table of labels."""

    index: int
    """The index that pixels of `View.labels` have."""
    name: str
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

    label: str
    """The name in the table of labels."""
    index: int
    """The index in the table of labels."""
    class_name: str
    room: str
    points: int
    """The number of annotated points."""
    bounds: list[float]
    """xmin, ymin, zmin, xmax, ymax, zmax, in world metres."""


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


class View:
    """A perspective view or panorama of a data set. Its modalities are registered pixel to pixel.

    The first access to a modality reads its file and compares it with its checksum; the view keeps the array.
    Arrays are read-only: to change one, copy it. Getters raise `UsageError` for a modality without a file,
    and `FileError` for a damaged file.
    """

    def __init__(self, dataset: DataSet, index: int) -> None:
        self._dataset, self.index = dataset, index
        self.area, self.location, self.room, self.frame, self.files = dataset._images[index]
        self._arrays: dict[str, npt.NDArray[Any]] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return View, (self._dataset, self.index)

    index: int
    """The index in the data set: `dataset[view.index]` is the same image."""
    area: int
    location: str
    """The name of the scan location, 32 hexadecimal digits."""
    room: str
    """Type and number: "office_5"."""
    frame: int | None
    """The number of the view at its location; None for a panorama."""
    files: Sequence[str]
    """The modalities that have a file, by the names of their folders."""

    @property
    def is_panorama(self) -> bool:
        """Whether the image is a panorama; otherwise it is a perspective view."""
        return self.frame is None

    @property
    def name(self) -> str:
        """The beginning of the names of its files, unique in its area."""
        frame = "equirectangular" if self.frame is None else self.frame
        return f"camera_{self.location}_{self.room}_frame_{frame}"

    @cached_property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self._dataset._native.size(self.index)

    @cached_property
    def _camera(self) -> tuple[Matrix, Matrix]:
        K, T = self._dataset._native.camera(self.index)
        return np.array(K), np.array(T)

    @property
    def K(self) -> Matrix | None:
        """Intrinsics, 3 × 3, pixels; the centre of the first pixel is at (0.5, 0.5). None for a panorama."""
        return None if self.is_panorama else self._camera[0]

    @property
    def T_world_cam(self) -> Matrix:
        """Camera → world, 4 × 4, OpenCV's axes (x right, y down, z forward), metres. The middle column of a
        panorama looks along z, projected to the horizon; its rows are level whatever the tilt of the pose.
        """
        return self._camera[1]

    @cached_property
    def pose(self) -> dict[str, Any]:
        """The content of the pose file, under the published keys."""
        return json.loads(self._dataset._native.file(self.index, "pose"))  # type: ignore[no-any-return]

    @property
    def objects(self) -> list[dict[str, Any]]:
        """The instances with a pixel in the image, under the keys of the file: amodal masks, what hides them,
        distances and boxes. The data set needs the modality "objects".
        """
        return json.loads(self._dataset._native.file(self.index, "objects"))["objects"]  # type: ignore[no-any-return]

    @property
    def rgb(self) -> npt.NDArray[np.uint8]:
        """(H, W, 3), sRGB."""
        return self["rgb"]

    @property
    def depth(self) -> npt.NDArray[np.float32]:
        """(H, W), metres: along z in a view, along the ray in a panorama. NaN where nothing is seen, or where
        the depth is larger than the file can hold.
        """
        return self["depth"]

    @property
    def normal(self) -> npt.NDArray[np.float32]:
        """(H, W, 3), unit vectors, exact to 0.5°. A view has the camera's axes, x right, y down, z forward,
        whatever axes the file has; a panorama has (X, −Z, Y) of the world. NaN where nothing is seen.
        """
        return self["normal"]

    @property
    def xyz(self) -> npt.NDArray[np.float32]:
        """(H, W, 3), world metres as stored (half precision: centimetres). NaN where nothing is seen.
        `points` computes the coordinates from depth instead.
        """
        return self["xyz"]

    @property
    def labels(self) -> npt.NDArray[np.int32]:
        """(H, W), index into `DataSet.labels`; 0 without a label, −1 where nothing is seen."""
        return self["labels"]

    @property
    def classes(self) -> npt.NDArray[np.int16]:
        """(H, W), index into `DataSet.classes`; −1 without a label and where nothing is seen."""
        return self["classes"]

    @property
    def instances(self) -> npt.NDArray[np.int32]:
        """(H, W), index of the instance in `DataSet.labels`; −1 without a label and where nothing is seen."""
        return self["instances"]

    @property
    def pretty(self) -> npt.NDArray[np.uint8]:
        """(H, W, 3), one colour for each instance, to look at."""
        return self["pretty"]

    def points(self) -> npt.NDArray[np.float32]:
        """Returns world metres, (H, W, 3), from depth and pose. NaN where depth is missing."""
        return self._dataset._native.points(self.index)

    @cached_property
    def shares(self) -> dict[str, float]:
        """The share of the pixels of each class that occurs in the image."""
        found = self._dataset._class_shares([self.index])[0]
        return {name: share for name, share in zip(self._dataset.classes or (), found) if share > 0}

    def path(self, modality: str) -> Path:
        """Returns the path of the file of a modality, which is a word of `files` or of `ARRAYS`."""
        return self._dataset._native.path(self.index, _FILE_OF.get(modality, modality))

    def load(self, *modalities: str) -> View:
        """Reads these modalities at the same time, each on its own thread; without names, all that exist."""
        wanted = modalities or tuple(name for name in ARRAYS if _FILE_OF.get(name, name) in self.files)
        with ThreadPoolExecutor(max(len(wanted), 1)) as pool:
            for _ in pool.map(self.__getitem__, wanted):
                pass
        return self

    def __getitem__(self, modality: str) -> npt.NDArray[Any]:
        """`view["depth"]` is `view.depth`."""
        array = self._arrays.get(modality)
        if array is None:
            array = self._read(modality)
            array.flags.writeable = False
            self._arrays[modality] = array
        return array

    def _read(self, modality: str) -> npt.NDArray[Any]:
        file, native = _FILE_OF.get(modality, modality), self._dataset._native
        if modality not in ARRAYS:
            raise UsageError(f"{modality!r}: must be one of {', '.join(ARRAYS)}")
        if file not in self.files:
            raise UsageError(f"{self.name} has no {file}: it has {', '.join(self.files)}")
        if modality == "rgb" or modality == "pretty":
            return native.rgb(self.index, modality == "pretty")
        if modality == "depth":
            return native.depth(self.index)
        if modality == "normal":
            return native.normal(self.index)
        if modality == "xyz":
            return native.xyz(self.index)
        if modality == "classes":
            return native.class_(self.index)
        if modality == "labels":
            return native.label(self.index)
        labels = self.labels
        return np.where(labels > 0, labels, np.int32(-1))

    def __repr__(self) -> str:
        what = "panorama" if self.is_panorama else f"view {self.frame}"
        return (
            f"View({what} of {self.location[:8]}… in {self.room}, area {self.area}: {', '.join(self.files)})"
        )

    def _repr_png_(self) -> bytes:
        """The first of its images, for notebooks."""
        if "rgb" in self.files:
            return _native.encode_png(np.ascontiguousarray(self.rgb))
        for name in ("pretty", "normal", "depth"):
            if _FILE_OF.get(name, name) in self.files:
                shown = self[name] if name == "pretty" else picture(name, self[name])
                return _native.encode_png(np.ascontiguousarray(shown))
        raise UsageError(f"{self.name} has no image to show")


class Views(Sequence[View]):
    """Images of a data set, in its order. Every access makes a new `View`: a loop keeps one in memory."""

    def __init__(self, dataset: DataSet, indices: Sequence[int]) -> None:
        self.dataset, self.indices = dataset, list(indices)

    def __len__(self) -> int:
        return len(self.indices)

    @overload
    def __getitem__(self, index: int) -> View: ...
    @overload
    def __getitem__(self, index: slice) -> Views: ...
    def __getitem__(self, index: int | slice) -> View | Views:
        if isinstance(index, slice):
            return Views(self.dataset, self.indices[index])
        return View(self.dataset, self.indices[index])

    def __iter__(self) -> Iterator[View]:
        return (View(self.dataset, index) for index in self.indices)

    def torch(
        self, modalities: Sequence[str], transform: Callable[[dict[str, Any]], Any] | None = None
    ) -> TorchDataset:
        """Returns these images as a data set for torch: see `DataSet.torch`."""
        return TorchDataset(self, modalities, transform)

    def __repr__(self) -> str:
        panoramas = sum(self.dataset._images[index][3] is None for index in self.indices)
        return f"Views({len(self) - panoramas} views, {panoramas} panoramas)"


class TorchDataset:
    """A map-style data set for `torch.utils.data.DataLoader`, with any number of workers."""

    def __init__(
        self, views: Views, modalities: Sequence[str], transform: Callable[[dict[str, Any]], Any] | None
    ) -> None:
        others = [word for word in modalities if word not in (*ARRAYS, "K", "T_world_cam", "points")]
        if others or not modalities:
            raise UsageError(
                f"modalities={list(modalities)}: some of {', '.join(ARRAYS)}, points, K, T_world_cam"
            )
        self.views, self.modalities, self.transform = views, tuple(modalities), transform

    def __len__(self) -> int:
        return len(self.views)

    def __getitem__(self, index: int) -> Any:
        torch: Any = importlib.import_module("torch")
        view = self.views[index]
        sample: dict[str, Any] = {"index": view.index}
        for word in self.modalities:
            if word in ("K", "T_world_cam"):
                matrix = view.K if word == "K" else view.T_world_cam
                if matrix is None:
                    raise UsageError(f"{view.name} is a panorama, which has no K")
                sample[word] = torch.from_numpy(matrix.copy())
                continue
            array = view.points() if word == "points" else view[word]
            if array.ndim == 3:
                array = array.transpose(2, 0, 1)
            wide = word in ("labels", "classes", "instances")
            sample[word] = torch.from_numpy(array.astype(np.int64) if wide else array.copy())
        return sample if self.transform is None else self.transform(sample)


class DataSet(Sequence[View]):
    """A complete data set: all its images, by area, location and number. Everything read is checked against
    its list of files. Threads may share it. It can be pickled; the copy opens the same folder.
    """

    def __init__(self, folder: PathLike) -> None:
        """Raises `FileError` if there is no data set, its export did not finish, or a table is damaged."""
        self._native = _native.DataSet.open(Path(folder))
        self._images = self._native.images

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
            Label(index, name, names[of_class] if of_class >= 0 else None, instance, room, area)
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
    def __getitem__(self, index: int | str) -> View: ...
    @overload
    def __getitem__(self, index: slice) -> Views: ...
    def __getitem__(self, index: int | str | slice) -> View | Views:
        """Returns an image by its index or its `View.name`, or several images by a slice."""
        if isinstance(index, str):
            found = self._by_name.get(index)
            if found is None:
                raise KeyError(f"no image is called {index!r}")
            return View(self, found)
        everything = range(len(self._images))
        if isinstance(index, slice):
            return Views(self, everything[index])
        return View(self, everything[index])

    def __iter__(self) -> Iterator[View]:
        return iter(Views(self, range(len(self))))

    @cached_property
    def _by_name(self) -> dict[str, int]:
        return {view.name: view.index for view in self}

    def views(
        self,
        *,
        area: int | None = None,
        room: str | None = None,
        location: str | None = None,
        min_share: Mapping[str, float] | None = None,
        progress: Progress = None,
    ) -> Views:
        """Returns its perspective views, all or a selection: an area, a room ("office_5"), a scan location
        (its name or its beginning), and views in which each class of `min_share` has at least its share
        of the pixels. For `min_share` the images of labels are read once; shares are kept.
        """
        return self._select(False, area, room, location, min_share, progress)

    def panoramas(
        self,
        *,
        area: int | None = None,
        room: str | None = None,
        location: str | None = None,
        min_share: Mapping[str, float] | None = None,
        progress: Progress = None,
    ) -> Views:
        """Returns its panoramas, selected like `views`."""
        return self._select(True, area, room, location, min_share, progress)

    def _select(
        self,
        panoramas: bool,
        area: int | None,
        room: str | None,
        location: str | None,
        min_share: Mapping[str, float] | None,
        progress: Progress,
    ) -> Views:
        for what, value, all_of in (
            ("area", area, self.areas),
            ("room", room, [name.name for name in self.rooms]),
        ):
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
            and room in (None, of_room)
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
        self, modalities: Sequence[str], transform: Callable[[dict[str, Any]], Any] | None = None
    ) -> TorchDataset:
        """Returns its perspective views as a map-style data set for torch. For other images, call
        `dataset.views(room=…).torch(…)` or `dataset.panoramas().torch(…)`. The first sample imports torch.

        A sample is a dict of tensors: each of `modalities` and "index". The modalities are words of `ARRAYS`,
        as (C, H, W) or (H, W) with indices as int64 (−1 for none: `ignore_index=-1`), "points", "K" and
        "T_world_cam". `transform` turns a sample into the value that the loader returns. The data set can be
        pickled, so any number of workers read at the same time.
        """
        return self.views().torch(modalities, transform)

    def mesh(self, area: int | None = None, *, progress: Progress = None) -> Mesh:
        """Returns the coloured mesh of an area, in the frame of its images and the face order of its file."""
        return Mesh._of(self._native.mesh(self._area(area), sink(progress)))

    def scene(self, area: int | None = None) -> Scene:
        """Returns the mesh of an area as a scene to render."""
        return Scene(self.mesh(area))

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
        return [Instance(*entry) for number in areas for entry in self._native.instances(number)]

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

    def correspondences(self, a: View, b: View, count: int = 1000) -> Correspondences:
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
        self, views: Iterable[View] | None = None, *, mesh: bool = True, recording: Any = None
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

    def to_fiftyone(self, views: Iterable[View] | None = None, *, name: str | None = None) -> Any:
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
