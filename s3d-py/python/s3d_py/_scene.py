"""Renders images of a mesh, and casts rays at it."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._camera import Location, Matrix, PoseLike, matrix, pose_of
from ._checks import number
from ._errors import InputError, UsageError
from ._files import replaced
from ._mesh import Mesh, MeshLike, as_mesh
from ._progress import Progress, sink
from ._rays import ClosestPoints, Rays, as_points, as_rays

MODALITIES = ("rgb", "depth", "normal", "xyz", "face")
"""The modalities of a view; `Images` describes each."""


class Picture:
    """An image in colours, which notebooks show."""

    def __init__(self, pixels: npt.NDArray[np.uint8]) -> None:
        if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 3:
            raise UsageError(f"pixels: uint8 (H, W, 3), not {pixels.dtype} {pixels.shape}")
        self.pixels = pixels

    pixels: npt.NDArray[np.uint8]
    """(H, W, 3), sRGB."""

    def beside(self, *others: Picture) -> Picture:
        """Returns pictures of the same height in a row, this one first."""
        if any(len(other.pixels) != len(self.pixels) for other in others):
            raise UsageError(f"pictures of one height, not {[len(p.pixels) for p in (self, *others)]}")
        return Picture(np.concatenate([self.pixels, *(other.pixels for other in others)], axis=1))

    def under(self, other: Picture, share: float = 0.5) -> Picture:
        """Returns a picture of the same size in which another one lies over this one, by a share of 0 to 1. Where
        the other is black, this one stays.
        """
        if other.pixels.shape != self.pixels.shape or not 0.0 <= share <= 1.0:
            sizes = f"{self.pixels.shape} and {other.pixels.shape}"
            raise UsageError(f"share={share}: 0 to 1, of pictures of one size, here {sizes}")
        mixed = np.rint((1.0 - share) * self.pixels + share * other.pixels).astype(np.uint8)
        return Picture(np.where(other.pixels.any(axis=2, keepdims=True), mixed, self.pixels))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes it as a PNG file, whose name ends so."""
        if Path(path).suffix.lower() != ".png":
            raise UsageError(f"{path}: pictures are written as .png")
        with replaced(Path(path)) as file:
            file.write(self._repr_png_())

    def _repr_png_(self) -> bytes:
        return _native.encode_png(np.ascontiguousarray(self.pixels))


class Images:
    """The images of one view or panorama, H × W. Each pixel shows the same hit in all of them. Only the
    requested modalities exist.
    """

    K: Matrix | None
    """Intrinsics, 3 × 3, pixels; None for a panorama."""
    T_world_cam: Matrix
    """Camera → world, 4 × 4, OpenCV's axes."""

    def __init__(self, arrays: dict[str, npt.NDArray[Any]], K: Matrix | None, T_world_cam: Matrix) -> None:
        self._arrays = arrays
        self.K, self.T_world_cam = K, T_world_cam

    def __getitem__(self, modality: str) -> npt.NDArray[Any]:
        if modality not in self._arrays:
            raise AttributeError(f"{modality!r} was not asked for: modalities={list(self._arrays)}")
        return self._arrays[modality]

    @property
    def modalities(self) -> tuple[str, ...]:
        """The names of the images."""
        return tuple(self._arrays)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        height, width = next(iter(self._arrays.values())).shape[:2]
        return width, height

    @property
    def rgb(self) -> npt.NDArray[np.uint8]:
        """(H, W, 3), sRGB. Pure black only where nothing is seen."""
        return self["rgb"]

    @property
    def depth(self) -> npt.NDArray[np.float32]:
        """(H, W), metres: along the optical axis (z) in a view, along the ray in a panorama. NaN where
        nothing is seen.
        """
        return self["depth"]

    @property
    def normal(self) -> npt.NDArray[np.float32]:
        """(H, W, 3), unit vectors towards the camera's side: in a view in the camera's axes, x right, y down,
        z forward, so that a wall that faces the camera is (0, 0, −1) and `n @ T_world_cam[:3, :3].T` is in
        the world; in a panorama (X, −Z, Y) of the world. NaN where nothing is seen.
        """
        return self["normal"]

    @property
    def xyz(self) -> npt.NDArray[np.float32]:
        """(H, W, 3), world metres. NaN where nothing is seen."""
        return self["xyz"]

    @property
    def face(self) -> npt.NDArray[np.int32]:
        """(H, W), index of the mesh's face. −1 where nothing is seen."""
        return self["face"]

    def picture(self, modality: str = "rgb") -> Picture:
        """Returns one of the images in colours to look at: depth from light (near) to dark, coordinates as red, green
        and blue, each face in a colour; black where nothing is seen.
        """
        return Picture(picture(modality, self[modality]))

    def __repr__(self) -> str:
        width, height = self.size
        kind = "panorama" if self.K is None else "view"
        return f"Images({kind}, {width} × {height}: {', '.join(self._arrays)})"

    def _repr_png_(self) -> bytes:
        """Returns the first image as PNG, for notebooks."""
        return self.picture(next(iter(self._arrays)))._repr_png_()


