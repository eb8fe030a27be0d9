"""Views that are rendered when they are asked for: training without files."""

from __future__ import annotations

import ctypes
import importlib
import multiprocessing
import multiprocessing.context
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ._camera import Matrix, PoseLike, intrinsics, pose_of
from ._checks import MOST_SEED, number, whole
from ._dataset import DataSet
from ._errors import InputError, UsageError
from ._mesh import MeshLike
from ._packages import for_torch
from ._progress import Progress, sink
from ._scene import MODALITIES, Scene

_OF_LABELS = ("labels", "classes")
_TRIES = 200


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera of a sampler: where it stands and how wide it sees."""

    T_world_cam: Matrix
    """Camera → world, 4 × 4, OpenCV's axes, metres."""
    fov: float
    """Horizontal angle of view, degrees."""


class Sampler(Protocol):
    """Draws cameras. `rng` depends on seed, epoch and index alone."""

    def __call__(self, scene: Scene, rng: np.random.Generator) -> Camera: ...


@dataclass(frozen=True)
class Paper:
    """The paper's distributions: at a scan location, any yaw, a pitch of N(0, 15°), and an angle of view of
    75° − |N(0, 30°)|, at least 10°.
    """

    locations: Sequence[PoseLike]

    def __call__(self, scene: Scene, rng: np.random.Generator) -> Camera:
        place = pose_of(self.locations[int(rng.integers(len(self.locations)))])
        return Camera(looking(place[:3, 3], *_direction(rng)), _paper_fov(rng))


@dataclass(frozen=True)
class FreeSpace:
    """Anywhere in rooms where a camera fits: nothing within `clear` metres, fronts of surfaces on all sides,
    something below within `height` metres (least, most). The view sees surface in at least the share `seen` of its
    rays, and half of them at `near` metres or more.
    """

    clear: float = 0.25
    height: tuple[float, float] = (0.5, 2.0)
    seen: float = 0.95
    near: float = 0.8
    fov: tuple[float, float] = (45.0, 90.0)

    def __call__(self, scene: Scene, rng: np.random.Generator) -> Camera:
        for _ in range(_TRIES):
            eye = self.place(scene, rng)
            for _ in range(4):
                yaw, pitch = _direction(rng)
                camera = Camera(looking(eye, yaw, pitch), float(rng.uniform(*self.fov)))
                if self._sees(scene, camera):
                    return camera
        raise InputError(f"no view was found in free space in {_TRIES} tries: ask for less than {self}")

    def place(self, scene: Scene, rng: np.random.Generator) -> Matrix:
        """Draws a position (3,)."""
        low, high = scene.mesh.bounds.astype(np.float64)
        for _ in range(_TRIES):
            for eye in rng.uniform(low, high, (8, 3)):
                if self.is_free(scene, eye):
                    return eye  # type: ignore[no-any-return]
        raise InputError(f"no free place was found in {8 * _TRIES} tries: is the mesh closed, Z up, in metres?")

    def is_free(self, scene: Scene, eye: Matrix) -> bool:
        """Whether a camera fits at a position (3,)."""
        rays = scene.cast(eye, _AROUND, threads=1)
        hit = rays.face >= 0
        least, most = self.height
        if hit.sum() < 0.95 * len(hit) or np.nanmin(rays.t) < self.clear or not least <= rays.t[0] <= most:
            return False
        fronts = (_normals(scene, rays.face[hit]) * _AROUND[hit]).sum(axis=1) < 0
        return bool(fronts.mean() > 0.9)

    def _sees(self, scene: Scene, camera: Camera) -> bool:
        rays = scene.cast(camera.T_world_cam[:3, 3], _rays_of(camera), threads=1)
        hit = rays.face >= 0
        return bool(hit.mean() >= self.seen and np.median(np.where(hit, rays.t, np.inf)) >= self.near)


def walk(
    scene: Scene | MeshLike,
    frames: int,
    *,
    speed: float = 1.0,
    rate: float = 30.0,
    height: float = 1.5,
    fov: float = 75.0,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress = None,
) -> list[Camera]:
    """Returns the cameras of somebody who walks through rooms, doors and stairs: `rate` a second at `speed` metres
    a second, `height` metres above the floor (0.3 to 2.5), looking where they go. The walk comes within 2 m of every
    place that it can reach, the nearest first; `seed` decides where it begins. `s3d render --trajectory` renders
    the same walk. `RenderedViews(…, sampler=walk(…))` renders the cameras in their order.

    Raises `InputError` if there is no way of a metre, and says what was found.
    """
    count = number("frames", frames, 1)
    intrinsics((1, 1), fov)
    native = (scene if isinstance(scene, Scene) else Scene(scene))._native
    poses = native.walk(count, speed, rate, height, number("seed", seed, 0, MOST_SEED), threads, sink(progress))
    return [Camera(np.array(pose), fov) for pose in poses]


