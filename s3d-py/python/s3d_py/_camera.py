"""Cameras: intrinsics, poses, scan locations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Union

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import UsageError

Matrix = npt.NDArray[np.float64]
Vector = Union[Sequence[float], npt.NDArray[Any]]


def matrix(what: str, values: npt.ArrayLike, shape: tuple[int, int]) -> Matrix:
    """Returns the values as a matrix of this shape."""
    try:
        array = np.asarray(values, np.float64)
    except (TypeError, ValueError) as error:
        raise UsageError(f"{what}: {error}") from None
    if array.shape != shape:
        raise UsageError(f"{what}: a matrix {shape[0]} × {shape[1]}, not an array of shape {array.shape}")
    return array


def intrinsics(size: tuple[int, int], fov: float) -> Matrix:
    """Returns the matrix K, 3 × 3, of a pinhole camera with square pixels and its optical axis in the middle.

    `size` is (width, height) in pixels. `fov` is the horizontal angle of view in degrees, between 0 and 180.
    """
    if not 0 < fov < 180:
        raise UsageError(f"fov={fov}: must be degrees between 0 and 180")
    width, height = size
    f = 0.5 * width / math.tan(math.radians(0.5 * fov))
    return np.array([[f, 0.0, 0.5 * width], [0.0, f, 0.5 * height], [0.0, 0.0, 1.0]])


def look_at(eye: Vector, target: Vector, up: Vector = (0.0, 0.0, 1.0)) -> Matrix:
    """Returns `T_world_cam`, 4 × 4, of a camera at `eye` that looks at `target`, in world metres. `up` points
    to the top of the image.

    Raises `UsageError` if the two points are the same, or `up` lies along the view.
    """
    return np.array(_native.look_at(list(eye), list(target), list(up)))


def level(eye: Vector) -> Matrix:
    """Returns `T_world_cam`, 4 × 4, of a level camera at `eye`, in world metres, that looks along +Y."""
    x, y, z = eye
    return np.array([[1.0, 0, 0, x], [0, 0, 1, y], [0, -1, 0, z], [0, 0, 0, 1]])


@dataclass(frozen=True, eq=False)
class Location:
    """A scan location: the position of a tripod, from which views and a panorama are taken."""

    uuid: str
    """Its name, 32 hexadecimal digits."""
    T_world_cam: Matrix
    """Camera → world, 4 × 4, OpenCV's axes. Placed locations are level and look along +Y."""

    @property
    def xyz(self) -> Matrix:
        """The position, (3,), in world metres."""
        return self.T_world_cam[:3, 3]

    def __repr__(self) -> str:
        x, y, z = self.xyz
        return f"Location({self.uuid[:8]}… at {x:.2f}, {y:.2f}, {z:.2f})"


class Posed(Protocol):
    """Anything with a pose: a `Location`, a `Camera`, a `CameraPose`, an image of a data set."""

    @property
    def T_world_cam(self) -> Matrix: ...


PoseLike = Union[Posed, npt.ArrayLike]
"""`T_world_cam` as 4 × 4; anything that has it, such as a `Location`; or the position (3,) of a level camera that looks along +Y."""


def pose_of(pose: PoseLike) -> Matrix:
    """Returns `T_world_cam` of a pose in any of its forms."""
    values: Any = getattr(pose, "T_world_cam", pose)
    return level(values) if np.shape(values) == (3,) else matrix("T_world_cam", values, (4, 4))
