"""What rays hit, and what is nearest to points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ._errors import UsageError
from ._mesh import Mesh


@dataclass(frozen=True, eq=False, repr=False)
class Rays:
    """The first hits of rays, in the shape (…) of the rays."""

    t: npt.NDArray[np.float64]
    """(…), the position along the ray as a multiple of the direction; metres if the direction has length 1.
    NaN without a hit.
    """
    face: npt.NDArray[np.int32]
    """(…), index of the mesh's face. −1 without a hit."""
    origins: npt.NDArray[np.float64]
    directions: npt.NDArray[np.float64]
    mesh: Mesh

    @property
    def xyz(self) -> npt.NDArray[np.float64]:
        """(…, 3), world metres. NaN without a hit."""
        return self.origins + self.t[..., None] * self.directions

    @property
    def normal(self) -> npt.NDArray[np.float64]:
        """(…, 3), unit vectors in the world, towards the side that the ray comes from. NaN without a hit."""
        a, b, c = _corners(self.face, self.mesh)
        normal = np.cross(b - a, c - a)
        normal *= -np.sign((normal * self.directions).sum(-1, keepdims=True))
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        normal[self.face < 0] = np.nan
        return normal

    @property
    def barycentrics(self) -> npt.NDArray[np.float64]:
        """(…, 3), the weights of the three corners of the face, which add up to 1. NaN where there is no face."""
        return _barycentrics(self.xyz, self.face, self.mesh)

    @property
    def uv(self) -> npt.NDArray[np.float64]:
        """(…, 2), texture coordinates, (0, 0) at the image's bottom left. NaN where the face has none."""
        return _uv(self.xyz, self.face, self.mesh)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"Rays({self.t.size:,}, of which {int((self.face >= 0).sum()):,} hit)"


@dataclass(frozen=True, eq=False, repr=False)
class ClosestPoints:
    """The nearest places of a mesh to points, in the shape (…) of the points."""

    xyz: npt.NDArray[np.float32]
    """(…, 3), world metres. NaN for a point that is not finite."""
    distance: npt.NDArray[np.float32]
    """(…), metres. NaN for a point that is not finite."""
    face: npt.NDArray[np.int32]
    """(…), index of the mesh's face; the smallest of equally near ones. −1 for a point that is not finite."""
    mesh: Mesh

    @property
    def barycentrics(self) -> npt.NDArray[np.float64]:
        """(…, 3), the weights of the three corners of the face, which add up to 1. NaN where there is no face."""
        return _barycentrics(self.xyz, self.face, self.mesh)

    @property
    def uv(self) -> npt.NDArray[np.float64]:
        """(…, 2), texture coordinates, (0, 0) at the image's bottom left. NaN where the face has none."""
        return _uv(self.xyz, self.face, self.mesh)

    def __len__(self) -> int:
        return len(self.distance)

    def __repr__(self) -> str:
        return f"ClosestPoints({self.distance.size:,})"


def as_points(values: npt.ArrayLike, what: str = "points") -> tuple[tuple[int, ...], npt.NDArray[np.float64]]:
    """Returns the shape (…) of points (…, 3), at least one axis, and the points as rows."""
    array = _array(what, values, 3)
    return array.shape[:-1], np.ascontiguousarray(array.reshape(-1, 3))


def _array(what: str, values: npt.ArrayLike, columns: int) -> npt.NDArray[np.float64]:
    """Returns values as an array (…, columns) of two axes or more."""
    try:
        array = np.atleast_2d(np.asarray(values, np.float64))
    except (TypeError, ValueError) as error:
        raise UsageError(f"{what}: {error}") from None
    if array.shape[-1] != columns:
        raise UsageError(f"{what}: an array (…, {columns}), not of shape {np.shape(values)}")
    return array


def as_rays(
    origins: npt.ArrayLike, directions: npt.ArrayLike | None
) -> tuple[tuple[int, ...], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Returns the shape (…) of rays, their origins as rows, one for all or one each, and their directions."""
    if directions is None:
        both = _array("rays without directions", origins, 6)
        origins, directions = both[..., :3], both[..., 3:]
    shape, ways = as_points(directions, "directions")
    of_origins, starts = as_points(origins, "origins")
    if len(starts) != 1 and of_origins != shape:
        raise UsageError(f"origins of shape {of_origins} for directions of {shape}: one for all, or one for each")
    return shape, starts, ways


def _corners(face: npt.NDArray[np.int32], mesh: Mesh) -> npt.NDArray[np.float64]:
    """Returns the corners of faces, (3, …, 3), world metres."""
    return np.moveaxis(mesh.vertices[mesh.faces[face]].astype(np.float64), -2, 0)


def _barycentrics(
    xyz: npt.NDArray[np.floating], face: npt.NDArray[np.int32], mesh: Mesh
) -> npt.NDArray[np.float64]:
    """Returns the weights of the corners of faces at places on them."""
    a, b, c = _corners(face, mesh)
    normal = np.cross(b - a, c - a)
    area = (normal * normal).sum(-1)
    of_b = (np.cross(xyz - a, c - a) * normal).sum(-1) / area
    of_c = (np.cross(b - a, xyz - a) * normal).sum(-1) / area
    weights = np.stack([1 - of_b - of_c, of_b, of_c], -1)
    weights[face < 0] = np.nan
    return weights


def _uv(xyz: npt.NDArray[np.floating], face: npt.NDArray[np.int32], mesh: Mesh) -> npt.NDArray[np.float64]:
    """Returns the texture coordinates of places on faces."""
    if mesh.uv is None or mesh.face_uv is None:
        return np.full((*face.shape, 2), np.nan)
    corners = mesh.face_uv[face]
    has_uv = (corners < len(mesh.uv)).all(-1) & (face >= 0)
    of_corners = mesh.uv[np.where(has_uv[..., None], corners, 0)]
    found: npt.NDArray[np.float64] = (_barycentrics(xyz, face, mesh)[..., None] * of_corners).sum(-2)
    found[~has_uv] = np.nan
    return found
