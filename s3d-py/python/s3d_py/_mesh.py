"""Meshes from files, arrays, and the objects of other packages."""

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
"""Beyond this distance from the origin, in metres, 32-bit positions have steps of a millimetre."""


class Mesh:
    """A triangle mesh in world metres, Z up. It never changes; scenes and threads share it without copies.

    Every face has an area, every index is in range, every number finite. Faces without area, and faces with
    the corners of an earlier face, are left out when the mesh is made. `face` images, votes and all other
    columns refer to the remaining faces.
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
        """Makes a mesh from arrays, which are copied.

        - `vertices`: (V, 3), world metres, Z up; stored in 32 bits.
        - `faces`: (F, 3), indices into `vertices`, counter-clockwise seen from the front.
        - `vertex_colors`: (V, 3) or (V, 4), sRGB, uint8, or floats from 0 to 1.
        - `uv`: texture coordinates, (V, 2) for vertices or (F, 3, 2) for corners; (0, 0) is the bottom left
          of the image.
        - `texture`: the image, (H, W, 3) of uint8, or a list of images.
        - `texture_of_face`: (F,), the index of each face's image in a list, −1 for none.
        - `vertex_normals`: (V, 3), unit vectors, for smooth normals.

        Raises `MeshError` for an index out of range, a corner that is not finite, or a mesh without any face
        that has an area; `UsageError` for an array of another shape.
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
        """(V, 3), world metres. This and the other arrays are read-only, and share the memory of the mesh
        where possible.
        """
        return self._native.vertices

    @property
    def faces(self) -> npt.NDArray[np.uint32]:
        """(F, 3), indices into `vertices`."""
        return self._native.faces

    @property
    def vertex_colors(self) -> npt.NDArray[np.uint8] | None:
        """(V, 3), sRGB; None without colours."""
        return self._native.vertex_colors

    @property
    def uv(self) -> npt.NDArray[np.float32] | None:
        """(N, 2), texture coordinates, (0, 0) at the image's bottom left; None without texture coordinates.
        """
        return self._native.uv

    @property
    def face_uv(self) -> npt.NDArray[np.uint32] | None:
        """(F, 3), indices into `uv`, 2³² − 1 for a face without; None without texture coordinates."""
        return self._native.face_uv

    @property
    def textures(self) -> list[npt.NDArray[np.uint8]]:
        """The images, (H, W, 3) each, top row first."""
        return [image for _, image in self._native.textures]

    @property
    def texture_of_face(self) -> npt.NDArray[np.int32]:
        """(F,), index into `textures`, −1 for none."""
        return self._native.texture_of_face.view(np.int32)

    @property
    def face_normals(self) -> npt.NDArray[np.float32]:
        """(F, 3), unit vectors in the world, by the winding of the faces. Computed at every access."""
        return self._native.face_normals()

    @property
    def face_areas(self) -> npt.NDArray[np.float64]:
        """(F,), m². Computed at every access."""
        return self._native.face_areas()

    @property
    def source_faces(self) -> npt.NDArray[np.uint32]:
        """(F,), the number of each face in its file, from 0: faces are left out, and polygons cut, when a file is
        read. So `labels[mesh.source_faces]` are labels of `faces`. (0,) for a mesh from arrays.
        """
        return self._native.source_faces

    @property
    def area(self) -> float:
        """The area of all faces, m²."""
        return self._native.area

    @property
    def bounds(self) -> npt.NDArray[np.float32]:
        """(2, 3): the smallest and the largest coordinates, metres."""
        return np.array(self._native.bounds, np.float32)

    @property
    def offset(self) -> npt.NDArray[np.float64]:
        """(3,), metres: the offset that was subtracted from the positions of a file far from its origin.
        Subtract it from cameras and points as well, so that they are in the same frame.
        """
        return np.array(self._native.offset)

    @property
    def has_labels(self) -> bool:
        """Whether the file has labels for faces or vertices."""
        return self._native.has_labels

    @property
    def warnings(self) -> list[str]:
        """Repairs, omissions and replacements made when the file was read, a sentence each."""
        return self._native.warnings

    @property
    def path(self) -> Path | None:
        """The path of the file; None for a mesh from arrays."""
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
"""A `Mesh`, the path of a file, or a mesh of trimesh or Open3D."""


