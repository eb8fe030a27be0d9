"""Meshes: from files, arrays, and the objects of other packages."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from ._errors import UsageError
from ._native import Mesh as NativeMesh
from ._progress import Sink

log = logging.getLogger("s3d_py")

FAR_M = 10_000.0
"""Farther from the origin than this, metres, positions of 32 bits step by a millimetre."""


class Mesh:
    """A triangle mesh: world metres, Z up. Nothing of it changes; scenes and threads share it without copies.

    Every face has an area, every index is in range, every number finite. Faces without area and those with
    the corners of an earlier face are left out where it is made: `face` images, votes and all other columns
    count what is left.
    """

    _native: NativeMesh

    def __init__(
        self,
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        *,
        vertex_colors: npt.ArrayLike | None = None,
        uv: npt.ArrayLike | None = None,
        texture: npt.ArrayLike | Sequence[npt.NDArray[np.uint8]] | None = None,
        texture_of_face: npt.ArrayLike | None = None,
        vertex_normals: npt.ArrayLike | None = None,
    ) -> None:
        """A mesh of arrays, which are copied.

        - `vertices`: (V, 3), world metres, Z up; stored in 32 bits.
        - `faces`: (F, 3), indices into `vertices`, counter-clockwise seen from the front.
        - `vertex_colors`: (V, 3) or (V, 4), sRGB, uint8, or floats from 0 to 1.
        - `uv`: texture coordinates, (V, 2), or (F, 3, 2) where corners have their own; (0, 0) is the bottom
          left of the image. `texture` is that image, (H, W, 3) of uint8, or a list of some; then
          `texture_of_face`, (F,), names the one of each face, −1 for none.
        - `vertex_normals`: (V, 3), unit vectors, for smooth normals.

        Raises `MeshError` for an index out of range, a corner that is not finite, or no face with an area;
        `UsageError` for an array of another shape.
        """
        positions = rows("vertices", vertices, 3, np.float32)
        if positions.size and np.abs(positions).max() > FAR_M:
            log.warning(
                "vertices lie up to %.0f m from the origin, where 32 bits step by a millimetre or more: "
                "subtract an offset before",
                np.abs(positions).max(),
            )
        corners = indices("faces", faces, 3)
        textures = (
            [] if texture is None else list(texture) if isinstance(texture, (list, tuple)) else [texture]
        )
        images = [np.ascontiguousarray(image, np.uint8) for image in textures]
        if any(image.ndim != 3 for image in images):
            raise UsageError("texture: an image (H, W, 3) of uint8, or a list of such")
        uvs, face_uv = (None, None) if uv is None else _corner_uv(uv, positions, corners)
        self._native = NativeMesh.from_arrays(
            positions,
            corners,
            None if vertex_colors is None else colors_of(vertex_colors),
            uvs,
            face_uv,
            images,
            None
            if texture_of_face is None
            else np.ascontiguousarray(texture_of_face, np.int32).view(np.uint32),
            None if vertex_normals is None else rows("vertex_normals", vertex_normals, 3, np.float32),
        )

    @classmethod
    def _of(cls, native: NativeMesh) -> Mesh:
        mesh = cls.__new__(cls)
        mesh._native = native
        return mesh

    @property
    def vertices(self) -> npt.NDArray[np.float32]:
        """(V, 3), world metres. This and the other arrays show the mesh's own memory where they can,
        read-only.
        """
        return self._native.vertices

    @property
    def faces(self) -> npt.NDArray[np.uint32]:
        """(F, 3), indices into `vertices`."""
        return self._native.faces

    @property
    def vertex_colors(self) -> npt.NDArray[np.uint8] | None:
        """(V, 3), sRGB; None if there are none."""
        return self._native.vertex_colors

    @property
    def uv(self) -> npt.NDArray[np.float32] | None:
        """(N, 2), texture coordinates, (0, 0) at the image's bottom left; None if there are none."""
        return self._native.uv

    @property
    def face_uv(self) -> npt.NDArray[np.uint32] | None:
        """(F, 3), indices into `uv`, 2³² − 1 where a face has none; None if there are none."""
        return self._native.face_uv

    @property
    def textures(self) -> list[npt.NDArray[np.uint8]]:
        """The images, (H, W, 3) each, top row first."""
        return [image for _, image in self._native.textures]

    @property
    def texture_of_face(self) -> npt.NDArray[np.int32]:
        """(F,), which of `textures` a face shows, −1 for none."""
        return self._native.texture_of_face.view(np.int32)

    @property
    def face_normals(self) -> npt.NDArray[np.float32]:
        """(F, 3), unit vectors in the world, by the winding of the faces. Computed anew."""
        return self._native.face_normals()

    @property
    def face_areas(self) -> npt.NDArray[np.float64]:
        """(F,), m². Computed anew."""
        return self._native.face_areas()

    @property
    def area(self) -> float:
        """Of all faces, m²."""
        return self._native.area

    @property
    def bounds(self) -> npt.NDArray[np.float32]:
        """(2, 3): the smallest and the largest coordinates, metres."""
        return np.array(self._native.bounds, np.float32)

    @property
    def offset(self) -> npt.NDArray[np.float64]:
        """(3,), metres: what was subtracted from the positions of a file far from its origin. Cameras and
        points are to be in the same frame: subtract it from theirs.
        """
        return np.array(self._native.offset)

    @property
    def has_labels(self) -> bool:
        """Whether its file labels its faces or vertices."""
        return self._native.has_labels

    @property
    def warnings(self) -> list[str]:
        """What was mended, left out or replaced when its file was read, a sentence each."""
        return self._native.warnings

    @property
    def path(self) -> Path | None:
        """Its file; None for one of arrays."""
        return self._native.path

    def __repr__(self) -> str:
        name = f"{self.path.name}: " if self.path else ""
        size = " × ".join(f"{side:.1f}" for side in self.bounds[1] - self.bounds[0])
        looks = (
            f", {n} textures"
            if (n := len(self._native.textures))
            else ", coloured"
            if self.vertex_colors is not None
            else ""
        )
        labels = ", labels" if self.has_labels else ""
        return f"Mesh({name}{len(self.faces):,} faces, {self.area:.1f} m², {size} m{looks}{labels})"


