"""The images of a data set: views and panoramas, alone and in selections."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

import numpy as np
import numpy.typing as npt

from . import _native
from ._camera import Matrix
from ._checks import number
from ._errors import UsageError
from ._packages import for_torch
from ._rays import as_points
from ._scene import Picture, picture

if TYPE_CHECKING:
    from ._dataset import DataSet

ARRAYS = ("rgb", "depth", "normal", "xyz", "labels", "classes", "instances", "pretty")
"""The arrays of a view. `View` describes each."""

REFINED = ("refined_labels", "refined_classes", "moved")
"""Arrays of labels that follow the picture: `view["refined_labels"]`. Nothing reads them unasked."""

_FILE_OF = {
    "labels": "semantic",
    "classes": "semantic",
    "instances": "semantic",
    "pretty": "semantic_pretty",
    "xyz": "global_xyz",
    "refined_labels": "semantic_refined",
    "refined_classes": "semantic_refined",
    "moved": "semantic_moved",
}




class Image:
    """A `View` or a `Panorama` of a data set. Its modalities are registered pixel to pixel.

    An access to a modality reads its file and compares it with its checksum. The arrays of the image that was
    read last stay in memory, and those that `load` read as long as the image. Arrays are read-only: to change
    one, copy it. Getters raise `UsageError` for a modality without a file, and `FileError` for a damaged file.
    """

    def __init__(self, dataset: DataSet, index: int) -> None:
        self._dataset, self.index = dataset, index
        self.area, self.location, self.room, self._frame, self.files = dataset._images[index]
        self._loaded: dict[str, npt.NDArray[Any]] = {}
        # The part that is shown: x, y, width and height, and the size that it is shown in; None for all, as it is.
        self._window: Window | None = None
        self._shown_in: tuple[int, int] | None = None

    @property
    def _key(self) -> tuple[Any, ...]:
        return self._dataset.root, self.index, self._window, self._shown_in

    def __reduce__(self) -> tuple[Any, ...]:
        return _shown, (type(self), self._dataset, self.index, self._window, self._shown_in)

    def __eq__(self, other: object) -> bool:
        """Whether both are the same image of a data set in the same folder."""
        return self._key == other._key if isinstance(other, Image) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key)

    index: int
    """The index in the data set: `dataset[view.index]` is the same image."""
    area: int
    location: str
    """The name of the scan location, 32 hexadecimal digits."""
    room: str
    """Type and number: "office_5"."""
    files: Sequence[str]
    """The modalities that have a file, by the names of their folders."""

    @property
    def frame(self) -> int | None:
        """The number of the view at its location; None for a panorama."""
        return self._frame

    @property
    def K(self) -> Matrix | None:
        """Intrinsics, 3 × 3, pixels; the centre of the first pixel is at (0.5, 0.5). None for a panorama."""
        return None

    @property
    def is_panorama(self) -> bool:
        """Whether the image is a `Panorama`; otherwise it is a `View`."""
        return self.frame is None

    @property
    def name(self) -> str:
        """The beginning of the names of its files, unique in its area."""
        frame = "equirectangular" if self.frame is None else self.frame
        return f"camera_{self.location}_{self.room}_frame_{frame}"

    @cached_property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self._shown_in or self._dataset._native.size(self.index)

    @cached_property
    def _camera(self) -> tuple[Matrix, Matrix]:
        K, T = (np.array(matrix) for matrix in self._dataset._native.camera(self.index))
        if self._window is not None:
            x, y, width, height = self._window
            K[:2, 2] -= [x, y]
            K[:2] *= np.divide(self.size, [width, height])[:, None]
        return K, T

    def at(self: AnImage, size: tuple[int, int] | None = None, *, crop: Window | None = None) -> AnImage:
        """Returns the image in another size, width and height in pixels, and of a view only the part `crop`: x, y,
        width and height. Its arrays, `K` and `project` are those of the new pixels. `rgb` is the mean of the area
        that a pixel covers, and all else is that of the old pixel at its centre. `files`, `pose`, `objects` and
        `shares` are those of the whole image, and so are calls of the data set that take an image.
        """
        whole = self._dataset._native.size(self.index)
        if self._window is not None:
            raise UsageError("at: the image is in another size already; take the one of the data set")
        if crop is not None and self.is_panorama:
            raise UsageError("crop: of views; a part of a panorama is none")
        x, y, width, height = window = (0, 0, *whole) if crop is None else _whole_numbers("crop", crop, 4, 0)
        if not (0 < width <= whole[0] - x and 0 < height <= whole[1] - y):
            raise UsageError(f"crop={window}: x, y, width and height within {whole[0]} × {whole[1]} pixels")
        shown_in = (width, height) if size is None else _whole_numbers("size", size, 2, 1)
        return _shown(type(self), self._dataset, self.index, window, shown_in)

    @property
    def T_world_cam(self) -> Matrix:
        """Camera → world, 4 × 4, OpenCV's axes (x right, y down, z forward), metres. The middle column of a
        panorama looks along z, projected to the horizon; its rows are level whatever the tilt of the pose.
        """
        return self._camera[1]

    def project(self, xyz: npt.ArrayLike) -> tuple[Matrix, Matrix]:
        """Returns where the image shows points (…, 3) in world metres: pixels (…, 2), x to the right and y down,
        the centre of the first pixel at (0.5, 0.5), which may lie outside of the image; and depths (…) as
        `depth` has them, metres. Pixels of points behind a view are NaN. Surfaces between are not looked at.
        """
        shape, points = as_points(xyz, "xyz")
        pixels, depth = self._project(points - self.T_world_cam[:3, 3])
        return pixels.reshape(*shape, 2), depth.reshape(shape)

    def _project(self, offsets: Matrix) -> tuple[Matrix, Matrix]:
        raise NotImplementedError

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

    @property
    def refined_labels(self) -> npt.NDArray[np.int32]:
        """As `labels`, with borders at the edges of the picture. The data set needs the modality
        "semantic_refined", which `s3d refine` adds.
        """
        return self["refined_labels"]

    @property
    def refined_classes(self) -> npt.NDArray[np.int16]:
        """As `classes`, of `refined_labels`."""
        return self["refined_classes"]

    @property
    def moved(self) -> npt.NDArray[np.bool_]:
        """(H, W), where `refined_labels` has another label than `labels`. The data set needs the modality
        "semantic_moved".
        """
        return self["moved"]

    def points(self) -> npt.NDArray[np.float32]:
        """Returns world metres, (H, W, 3), from depth and pose. NaN where depth is missing."""
        return self._taken(self._dataset._native.points(self.index))

    @cached_property
    def shares(self) -> dict[str, float]:
        """The share of the pixels of each class that occurs in the image."""
        found = self._dataset._class_shares([self.index])[0]
        return {name: share for name, share in zip(self._dataset.classes or (), found) if share > 0}

    def path(self, modality: str) -> Path:
        """Returns the path of the file of a modality, which is a word of `files`, of `ARRAYS` or of `REFINED`."""
        return self._dataset._native.path(self.index, _FILE_OF.get(modality, modality))

    def load(self: AnImage, *modalities: str) -> AnImage:
        """Reads these modalities at the same time, each on its own thread, and keeps them; without names, all of
        `ARRAYS` that exist.
        """
        wanted = modalities or tuple(name for name in ARRAYS if _FILE_OF.get(name, name) in self.files)
        with ThreadPoolExecutor(max(len(wanted), 1)) as pool:
            self._loaded.update(zip(wanted, pool.map(self.__getitem__, wanted)))
        return self

    def __getitem__(self, modality: str) -> npt.NDArray[Any]:
        """`view["depth"]` is `view.depth`."""
        found = self._loaded.get(modality)
        if found is not None:
            return found
        if self._window is not None:
            shown = self._shown(modality)
            shown.flags.writeable = False
            return shown
        index, last = self._dataset._last
        if index != self.index:
            last = {}
            self._dataset._last = self.index, last
        array = last.get(modality)
        if array is None:
            array = self._read(modality)
            array.flags.writeable = False
            last[modality] = array
        return array

    def picture(self, modality: str = "rgb") -> Picture:
        """Returns a modality in colours to look at: classes in those of the data set, labels in those of instances,
        depth from light (near) to dark, coordinates as red, green and blue; black where nothing is known. Notebooks
        show it.
        """
        array = self[modality]
        if modality in ("classes", "refined_classes"):
            colors = np.vstack([self._dataset.class_colors, np.zeros((1, 3), np.uint8)])  # type: ignore[list-item]
            return Picture(colors[array])
        if modality in ("labels", "instances", "refined_labels"):
            return Picture(picture("face", np.where(array > 0, array, -1)))
        return Picture(np.ascontiguousarray(array if modality == "pretty" else picture(modality, array)))

    def _shown(self, modality: str) -> npt.NDArray[Any]:
        """Reads an array of the whole image, and returns it in the size that is asked for."""
        array = image_at(self._dataset, self.index)[modality]
        if modality == "rgb" and self._window is not None:
            return _native.averaged(array, self._window, self.size)
        return self._taken(array)

    def _taken(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Returns the old pixels at the centres of the new ones."""
        if self._window is None:
            return array
        x, y, width, height = self._window
        columns = x + (np.arange(self.size[0]) * 2 + 1) * width // (2 * self.size[0])
        rows = y + (np.arange(self.size[1]) * 2 + 1) * height // (2 * self.size[1])
        return array[rows[:, None], columns]

    def _read(self, modality: str) -> npt.NDArray[Any]:
        file, native = _FILE_OF.get(modality, modality), self._dataset._native
        if modality not in ARRAYS + REFINED:
            raise UsageError(f"{modality!r}: must be one of {', '.join(ARRAYS + REFINED)}")
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
        if modality in ("classes", "refined_classes"):
            return native.class_(self.index, modality == "refined_classes")
        if modality in ("labels", "refined_labels"):
            return native.label(self.index, modality == "refined_labels")
        if modality == "moved":
            return native.moved(self.index)
        labels = self.labels
        return np.where(labels > 0, labels, np.int32(-1))

    def __repr__(self) -> str:
        what = "" if self.frame is None else f"{self.frame} "
        place = f"{self.location[:8]}… in {self.room}, area {self.area}"
        return f"{type(self).__name__}({what}of {place}: {', '.join(self.files)})"

    def _repr_png_(self) -> bytes:
        """The first of its images, for notebooks."""
        for name in ("rgb", "pretty", "normal", "depth"):
            if _FILE_OF.get(name, name) in self.files:
                return self.picture(name)._repr_png_()
        raise UsageError(f"{self.name} has no image to show")