@dataclass(frozen=True)
class Nearby:
    """Second views of pairs: near a first one, so that they share a part of the surface. The share of the first
    view's surface that the second sees is within `overlap`.
    """

    overlap: tuple[float, float] = (0.3, 0.8)
    away: float = 1.0
    """The farthest that the cameras are apart, metres."""
    turn: float = 45.0
    """The largest turn, degrees."""
    space: FreeSpace = field(default_factory=FreeSpace)

    def __call__(self, scene: Scene, rng: np.random.Generator, first: Camera) -> tuple[Camera, float]:
        rays = scene.cast(first.T_world_cam[:3, 3], _rays_of(first), threads=1)
        points = rays.xyz[rays.face >= 0]
        for _ in range(20 * _TRIES):
            offset = rng.normal(size=3)
            offset *= self.away * rng.random() ** (1 / 3) / np.linalg.norm(offset)
            eye = first.T_world_cam[:3, 3] + offset
            ahead = first.T_world_cam[:3, 2]
            yaw = np.arctan2(ahead[1], ahead[0]) + np.radians(rng.uniform(-self.turn, self.turn))
            pitch = np.arcsin(ahead[2]) + np.radians(rng.uniform(-self.turn, self.turn) / 3)
            second = Camera(looking(eye, yaw, float(np.clip(pitch, -1.4, 1.4))), first.fov)
            share = _share_seen(scene, points, second)
            if self.overlap[0] <= share <= self.overlap[1] and self.space.is_free(scene, eye):
                return second, share
        raise InputError(f"no second view was found: ask for a wider range of overlaps than {self.overlap}")


@dataclass(frozen=True)
class Augment:
    """Changes of the camera, drawn anew for each sample."""

    roll: float = 0.0
    """The standard deviation of the roll, degrees."""
    exposure: float = 0.0
    """The standard deviation of the exposure, stops (factors of two of the light)."""
    distortion: float = 0.0
    """The largest |k₁| of the lens in OpenCV's model; less where a wide lens could not show its corners. A sample
    has its `k1`, and `K` stays that of the pinhole.
    """