_SCALE = [(255, 244, 180), (250, 170, 70), (205, 75, 85), (105, 35, 115), (20, 15, 60)]
"""Colours of numbers, from the least to the largest: what is near is light."""


def picture(name: str, array: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Returns colours, (H, W, 3), that show a modality."""
    if name == "rgb":
        return array
    if name == "face":
        mixed = array.astype(np.uint32) * np.uint32(2654435761)
        colors = np.stack([mixed >> 24, mixed >> 16 & 255, mixed >> 8 & 255], -1)
        return np.where(array[..., None] < 0, 0, colors).astype(np.uint8)
    if name == "normal":
        shown = 0.5 + 0.5 * array * [1.0, 1.0, -1.0]
    else:
        low, high = (
            (np.nanmin(array, (0, 1)), np.nanmax(array, (0, 1))) if np.isfinite(array).any() else (0.0, 1.0)
        )
        shown = (array - low) / np.maximum(high - low, 1e-9)
    if shown.ndim == 2:
        at = np.linspace(0.0, 1.0, len(_SCALE))
        shown = np.stack([np.interp(shown, at, channel) for channel in np.array(_SCALE).T], -1) / 255.0
    return np.nan_to_num(255.0 * shown).astype(np.uint8)


def _request(
    size: tuple[int, int],
    modalities: Sequence[str],
    rgb_samples: int,
    smooth_normals: bool,
    stored: bool,
) -> tuple[tuple[list[str], bool, int, bool], tuple[int, int]]:
    """Returns what to render, and width and height, as the native code takes them."""
    words = list(dict.fromkeys([modalities] if isinstance(modalities, str) else modalities))
    if not words:
        raise UsageError(f"modalities: name some of {', '.join(MODALITIES)}")
    sides = tuple(size) if isinstance(size, (Sequence, np.ndarray)) else ()
    if len(sides) != 2 or not all(isinstance(side, (int, np.integer)) and side > 0 for side in sides):
        raise UsageError(f"size={size}: width and height must be whole numbers from 1")
    width, height = sides
    samples = number("rgb_samples", rgb_samples, 1, 64)
    return (words, bool(smooth_normals), samples, stored), (int(width), int(height))


class Scene:
    """A mesh with a tree over its faces, built once and shared by any number of threads. The mesh is not
    copied.

    Visibility is exact: no pinholes, no leaks at shared edges. The bits are the same for any number of
    threads, and the same as in the files of `s3d render` and `s3d export`. One image is made on the calling
    thread, without Python's lock.
    """

    def __init__(self, mesh: MeshLike) -> None:
        """`mesh` is anything that `as_mesh` takes."""
        self.mesh: Mesh = as_mesh(mesh)
        self._native = _native.Scene(self.mesh._native)
        self._open_edges: int | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return Scene, (self.mesh,)

    def __repr__(self) -> str:
        return f"Scene({self.mesh!r})"

    def render(
        self,
        K: npt.ArrayLike,
        T_world_cam: PoseLike,
        size: tuple[int, int],
        *,
        modalities: Sequence[str] = ("rgb", "depth", "normal"),
        rgb_samples: int = 1,
        smooth_normals: bool = False,
    ) -> Images:
        """Renders the images of a pinhole camera.

        - `K`: 3 × 3, pixels, without skew; the centre of the first pixel is at (0.5, 0.5).
        - `T_world_cam`: camera → world, 4 × 4, OpenCV's axes (x right, y down, z forward), metres.
        - `size`: (width, height), pixels.
        - `modalities`: some of "rgb", "depth", "normal", "xyz", "face".
        - `rgb_samples`: from 1 to 64, the number of samples for the colour of a pixel where surfaces end or
          bend.
        - `smooth_normals`: interpolate the normals of the mesh's vertices, if it has any.

        Raises `UsageError` for an invalid matrix, and says what is wrong with it; `TooLargeError` (a
        `MemoryError`) if the images would not fit into memory.
        """
        return self._images(
            matrix("K", K, (3, 3)), T_world_cam, size, modalities, rgb_samples, smooth_normals
        )

    def panorama(
        self,
        pose: PoseLike,
        width: int = 2048,
        *,
        modalities: Sequence[str] = ("rgb", "depth", "normal"),
        rgb_samples: int = 1,
        smooth_normals: bool = False,
    ) -> Images:
        """Renders an equirectangular panorama of `width` × `width` / 2 pixels. The middle column looks along
        the pose's forward axis, projected to the horizon. Rows go from +90° down to −90° in the world,
        whatever the pose's tilt. `pose` is a `Location`, a 4 × 4 matrix, or a position (3,) from which the
        middle looks along +Y. `depth` is along the ray.
        """
        return self._images(None, pose, (width, width // 2), modalities, rgb_samples, smooth_normals)

    def render_many(
        self,
        poses: Iterable[PoseLike],
        K: npt.ArrayLike,
        size: tuple[int, int],
        *,
        modalities: Sequence[str] = ("rgb", "depth", "normal"),
        rgb_samples: int = 1,
        smooth_normals: bool = False,
        threads: int | None = None,
    ) -> Iterator[Images]:
        """Returns a generator of `render` for each pose, in order, made on `threads` threads (one a core if
        None). At most three images a thread exist at a time, so `poses` may be endless.
        """
        intrinsics = matrix("K", K, (3, 3))
        count = os.cpu_count() or 1 if threads is None else threads
        if count < 1:
            raise UsageError(f"threads={threads}: must be at least 1")

        def generate() -> Iterator[Images]:
            waiting: deque[Future[Images]] = deque()
            with ThreadPoolExecutor(count) as pool:
                try:
                    for pose in poses:
                        waiting.append(
                            pool.submit(
                                self._images, intrinsics, pose, size, modalities, rgb_samples, smooth_normals
                            )
                        )
                        if len(waiting) > 2 * count:
                            yield waiting.popleft().result()
                    while waiting:
                        yield waiting.popleft().result()
                finally:
                    for image in waiting:
                        image.cancel()

        return generate()

    def render_stored(
        self,
        K: npt.ArrayLike | None,
        T_world_cam: PoseLike,
        size: tuple[int, int],
        *,
        modalities: Sequence[str] = ("rgb", "depth", "normal"),
        rgb_samples: int = 1,
        smooth_normals: bool = False,
    ) -> dict[str, npt.NDArray[Any]]:
        """Renders like `render` (like `panorama` if `K` is None), with pixels as stored in the files of a
        data set: `depth` uint16, 512 a metre, 65,535 where nothing is seen or beyond 128 m; `normal` uint8,
        127.5 + 127.5 n in the paper's axes (right, down, towards the camera), 128 where nothing is seen;
        `xyz` float16, 0 where nothing is seen; `rgb` and `face` as in `render`.
        """
        intrinsics = None if K is None else matrix("K", K, (3, 3))
        return self._arrays(
            intrinsics, pose_of(T_world_cam), size, modalities, rgb_samples, smooth_normals, True
        )

    def render_stack(
        self,
        poses: Iterable[PoseLike],
        K: npt.ArrayLike,
        size: tuple[int, int],
        *,
        modalities: Sequence[str] = ("rgb", "depth", "normal"),
        rgb_samples: int = 1,
        smooth_normals: bool = False,
        threads: int | None = None,
        progress: Progress = None,
    ) -> dict[str, npt.NDArray[Any]]:
        """Renders N cameras of one size at once: for many small images, as simulators and samplers want them. Returns
        an array by modality, (N, H, W) or (N, H, W, 3), with the pixels of `render`. `K` is (3, 3), or (N, 3, 3).

        Raises what `render` raises.
        """
        matrices = [pose_of(pose).tolist() for pose in poses]
        ks = [matrix("K", k, (3, 3)).tolist() for k in (K if np.ndim(K) == 3 else [K])]  # type: ignore[union-attr]
        if not matrices:
            raise UsageError("poses: there are none")
        if len(ks) not in (1, len(matrices)):
            raise UsageError(f"{len(matrices)} poses and {len(ks)} K: one K for all poses, or one for each")
        request, (width, height) = _request(size, modalities, rgb_samples, smooth_normals, False)
        made = self._native.render_stack(ks, matrices, (width, height), request, threads, sink(progress))
        return {word: made[word] for word in request[0]}

    def cast(
        self, origins: npt.ArrayLike, directions: npt.ArrayLike | None = None, *, threads: int | None = None
    ) -> Rays:
        """Returns the first hits of rays, from either side of the faces; exact, as in images.

        - `origins`: (…, 3), or (3,) for all rays, world metres. Or (…, 6), origins and directions, without
          `directions`.
        - `directions`: (…, 3), of any length, world metres.

        Only hits at t > 0 count. Rays with an infinite or zero direction hit nothing. Uses `threads` threads,
        one a core if None. Ctrl-C ends it.
        """
        shape, starts, ways = as_rays(origins, directions)
        t, face = self._native.cast(starts, ways, threads)
        whole = (*shape, 3)
        starts = np.broadcast_to(starts, ways.shape)
        return Rays(
            t.reshape(shape), face.reshape(shape), starts.reshape(whole), ways.reshape(whole), self.mesh
        )

    def test_occlusions(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike | None = None,
        *,
        before: float = np.inf,
        threads: int | None = None,
    ) -> npt.NDArray[np.bool_]:
        """Returns whether rays hit a face at t < `before`, (…), in less time than `cast`. Rays are given like
        those of `cast`. `test_occlusions(a, b - a, before=1 - 1e-6)` tells what is hidden from a at b.
        """
        shape, starts, ways = as_rays(origins, directions)
        return self._native.occluded(starts, ways, float(before), threads).reshape(shape)

    def count_intersections(
        self, origins: npt.ArrayLike, directions: npt.ArrayLike | None = None, *, threads: int | None = None
    ) -> npt.NDArray[np.uint32]:
        """Returns the number of faces that rays hit, (…). Rays are given like those of `cast`. A ray through an
        edge hits all faces there.
        """
        shape, starts, ways = as_rays(origins, directions)
        return self._native.intersections(starts, ways, threads).reshape(shape)

    def closest_points(self, points: npt.ArrayLike, *, threads: int | None = None) -> ClosestPoints:
        """Returns the nearest places of the mesh to points (…, 3), world metres, which are taken in 32 bits.
        Uses `threads` threads, one a core if None.
        """
        shape, flat = as_points(points)
        xyz, distance, face = self._native.closest(flat.astype(np.float32), threads)
        return ClosestPoints(xyz.reshape(*shape, 3), distance.reshape(shape), face.reshape(shape), self.mesh)

    def contains(self, points: npt.ArrayLike, *, threads: int | None = None) -> npt.NDArray[np.bool_]:
        """Returns whether the mesh encloses points (…, 3), world metres: whether rays from them meet an odd
        number of faces. Faces may be turned either way.

        Raises `InputError` if the mesh is not watertight.
        """
        self._require_watertight()
        shape, flat = as_points(points)
        return self._native.contains(flat, threads).reshape(shape)

    def signed_distance(self, points: npt.ArrayLike, *, threads: int | None = None) -> npt.NDArray[np.float32]:
        """Returns the distances from points (…, 3) to the mesh, metres, negative inside; NaN for points that are
        not finite.

        Raises `InputError` if the mesh is not watertight.
        """
        inside = self.contains(points, threads=threads)
        distance = self.closest_points(points, threads=threads).distance
        return np.where(inside, -distance, distance)

    def _require_watertight(self) -> None:
        if self._open_edges is None:
            self._open_edges = self.mesh._native.open_edges()
        if self._open_edges:
            raise InputError(
                f"the mesh is not watertight: its surface ends at {self._open_edges:,} edges, so nothing is "
                "inside; closest_points works for any mesh"
            )

    def place_cameras(
        self,
        *,
        see: float | None = None,
        apart: float | None = None,
        seed: int = 0,
        threads: int | None = None,
        progress: Progress = None,
    ) -> list[Location]:
        """Returns scan locations where a tripod could stand: 1.5 m above surfaces that face up, indoors,
        clear of objects.

        By default these are as few locations as see the share `see` (0.95 if neither is given) of the surface
        that can be seen from anywhere, the most useful first. With `apart` they are a pattern in which
        locations that see each other are at least `apart` metres apart. `s3d export` places the same
        locations on the same mesh and seed.

        Raises `InputError` if there is no such place, and says what was found: the mesh may be upside down or
        in other units.
        """
        if apart is not None and not apart > 0:
            raise UsageError(f"apart={apart}: must be above 0 metres")
        placed = self._native.place_cameras(see, apart, seed, threads, sink(progress))
        return [Location(uuid, np.array(pose)) for uuid, pose in placed]

    def _images(
        self,
        K: Matrix | None,
        pose: PoseLike,
        size: tuple[int, int],
        modalities: Sequence[str],
        rgb_samples: int,
        smooth_normals: bool,
    ) -> Images:
        T = pose_of(pose)
        return Images(self._arrays(K, T, size, modalities, rgb_samples, smooth_normals, False), K, T)

    def _arrays(
        self,
        K: Matrix | None,
        T: Matrix,
        size: tuple[int, int],
        modalities: Sequence[str],
        rgb_samples: int,
        smooth_normals: bool,
        stored: bool,
    ) -> dict[str, npt.NDArray[Any]]:
        request, (width, height) = _request(size, modalities, rgb_samples, smooth_normals, stored)
        made = self._native.render(None if K is None else K.tolist(), T.tolist(), (width, height), request)
        return {word: made[word] for word in request[0]}