class View(Image):
    """A perspective view."""

    @property
    def frame(self) -> int:
        """The number of the view at its location."""
        return self._frame or 0

    @property
    def K(self) -> Matrix:
        """Intrinsics, 3 × 3, pixels; the centre of the first pixel is at (0.5, 0.5)."""
        return self._camera[0]

    def _project(self, offsets: Matrix) -> tuple[Matrix, Matrix]:
        local = offsets @ self.T_world_cam[:3, :3]
        depth = local[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = (local @ self.K.T)[:, :2] / depth[:, None]
        pixels[~(depth > 0)] = np.nan
        return pixels, depth


class Panorama(Image):
    """An equirectangular panorama, twice as wide as high."""

    def _project(self, offsets: Matrix) -> tuple[Matrix, Matrix]:
        width, height = self.size
        ahead = self.T_world_cam[:2, 2]
        x, y, z = offsets.T
        # To the left of the middle, a turn at most.
        turn = np.arctan2(y, x) - np.arctan2(ahead[1], ahead[0])
        turn = (turn + np.pi) % (2 * np.pi) - np.pi
        rise = np.arctan2(z, np.hypot(x, y))
        pixels = np.stack([(0.5 - turn / (2 * np.pi)) * width, (0.5 - rise / np.pi) * height], axis=1)
        return pixels, np.linalg.norm(offsets, axis=1)


AnImage = TypeVar("AnImage", bound=Image)
Window = tuple[int, int, int, int]


def _shown(
    kind: type[AnImage], dataset: DataSet, index: int, window: Window | None, size: tuple[int, int] | None
) -> AnImage:
    """Returns an image of which a part is shown in a size."""
    image = kind(dataset, index)
    image._window, image._shown_in = window, size
    return image


def _whole_numbers(what: str, values: Sequence[int], count: int, least: int) -> Any:
    if len(values) != count:
        raise UsageError(f"{what}={tuple(values)}: {count} whole numbers")
    return tuple(number(what, value, least, 1 << 20) for value in values)


Some = TypeVar("Some", bound=Image, covariant=True)


def image_at(dataset: DataSet, index: int) -> View | Panorama:
    """Returns the image with an index."""
    return (Panorama if dataset._images[index][3] is None else View)(dataset, index)


class Views(Sequence[Some], Generic[Some]):
    """Images of a data set, in its order. Every access makes a new `View` or `Panorama`."""

    def __init__(self, dataset: DataSet, indices: Sequence[int]) -> None:
        self.dataset, self.indices = dataset, list(indices)

    def __len__(self) -> int:
        return len(self.indices)

    @overload
    def __getitem__(self, index: int) -> Some: ...
    @overload
    def __getitem__(self, index: slice) -> Views[Some]: ...
    def __getitem__(self, index: int | slice) -> Some | Views[Some]:
        if isinstance(index, slice):
            return Views(self.dataset, self.indices[index])
        return image_at(self.dataset, self.indices[index])  # type: ignore[return-value]

    def __iter__(self) -> Iterator[Some]:
        return (self[place] for place in range(len(self)))

    def torch(
        self,
        modalities: Sequence[str],
        transform: Callable[[dict[str, Any]], Any] | None = None,
        *,
        size: tuple[int, int] | None = None,
    ) -> TorchDataset:
        """Returns these images as a data set for torch: see `DataSet.torch`."""
        return TorchDataset._of(self, modalities, transform, size)

    def __repr__(self) -> str:
        panoramas = sum(self.dataset._images[index][3] is None for index in self.indices)
        return f"Views({len(self) - panoramas} views, {panoramas} panoramas)"


class TorchDataset:
    """A map-style data set for `torch.utils.data.DataLoader`, with any number of workers. It is a
    `torch.utils.data.Dataset` if torch is installed.
    """

    def __init__(
        self,
        views: Views[Image],
        modalities: Sequence[str],
        transform: Callable[[dict[str, Any]], Any] | None,
        size: tuple[int, int] | None = None,
    ) -> None:
        others = [word for word in modalities if word not in (*ARRAYS, *REFINED, "K", "T_world_cam", "points")]
        if others or not modalities:
            raise UsageError(
                f"modalities={list(modalities)}: some of {', '.join(ARRAYS + REFINED)}, points, K, T_world_cam"
            )
        self.views, self.modalities, self.transform, self.size = views, tuple(modalities), transform, size

    @staticmethod
    def _of(
        views: Views[Image],
        modalities: Sequence[str],
        transform: Callable[[dict[str, Any]], Any] | None,
        size: tuple[int, int] | None,
    ) -> TorchDataset:
        return for_torch(TorchDataset, "Dataset")(views, modalities, transform, size)

    def __reduce__(self) -> tuple[Any, ...]:
        return TorchDataset._of, (self.views, self.modalities, self.transform, self.size)

    def __len__(self) -> int:
        return len(self.views)

    def __getitem__(self, index: int) -> Any:
        torch: Any = importlib.import_module("torch")
        view = self.views[index] if self.size is None else self.views[index].at(self.size)
        sample: dict[str, Any] = {"index": view.index}
        for word in self.modalities:
            if word in ("K", "T_world_cam"):
                matrix = view.T_world_cam if word == "T_world_cam" else view.K
                if matrix is None:
                    raise UsageError(f"{view.name} is a panorama, which has no K")
                # As images are.
                sample[word] = torch.from_numpy(matrix.astype(np.float32))
                continue
            array = view.points() if word == "points" else view[word]
            if array.ndim == 3:
                array = array.transpose(2, 0, 1)
            wide = word in ("labels", "classes", "instances", "refined_labels", "refined_classes")
            sample[word] = torch.from_numpy(array.astype(np.int64) if wide else array.copy())
        return sample if self.transform is None else self.transform(sample)