class RenderedViews:
    """Views that are rendered when they are asked for, as a map-style data set for `torch.utils.data.DataLoader`.

    A sample is a dict like those of `DataSet.torch`: each of `modalities` as (C, H, W) or (H, W), `K`,
    `T_world_cam` and `index`; tensors if torch is installed, otherwise arrays. It depends on seed, epoch and index
    alone, for any number of workers and ranks. With `pairs`, a sample has two, "a" and "b", and "overlap".

    It can be pickled: workers that are spawned read the mesh again, and workers that are forked share it.
    """

    def __init__(
        self,
        source: DataSet | Scene | MeshLike,
        *,
        length: int | None = None,
        size: tuple[int, int] = (512, 512),
        modalities: Sequence[str] = ("rgb", "depth"),
        sampler: str | Sampler | Sequence[Camera] = "paper",
        pairs: Nearby | None = None,
        augment: Augment | None = None,
        labels: npt.ArrayLike | None = None,
        area: int | None = None,
        seed: int = 0,
        transform: Callable[[dict[str, Any]], Any] | None = None,
    ) -> None:
        """- `source`: a data set (`area` names one of its areas), or anything that `Scene` takes.
        - `length`: the number of samples of an epoch; 10,000 if None, or as many as there are cameras.
        - `modalities`: some of "rgb", "depth", "normal", "xyz", "face", "labels", "classes" (−1 for none). "classes"
          needs a data set, "labels" a data set or `labels`, (F,) whole numbers for the faces of the mesh.
        - `sampler`: "paper" (at the data set's scan locations, or where a tripod could stand), "free_space", or
          anything that is called with a scene and a generator of random numbers and returns a `Camera`; or a list of
          cameras, such as those of `walk`, in their order.
        - `transform` turns a sample into what is returned.

        Raises `UsageError` for arguments that do not fit together.
        """
        self.source = source if isinstance(source, (DataSet, Scene)) else Scene(source)
        if not callable(sampler) and not isinstance(sampler, str):
            if not len(sampler) or not all(isinstance(camera, Camera) for camera in sampler):
                raise UsageError("sampler: cameras, each a Camera(T_world_cam, fov)")
        usual = 10_000 if callable(sampler) or isinstance(sampler, str) else len(sampler)
        self.length = number("length", usual if length is None else length, 1)
        self.seed = number("seed", seed, 0, MOST_SEED)
        self.size = (number("size", size[0], 1), number("size", size[1], 1))
        self.modalities = (modalities,) if isinstance(modalities, str) else tuple(modalities)
        self.pairs, self.augment, self.transform = pairs, augment, transform
        self._epoch = _Epoch(0)
        is_data = isinstance(self.source, DataSet)
        if area is not None and not is_data:
            raise UsageError("area: of a data set alone")
        self.area = area if area is None or not isinstance(self.source, DataSet) else self.source._area(area)
        self._given = None if labels is None else whole("labels", labels, np.int32)
        if self._given is not None and (is_data or self._given.shape != (len(self.scene.mesh.faces),)):
            raise UsageError("labels: (F,), one for each face of a mesh; a data set has its own")
        known = (*MODALITIES, *_OF_LABELS) if is_data else MODALITIES
        known = (*known, "labels") if self._given is not None else known
        others = [word for word in self.modalities if word not in known]
        if others or not self.modalities:
            raise UsageError(f"modalities={list(self.modalities)}: some of {', '.join(known)}")
        if isinstance(sampler, str) and sampler not in ("paper", "free_space"):
            raise UsageError(f'sampler={sampler!r}: "paper", "free_space", or something that draws a Camera')
        self.sampler = sampler

    def __len__(self) -> int:
        return self.length

    def set_epoch(self, epoch: int) -> None:
        """Sets the epoch: each has samples of its own. Workers that are there already (`persistent_workers`)
        follow, from the samples on that they begin after it.
        """
        self._epoch.set(number("epoch", epoch, 0))

    @property
    def epoch(self) -> int:
        """The epoch whose samples are made."""
        return self._epoch.get()

    def __getitem__(self, index: int) -> Any:
        if not -self.length <= index < self.length:
            raise IndexError(f"index {index}: there are {self.length} samples")
        return self.sample(index % self.length)

    def stream(self, rank: int = 0, ranks: int = 1) -> RenderedStream:
        """Returns samples without an end, as an iterable data set for torch: each index once over all ranks and
        workers. A worker begins where its number says.
        """
        return RenderedStream._of(self, number("rank", rank, 0, ranks - 1), number("ranks", ranks, 1))

    def sample(self, index: int) -> Any:
        """Returns the sample of any index from 0, also beyond the length."""
        rng = np.random.default_rng([self.seed, self.epoch, index])
        sampler = self.sampler
        if callable(sampler) or isinstance(sampler, str):
            camera = self._draw(self.scene, rng)
        else:
            camera = sampler[index % len(sampler)]
        sample = self._rendered(camera, rng)
        if self.pairs is not None:
            second, share = self.pairs(self.scene, rng, camera)
            sample = {"a": sample, "b": self._rendered(second, rng), "overlap": np.float32(share)}
        sample["index"] = index
        return sample if self.transform is None else self.transform(sample)

    @cached_property
    def scene(self) -> Scene:
        """The scene that is rendered."""
        return self.source.scene(self.area) if isinstance(self.source, DataSet) else self.source

    @cached_property
    def _draw(self) -> Sampler:
        if self.sampler == "free_space":
            return FreeSpace()
        if callable(self.sampler):
            return self.sampler
        if isinstance(self.source, DataSet):
            panoramas = self.source.panoramas(area=self.source._area(self.area))
            places: list[PoseLike] = [panorama.T_world_cam for panorama in panoramas]
            if places:
                return Paper(places)
        return Paper(self.scene.place_cameras(threads=1))

    @cached_property
    def _label_of_face(self) -> npt.NDArray[np.int32]:
        """The label of each face, then that of no face."""
        if isinstance(self.source, DataSet):
            votes = self.source.votes(self.area)
            if votes is None:
                raise UsageError("labels, classes: the data set has no labels")
            return np.append(votes.label.astype(np.int32), np.int32(-1))
        assert self._given is not None
        return np.append(self._given, np.int32(-1))

    def _rendered(self, camera: Camera, rng: np.random.Generator) -> dict[str, Any]:
        augment = self.augment or Augment()
        pose = camera.T_world_cam @ _roll(augment.roll * rng.normal())
        gain, k1 = 2.0 ** (augment.exposure * rng.normal()), augment.distortion * rng.uniform(-1, 1)
        K = intrinsics(self.size, camera.fov)
        words = dict.fromkeys("face" if word in _OF_LABELS else word for word in self.modalities)
        lens = _Lens.of(K, self.size, k1)
        images = self.scene.render(lens.K, pose, lens.size, modalities=list(words))
        sample: dict[str, Any] = {"k1": np.float32(lens.k1)} if augment.distortion else {}
        for word in self.modalities:
            array = self._of_labels(word, images.face) if word in _OF_LABELS else images[word]
            array = lens.seen(array)
            if word == "rgb" and gain != 1.0:
                array = _exposed(array, gain)
            wide = word in ("face", *_OF_LABELS)
            array = array.astype(np.int64) if wide else array
            sample[word] = _tensor(array.transpose(2, 0, 1) if array.ndim == 3 else array)
        sample["K"], sample["T_world_cam"] = (_tensor(m.astype(np.float32)) for m in (K, pose))
        return sample

    def _of_labels(self, word: str, face: npt.NDArray[np.int32]) -> npt.NDArray[Any]:
        label = self._label_of_face[face]
        if word == "labels":
            return label
        assert isinstance(self.source, DataSet)
        return np.where(label > 0, self.source.class_of_label[label], np.int16(-1))

    def __getstate__(self) -> dict[str, Any]:
        made_again = ("scene", "_draw", "_label_of_face")
        return {name: value for name, value in self.__dict__.items() if name not in made_again}

    def __repr__(self) -> str:
        width, height = self.size
        return f"RenderedViews({self.length:,} of {width} × {height}: {', '.join(self.modalities)})"


