"""Meshes from files, arrays, and the objects of other packages."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from . import _native
from ._checks import colors_of, image_of, indices, rows, whole
from ._errors import UsageError
from ._native import Mesh as NativeMesh
from ._packages import package
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
    # How it was made, for copies in other processes.
    _made: tuple[Callable[..., Mesh], tuple[Any, ...]] | None = None

    def __init__(
        self,
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        *,
        vertex_colors: npt.ArrayLike | None = None,
        face_colors: npt.ArrayLike | None = None,
        uv: npt.ArrayLike | None = None,
        texture: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None,
        texture_of_face: npt.ArrayLike | None = None,
        vertex_normals: npt.ArrayLike | None = None,
        source_faces: npt.ArrayLike | None = None,
    ) -> None:
        """Makes a mesh from arrays, which are copied.

        - `vertices`: (V, 3), world metres, Z up; stored in 32 bits.
        - `faces`: (F, 3), indices into `vertices`, counter-clockwise seen from the front.
        - `vertex_colors`: (V, 3) or (V, 4), sRGB, whole numbers from 0 to 255 or floats from 0 to 1.
        - `face_colors`: (F, 3) or (F, 4), likewise, instead of `vertex_colors`; for faces without a texture.
        - `uv`: texture coordinates, (V, 2) for vertices or (F, 3, 2) for corners; (0, 0) is the bottom left
          of the image.
        - `texture`: the image, (H, W, 3) or (H, W, 4) of numbers like colours, or a list of images.
        - `texture_of_face`: (F,), the index of each face's image in a list, −1 for none.
        - `vertex_normals`: (V, 3), unit vectors, for smooth normals.
        - `source_faces`: (F,), the numbers that `Mesh.source_faces` has; 0 to F − 1 if None.

        Faces that are left out are told in `Mesh.warnings`, and logged.

        Raises `MeshError` for an index out of range, a corner that is not finite, or a mesh without any face
        that has an area; `UsageError` for an array of another shape.
        """
        normals = None if vertex_normals is None else rows("vertex_normals", vertex_normals, 3, np.float32)
        positions = rows("vertices", vertices, 3, np.float32)
        if positions.size and np.abs(positions).max() > FAR_M:
            log.warning(
                "vertices lie up to %.0f m from the origin, where 32 bits step by a millimetre or more: "
                "subtract an offset before",
                np.abs(positions).max(),
            )
        corners = indices("faces", faces, 3)
        textures: list[Any] = (
            [] if texture is None else list(texture) if isinstance(texture, (list, tuple)) else [texture]
        )
        images = [image_of("texture", image) for image in textures]
        if vertex_colors is not None and face_colors is not None:
            raise UsageError("vertex_colors, face_colors: give one of them")
        sources = None if source_faces is None else whole("source_faces", source_faces, np.uint32)
        if sources is not None and sources.shape != (len(corners),):
            raise UsageError(f"source_faces: {len(corners)} numbers, not an array of shape {sources.shape}")
        uvs, face_uv = (None, None) if uv is None else _corner_uv(uv, positions, corners)
        self._native = NativeMesh.from_arrays(
            positions,
            corners,
            None if vertex_colors is None else colors_of(vertex_colors),
            None if face_colors is None else colors_of(face_colors, "face_colors"),
            uvs,
            face_uv,
            images,
            None
            if texture_of_face is None
            else whole("texture_of_face", texture_of_face, np.int32).view(np.uint32),
            normals,
            sources,
        )
        for text in self.warnings:
            log.warning("mesh in memory: %s", text)
        if normals is not None:
            given = (vertices, faces, vertex_colors, face_colors, uv, texture, texture_of_face, normals, source_faces)
            self._made = _of_arrays, given

    @classmethod
    def _of(cls, native: NativeMesh) -> Mesh:
        mesh = cls.__new__(cls)
        mesh._native = native
        return mesh

    def __reduce__(self) -> tuple[Any, ...]:
        """The mesh of a file is read again; others are copied."""
        if self._made is not None:
            return self._made
        uv = None
        if self.uv is not None and self.face_uv is not None:
            uv = self.uv[np.minimum(self.face_uv, len(self.uv) - 1)]
        textures = self.textures or None
        of_face = None if textures is None else self.texture_of_face
        face_colors = None if self.vertex_colors is not None else self.face_colors
        columns = (self.vertices, self.faces, self.vertex_colors, face_colors, uv, textures, of_face, None)
        return _of_arrays, (*columns, self.source_faces)

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
    def face_colors(self) -> npt.NDArray[np.uint8] | None:
        """(F, 3), sRGB: the colours of faces without a texture, if the mesh has no `vertex_colors`. None without
        materials.
        """
        return self._native.material_colors

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
        """(F,), the number of each face in its file or its arrays, from 0: faces without an area and repeated ones
        are left out, and polygons of a file are cut. So `labels[mesh.source_faces]` are labels of `faces`. Meshes made
        by `cropped`, `with_faces` and `transformed` keep the numbers; `merged` counts on.
        """
        return self._native.source_faces

    @property
    def area(self) -> float:
        """The area of all faces, m²."""
        return self._native.area

    @property
    def is_watertight(self) -> bool:
        """Whether the surface ends nowhere, so that it encloses a volume: at each edge an even number of faces
        meets. Computed at every access.
        """
        return self._native.open_edges() == 0

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
        """Repairs, omissions and replacements made when the mesh was read or made, a sentence each."""
        return self._native.warnings

    @property
    def path(self) -> Path | None:
        """The path of the file; None for a mesh from arrays."""
        return self._native.path

    def transformed(self, matrix: npt.ArrayLike) -> Mesh:
        """Returns the mesh after an affine transform (4, 4) of its positions. A mirror turns its faces over."""
        return Mesh._of(_native.transformed(self._native, rows("matrix", matrix, 4, np.float64).tolist()))

    def cropped(self, bounds: npt.ArrayLike) -> Mesh:
        """Returns the faces whose centres lie in a box (2, 3): the smallest and the largest coordinates, metres.
        Raises `MeshError` if there are none.
        """
        low, high = rows("bounds", bounds, 3, np.float64)
        centers = self.vertices[self.faces].mean(axis=1)
        return self.with_faces(((centers >= low) & (centers <= high)).all(axis=1))

    def with_faces(self, faces: npt.ArrayLike) -> Mesh:
        """Returns some of the faces, given by their indices or by a mask (F,), with the vertices that they use."""
        given = np.asarray(faces)
        if given.dtype == bool and given.shape != (len(self.faces),):
            raise UsageError(f"faces: a mask of shape ({len(self.faces)},), not {given.shape}")
        chosen = np.flatnonzero(given) if given.dtype == bool else np.unique(whole("faces", given, np.uint32))
        return Mesh._of(_native.with_faces(self._native, chosen.tolist()))

    @staticmethod
    def merged(meshes: Sequence[Mesh]) -> Mesh:
        """Returns the faces of all meshes, in their order."""
        return Mesh._of(_native.merged([mesh._native for mesh in meshes]))

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the mesh, completely or not at all: `.glb` with its textures, Y up as the format has it; or
        `.ply` with the colours of its vertices, Z up. An existing file is replaced.
        """
        if Path(path).suffix.lower() not in (".glb", ".ply"):
            raise UsageError(f"{fspath(path)}: meshes are written as .glb or .ply")
        _native.save_mesh(self._native, Path(path))

    def _pictures(self) -> tuple[list[npt.NDArray[np.uint8]], npt.NDArray[np.int32]]:
        """Returns the textures, then one of a pixel for each colour of the other faces; and the one of each face."""
        pictures, of_face = list(self.textures), self.texture_of_face.copy()
        bare = of_face < 0
        if bare.any():
            colors = self.face_colors
            if self.vertex_colors is not None:
                colors = self.vertex_colors[self.faces].mean(axis=1).astype(np.uint8)
            assert colors is not None
            found, places = np.unique(colors[bare], axis=0, return_inverse=True)
            of_face[bare] = len(pictures) + places.reshape(-1)
            pictures.extend(color.reshape(1, 1, 3) for color in found)
        return pictures, of_face

    def to_trimesh(self) -> Any:
        """Returns a `trimesh.Trimesh`, Z up: with the mesh's textures, with the colours of its vertices, or with
        those of its faces. Corners with textures have vertices of their own.
        """
        trimesh = package("trimesh", "trimesh")
        if not self.textures or self.uv is None or self.face_uv is None:
            colors: dict[str, Any] = {"vertex_colors": self.vertex_colors}
            if self.vertex_colors is None:
                colors = {"face_colors": self.face_colors}
            return trimesh.Trimesh(self.vertices, self.faces.astype(np.int64), process=False, **colors)
        texture, image = trimesh.visual.texture, package("PIL.Image", "pillow")
        pictures, of_face = self._pictures()
        materials = [texture.SimpleMaterial(image=image.fromarray(pixels)) for pixels in pictures]
        material: Any = materials[0]
        several: dict[str, Any] = {}
        if len(materials) > 1:
            material = trimesh.visual.material.MultiMaterial(materials)
            several = {"face_materials": of_face}
        uv = self.uv[np.minimum(self.face_uv, len(self.uv) - 1)].reshape(-1, 2)
        return trimesh.Trimesh(
            self.vertices[self.faces].reshape(-1, 3),
            np.arange(3 * len(self.faces)).reshape(-1, 3),
            visual=trimesh.visual.TextureVisuals(uv=uv, material=material, **several),
            process=False,
        )

    def to_open3d(self) -> Any:
        """Returns an `open3d.geometry.TriangleMesh`, Z up, with the mesh's textures or the colours of its vertices.
        """
        o3d = package("open3d", "open3d")
        vector = o3d.utility
        made = o3d.geometry.TriangleMesh(
            vector.Vector3dVector(self.vertices.astype(np.float64)),
            vector.Vector3iVector(self.faces.astype(np.int32)),
        )
        if self.vertex_colors is not None:
            made.vertex_colors = vector.Vector3dVector(self.vertex_colors / 255.0)
        if self.textures and self.uv is not None and self.face_uv is not None:
            uv = self.uv[np.minimum(self.face_uv, len(self.uv) - 1)].reshape(-1, 2)
            made.triangle_uvs = vector.Vector2dVector(uv.astype(np.float64))
            pictures, of_face = self._pictures()
            # Bottom row first.
            made.textures = [o3d.geometry.Image(np.ascontiguousarray(pixels[::-1])) for pixels in pictures]
            made.triangle_material_ids = vector.IntVector(of_face.astype(np.int32))
        return made

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
    path: str | PathLike[str], *, up: str | None = None, units: str | None = None, near: bool = True
) -> Mesh:
    """Reads a mesh with its textures. The ending of the path tells OBJ, glTF, GLB or PLY.

    - `up`: the axis of the file that points up, "y" or "z". None: "y" in glTF, as it defines, and in other
      formats the axis that most of the surface is level with. The log tells it. An axis that clearly
      contradicts the surface is a warning.
    - `units`: "m", "cm", "mm", "ft" or "in". None: metres in glTF; in other formats the unit that the file
      states, or else the one that gives rooms a usual height.
    - `near`: moves a mesh more than 1,024 m from the origin to it. `Mesh.offset` is the subtracted vector.

    Repairs are listed in `Mesh.warnings` and logged.

    Raises `MissingFileError`, `FormatError` with file and line, `MeshError` if no face is left, or
    `UnsupportedError`.
    """
    mesh = Mesh._of(NativeMesh.read(fspath(path), up, units, near, Sink()))
    mesh._made = _read_again, (fspath(path), up, units, near)
    return mesh