MeshLike = Union[Mesh, str, PathLike[str], Any]
"""A `Mesh`; the path of a file; a mesh of trimesh or Open3D."""


def read_mesh(
    path: str | PathLike[str], *, up: str = "y", units: str | None = None, near: bool = True
) -> Mesh:
    """Reads a mesh with its textures: OBJ, glTF, GLB or PLY, told by the ending.

    `up` is the axis of the file that points up, "y" or "z"; `units` "m", "cm", "mm", "ft" or "in", by default
    what the file says, else metres. With `near`, a mesh more than 1,024 m from the origin is moved to it, and
    `Mesh.offset` tells by how much. What is mended is in `Mesh.warnings` and the log.

    Raises `MissingFileError`, `FormatError` with file and line, `MeshError` if no face is left,
    `UnsupportedError`.
    """
    return Mesh._of(NativeMesh.read(fspath(path), up, units, near, Sink()))


def as_mesh(mesh: MeshLike, *, up: str = "z") -> Mesh:
    """The mesh that something is: a `Mesh`, or one of trimesh or Open3D, whose positions, faces, colours and
    textures are copied. They are taken as metres; `up` says which axis of theirs points up: both packages
    leave a glTF file's "y" as it is. A path is read by `read_mesh` with its defaults.
    """
    if isinstance(mesh, Mesh):
        return mesh
    if isinstance(mesh, (str, PathLike)):
        return read_mesh(mesh)
    if up not in ("y", "z"):
        raise UsageError(f"up={up!r}: must be y or z")
    # A scene of trimesh; a mesh of Open3D's tensors.
    other: Any = mesh
    for joined in ("to_mesh", "to_legacy"):
        if hasattr(other, joined):
            other = getattr(other, joined)()
    if not hasattr(other, "vertices") or not (hasattr(other, "faces") or hasattr(other, "triangles")):
        raise UsageError(f"{type(other).__name__} is no mesh: it has no vertices with faces or triangles")
    columns = _of_trimesh(other) if hasattr(other, "faces") else _of_open3d(other)
    vertices = np.asarray(other.vertices, np.float64)
    if up == "y":
        vertices = vertices[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    return Mesh(vertices, **columns)


def _of_trimesh(mesh: Any) -> dict[str, Any]:
    columns: dict[str, Any] = {"faces": mesh.faces}
    visual: Any = getattr(mesh, "visual", None)
    kind = getattr(visual, "kind", None)
    if kind == "vertex":
        columns["vertex_colors"] = visual.vertex_colors
    elif kind == "texture" and visual.uv is not None:
        material = visual.material
        image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
        if image is not None:
            columns["uv"], columns["texture"] = visual.uv, np.asarray(image.convert("RGB"))
    return columns


def _of_open3d(mesh: Any) -> dict[str, Any]:
    columns: dict[str, Any] = {"faces": np.asarray(mesh.triangles)}
    if mesh.has_vertex_colors():
        columns["vertex_colors"] = np.asarray(mesh.vertex_colors)
    # One a material, empty where that has none; bottom row first.
    images = {k: np.asarray(image)[::-1] for k, image in enumerate(mesh.textures) if not image.is_empty()}
    if images and mesh.has_triangle_uvs():
        place = {k: number for number, k in enumerate(images)}
        columns["uv"] = np.asarray(mesh.triangle_uvs).reshape(-1, 3, 2)
        columns["texture"] = [
            image[:, :, :3] if image.ndim == 3 else np.stack([image] * 3, -1) for image in images.values()
        ]
        columns["texture_of_face"] = [place.get(k, -1) for k in np.asarray(mesh.triangle_material_ids)]
    return columns


def rows(what: str, values: npt.ArrayLike, columns: int, kind: Any) -> npt.NDArray[Any]:
    """The values as an array (n, columns) of this type, in C order."""
    try:
        array = np.ascontiguousarray(values, kind)
    except (TypeError, ValueError) as error:
        raise UsageError(f"{what}: {error}") from None
    if array.ndim != 2 or array.shape[1] != columns:
        raise UsageError(f"{what}: an array (n, {columns}), not of shape {array.shape}")
    return array


def indices(what: str, values: npt.ArrayLike, columns: int) -> npt.NDArray[np.uint32]:
    """The values as indices."""
    array = np.asarray(values)
    if array.dtype.kind not in "iu" and array.size:
        raise UsageError(f"{what}: whole numbers, not {array.dtype}")
    if array.size and (array.min() < 0 or array.max() >= 2**32):
        raise UsageError(f"{what}: indices from 0, not {array.min()} to {array.max()}")
    return rows(what, array, columns, np.uint32)


def colors_of(values: npt.ArrayLike, what: str = "vertex_colors") -> npt.NDArray[np.uint8]:
    """Colours of uint8, or of floats from 0 to 1, without their opacity."""
    array = np.asarray(values)
    if array.dtype.kind == "f":
        array = np.rint(np.clip(array, 0.0, 1.0) * 255.0)
    if array.ndim == 2 and array.shape[1] == 4:
        array = array[:, :3]
    return rows(what, array, 3, np.uint8)


def _corner_uv(
    uv: npt.ArrayLike, positions: npt.NDArray[np.float32], faces: npt.NDArray[np.uint32]
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]:
    """Texture coordinates, and the indices of those of each face."""
    array = np.ascontiguousarray(uv, np.float32)
    if array.shape == (len(positions), 2):
        return array, faces
    if array.shape == (len(faces), 3, 2):
        return array.reshape(-1, 2), np.arange(3 * len(faces), dtype=np.uint32).reshape(-1, 3)
    raise UsageError(
        f"uv: ({len(positions)}, 2) by vertex or ({len(faces)}, 3, 2) by corner, not {array.shape}"
    )