class _Epoch:
    """A number that a process shares with those that it starts."""

    def __init__(self, epoch: int) -> None:
        self._number = multiprocessing.RawValue(ctypes.c_int64, epoch)

    def get(self) -> int:
        return int(self._number.value)

    def set(self, epoch: int) -> None:
        self._number.value = epoch

    def __reduce__(self) -> tuple[Any, ...]:
        # Shared memory goes to a process that is being started, and nowhere else.
        if multiprocessing.context.get_spawning_popen() is None:
            return _Epoch, (self.get(),)
        return _shared_epoch, (self._number,)


def _shared_epoch(of: Any) -> _Epoch:
    epoch = _Epoch.__new__(_Epoch)
    epoch._number = of
    return epoch


class RenderedStream:
    """Samples without an end: see `RenderedViews.stream`."""

    def __init__(self, views: RenderedViews, rank: int, ranks: int) -> None:
        self.views, self.rank, self.ranks = views, rank, ranks

    @staticmethod
    def _of(views: RenderedViews, rank: int, ranks: int) -> RenderedStream:
        return for_torch(RenderedStream, "IterableDataset")(views, rank, ranks)

    def __reduce__(self) -> tuple[Any, ...]:
        return RenderedStream._of, (self.views, self.rank, self.ranks)

    def __iter__(self) -> Iterator[Any]:
        worker, workers = _worker()
        index, step = self.rank * workers + worker, self.ranks * workers
        while True:
            yield self.views.sample(index)
            index += step


def _worker() -> tuple[int, int]:
    """The number of this worker of a DataLoader, and how many there are."""
    try:
        info = importlib.import_module("torch.utils.data").get_worker_info()
    except ImportError:
        return 0, 1
    return (0, 1) if info is None else (info.id, info.num_workers)


def _tensor(array: npt.NDArray[Any]) -> Any:
    array = np.ascontiguousarray(array)
    try:
        return importlib.import_module("torch").from_numpy(array)
    except ImportError:
        return array


def _direction(rng: np.random.Generator) -> tuple[float, float]:
    """A yaw and a pitch of the paper's distributions, radians."""
    pitch = np.pi
    while abs(pitch) >= 0.5 * np.pi:
        pitch = np.radians(15.0) * rng.normal()
    return float(rng.uniform(-np.pi, np.pi)), float(pitch)


def _paper_fov(rng: np.random.Generator) -> float:
    while True:
        fov = 75.0 - abs(30.0 * rng.normal())
        if fov >= 10.0:
            return float(fov)