def _read_again(path: str, up: str | None, units: str | None, near: bool) -> Mesh:
    return read_mesh(path, up=up, units=units, near=near)


def _of_arrays(
    vertices: Any,
    faces: Any,
    vertex_colors: Any,
    face_colors: Any,
    uv: Any,
    texture: Any,
    of_face: Any,
    normals: Any,
    source_faces: Any,
) -> Mesh:
    colors = {"vertex_colors": vertex_colors, "face_colors": face_colors}
    looks = {"uv": uv, "texture": texture, "texture_of_face": of_face, "vertex_normals": normals}
    return Mesh(vertices, faces, **colors, **looks, source_faces=source_faces)


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
    elif kind == "face":
        columns["face_colors"] = visual.face_colors
    elif kind == "texture":
        # One material, or several with the material of each face.
        several = getattr(visual.material, "materials", None)
        materials = [visual.material] if several is None else list(several)
        of_face = np.zeros(len(mesh.faces), np.int64) if several is None else visual.face_materials
        colors = np.array([_color_of(material) for material in materials])
        images = [_image_of(material, color) for material, color in zip(materials, colors)]
        columns["face_colors"] = colors[of_face]
        if visual.uv is not None and any(image is not None for image in images):
            places = np.cumsum([image is not None for image in images]) - 1
            places[[image is None for image in images]] = -1
            columns["uv"], columns["texture_of_face"] = visual.uv, places[of_face]
            columns["texture"] = [image for image in images if image is not None]
    return columns