def read_mesh(
    path: str | PathLike[str], *, up: str = "y", units: str | None = None, near: bool = True
) -> Mesh:
    """Reads a mesh with its textures. The ending of the path tells OBJ, glTF, GLB or PLY.

    - `up`: the axis of the file that points up, "y" or "z".
    - `units`: "m", "cm", "mm", "ft" or "in"; by default the unit that the file states, otherwise metres.
    - `near`: moves a mesh more than 1,024 m from the origin to it. `Mesh.offset` is the subtracted vector.

    Repairs are listed in `Mesh.warnings` and logged.

    Raises `MissingFileError`, `FormatError` with file and line, `MeshError` if no face is left, or
    `UnsupportedError`.
    """
    return Mesh._of(NativeMesh.read(fspath(path), up, units, near, Sink()))


def as_mesh(mesh: MeshLike, *, up: str = "z") -> Mesh:
    """Returns a `Mesh` for any `MeshLike`. The positions, faces, colours and textures of a mesh of trimesh or
    Open3D are copied, and count as metres. `up` is the axis that points up in such a mesh: both packages keep
    the "y" of a glTF file. A path is read by `read_mesh` with its defaults.
    """
    if isinstance(mesh, Mesh):
        return mesh
    if isinstance(mesh, (str, PathLike)):
        return read_mesh(mesh)
    if up not in ("y", "z"):
        raise UsageError(f"up={up!r}: must be y or z")
    # A scene of trimesh, or a tensor mesh of Open3D.
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
    # One image for each material, empty if the material has none; bottom row first.
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
    """Returns the values as an array (n, columns) of this type, in C order."""
    try:
        array = np.ascontiguousarray(values, kind)
    except (TypeError, ValueError) as error:
        raise UsageError(f"{what}: {error}") from None
    if array.ndim != 2 or array.shape[1] != columns:
        raise UsageError(f"{what}: an array (n, {columns}), not of shape {array.shape}")
    return array


def indices(what: str, values: npt.ArrayLike, columns: int) -> npt.NDArray[np.uint32]:
    """Returns the values as indices."""
    array = np.asarray(values)
    if array.dtype.kind not in "iu" and array.size:
        raise UsageError(f"{what}: whole numbers, not {array.dtype}")
    if array.size and (array.min() < 0 or array.max() >= 2**32):
        raise UsageError(f"{what}: indices from 0, not {array.min()} to {array.max()}")
    return rows(what, array, columns, np.uint32)


def colors_of(values: npt.ArrayLike, what: str = "vertex_colors") -> npt.NDArray[np.uint8]:
    """Returns colours, given as uint8 or as floats from 0 to 1, without their opacity."""
    array = np.asarray(values)
    if array.dtype.kind == "f":
        array = np.rint(np.clip(array, 0.0, 1.0) * 255.0)
    if array.ndim == 2 and array.shape[1] == 4:
        array = array[:, :3]
    return rows(what, array, 3, np.uint8)


def _corner_uv(
    uv: npt.ArrayLike, positions: npt.NDArray[np.float32], faces: npt.NDArray[np.uint32]
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]:
    """Returns texture coordinates, and the indices into them for the corners of each face."""
    array = np.ascontiguousarray(uv, np.float32)
    if array.shape == (len(positions), 2):
        return array, faces
    if array.shape == (len(faces), 3, 2):
        return array.reshape(-1, 2), np.arange(3 * len(faces), dtype=np.uint32).reshape(-1, 3)
    raise UsageError(
        f"uv: ({len(positions)}, 2) by vertex or ({len(faces)}, 3, 2) by corner, not {array.shape}"
    )