def looking(eye: npt.NDArray[Any], yaw: float, pitch: float) -> Matrix:
    """The pose of a camera without roll. The yaw counts from +X to the left."""
    ahead = np.array([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
    right = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = right, np.cross(ahead, right), ahead, eye
    return pose


def _roll(degrees: float) -> Matrix:
    turn = np.eye(4)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn[:2, :2] = [[c, -s], [s, c]]
    return turn


def _rays_of(camera: Camera) -> Matrix:
    """Rays (64, 3) of a square view, spread over it."""
    x, y = np.meshgrid(np.linspace(-0.9, 0.9, 8), np.linspace(-0.9, 0.9, 8))
    wide = np.tan(np.radians(0.5 * camera.fov))
    local = np.stack([wide * x.ravel(), wide * y.ravel(), np.ones(64)], axis=1)
    return local @ camera.T_world_cam[:3, :3].T


def _share_seen(scene: Scene, points: Matrix, camera: Camera) -> float:
    """The share of points on the surface that a square view sees."""
    if not len(points):
        return 0.0
    eye = camera.T_world_cam[:3, 3]
    local = (points - eye) @ camera.T_world_cam[:3, :3]
    wide = np.tan(np.radians(0.5 * camera.fov))
    inside = (local[:, 2] > 0) & (np.abs(local[:, :2]) <= wide * local[:, 2:]).all(axis=1)
    if not inside.any():
        return 0.0
    t = scene.cast(eye, points[inside] - eye, threads=1).t
    return float((t > 0.999).sum() / len(points))


def _normals(scene: Scene, faces: npt.NDArray[np.int32]) -> Matrix:
    a, b, c = scene.mesh.vertices[scene.mesh.faces[faces]].astype(np.float64).transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def _exposed(rgb: npt.NDArray[np.uint8], gain: float) -> npt.NDArray[np.uint8]:
    """Colours after more or less light, by the transfer function of sRGB."""
    level = np.arange(256) / 255.0
    light = gain * np.where(level <= 0.04045, level / 12.92, ((level + 0.055) / 1.055) ** 2.4)
    shown = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    table = np.rint(255.0 * np.clip(shown, 0.0, 1.0)).astype(np.uint8)
    # Black stands for nothing.
    table[1:] = np.maximum(table[1:], 1)
    return table[rgb]


@dataclass(frozen=True, eq=False)
class _Lens:
    """A lens with k₁, whose images are taken from those of a larger pinhole."""

    k1: float
    K: Matrix
    """Intrinsics of the pinhole."""
    size: tuple[int, int]
    """Width and height of the pinhole's images."""
    pixels: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]] | None
    """The row and the column of the pinhole that each pixel shows, (H, W) each; None: the same."""

    @staticmethod
    def of(K: Matrix, size: tuple[int, int], k1: float) -> _Lens:
        if k1 == 0.0:
            return _Lens(0.0, K, size, None)
        width, height = size
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        u, v = (x - K[0, 2]) / K[0, 0], (y - K[1, 2]) / K[1, 1]
        distorted = np.hypot(u, v)
        # Below −4/27 by the square of the largest radius, no ray comes to the corners.
        k1 = max(k1, -0.9 * 4.0 / 27.0 / float(distorted.max()) ** 2)
        # Where the ray of a pixel goes, by Newton's method on r (1 + k₁ r²).
        r = distorted.copy()
        for _ in range(12):
            r -= (r * (1 + k1 * r * r) - distorted) / (1 + 3 * k1 * r * r)
        scale = np.divide(r, distorted, out=np.ones_like(r), where=distorted > 0)
        column, row = np.floor(scale * u * K[0, 0] + K[0, 2]), np.floor(scale * v * K[1, 1] + K[1, 2])
        left, top = (max(0, int(-axis.min())) for axis in (column, row))
        wide = K.copy()
        wide[:2, 2] += left, top
        whole_size = max(width, int(column.max()) + 1) + left, max(height, int(row.max()) + 1) + top
        return _Lens(k1, wide, whole_size, ((row + top).astype(np.int64), (column + left).astype(np.int64)))

    def seen(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Returns what the lens shows of an image of the pinhole: the nearest pixels."""
        return array if self.pixels is None else array[self.pixels]


def _spread() -> Matrix:
    """Down, up, and directions to all sides, unit vectors."""
    count = 24
    z = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    flat = np.sqrt(1 - z * z)
    sides = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    return np.vstack([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], sides])


_AROUND = _spread()