def _color_of(material: Any) -> npt.NDArray[np.uint8]:
    """Returns the colour of a material of trimesh: white if it does not say one."""
    color = getattr(material, "baseColorFactor", None)
    if color is None:
        color = getattr(material, "diffuse", None)
    return np.full(3, 255, np.uint8) if color is None else colors_of([color], "the colour of a material")[0]


def _image_of(material: Any, color: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8] | None:
    """Returns the image of a material of trimesh, if it has one. The colour of PBR materials dyes it."""
    image = getattr(material, "baseColorTexture", None)
    is_dyed = image is not None and (color < 255).any()
    if image is None:
        image = getattr(material, "image", None)
    if image is None:
        return None
    pixels = np.asarray(image.convert("RGB"))
    return np.rint(pixels * (color / 255.0)).astype(np.uint8) if is_dyed else pixels


def _of_open3d(mesh: Any) -> dict[str, Any]:
    columns: dict[str, Any] = {"faces": np.asarray(mesh.triangles)}
    if mesh.has_vertex_colors():
        columns["vertex_colors"] = np.asarray(mesh.vertex_colors)
    # One image for each material, empty if the material has none; bottom row first.
    images = {k: np.asarray(image)[::-1] for k, image in enumerate(mesh.textures) if not image.is_empty()}
    if images and mesh.has_triangle_uvs():
        place = {k: number for number, k in enumerate(images)}
        columns["uv"] = np.asarray(mesh.triangle_uvs).reshape(-1, 3, 2)
        columns["texture"] = [_in_colors(image) for image in images.values()]
        columns["texture_of_face"] = [place.get(k, -1) for k in np.asarray(mesh.triangle_material_ids)]
    return columns


def _in_colors(image: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """An image with colours; of gray levels, the same level thrice."""
    channels = image.reshape(*image.shape[:2], -1)
    return channels if channels.shape[2] >= 3 else np.repeat(channels[:, :, :1], 3, axis=2)


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
