"""Lists of cameras, read and written."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._camera import Matrix, matrix, pose_of
from ._errors import UsageError
from ._files import replaced
from ._progress import Sink


@dataclass(frozen=True, eq=False)
class CameraPose:
    """A camera of a list: what the list tells of it."""

    name: str
    """The picture's file, a time stamp, or any word."""
    T_world_cam: Matrix
    """Camera → world, 4 × 4, OpenCV's axes, metres."""
    K: Matrix | None = None
    """Intrinsics, 3 × 3, pixels; the centre of the first pixel is at (0.5, 0.5)."""
    size: tuple[int, int] | None = None
    """Width and height of the picture, pixels."""
    distortion: tuple[str, list[float]] | None = None
    """ "opencv" with k₁ k₂ p₁ p₂ k₃, or "fisheye" with k₁ k₂ k₃ k₄; None for a pinhole."""


def read_poses(path: str | PathLike[str], *, up: str = "z") -> list[CameraPose]:
    """Reads the cameras of `transforms.json`, a COLMAP model, a scan of ScanNet, 3RScan, Replica, Matterport3D,
    Polycam or ARKitScenes, a trajectory of TUM, or a table: what `s3d render --poses` takes. `up` is the axis of
    its frame that points up.

    Raises `FileError` with the place, or `UnsupportedError` for a file of another kind.
    """
    return [
        CameraPose(name, np.array(pose), None if k is None else np.array(k), _pair(size), lens)
        for name, pose, size, k, lens in _native.read_poses(Path(path), up, Sink())
    ]


def save_poses(path: str | PathLike[str], poses: Iterable[CameraPose]) -> None:
    """Writes cameras, whole or not at all. An existing file is replaced. The name tells the form: `.json` is
    nerfstudio's `transforms.json`, `.txt` a trajectory of TUM (names are time stamps, or numbers from 0), and a
    name without an ending the folder of a COLMAP model in text.

    Raises `UsageError` for cameras without what the form needs: sizes and intrinsics, except for `.txt`; and for a
    matrix that is no pose.
    """
    target, cameras = Path(path), [_checked(camera) for camera in poses]
    if not cameras:
        raise UsageError("poses: there are none")
    if target.suffix == ".txt":
        _write(target, "".join(_tum_line(place, camera) for place, camera in enumerate(cameras)))
    elif target.suffix == ".json":
        frames = [_frame(camera) for camera in cameras]
        _write(target, json.dumps({"camera_model": "OPENCV", "frames": frames}, indent=1) + "\n")
    elif not target.suffix:
        target.mkdir(parents=True, exist_ok=True)
        lists = [_colmap(number, camera) for number, camera in enumerate(cameras, 1)]
        _write(target / "cameras.txt", "".join(camera for camera, _ in lists))
        _write(target / "images.txt", "".join(image for _, image in lists))
        _write(target / "points3D.txt", "")
    else:
        raise UsageError(f"{target}: poses are written as .json, .txt or a folder without an ending")


def _pair(size: Sequence[int] | None) -> tuple[int, int] | None:
    return None if size is None else (size[0], size[1])


def _checked(camera: CameraPose) -> CameraPose:
    """Returns a camera with arrays, if its matrix turns and moves, and does nothing else."""
    if not isinstance(camera, CameraPose):
        raise UsageError(f"poses: some CameraPose, with names, and not {type(camera).__name__}")
    T = pose_of(camera.T_world_cam)
    turn = T[:3, :3]
    is_turn = np.allclose(turn.T @ turn, np.eye(3), atol=1e-3) and np.linalg.det(turn) > 0
    if not np.isfinite(T).all() or not is_turn or not np.allclose(T[3], [0, 0, 0, 1]):
        raise UsageError(f"{camera.name}: T_world_cam must turn and move, and neither scale, mirror nor shear: {T.tolist()}")
    K = None if camera.K is None else matrix("K", camera.K, (3, 3))
    return CameraPose(camera.name, T, K, camera.size, camera.distortion)


def _tum_line(place: int, camera: CameraPose) -> str:
    try:
        stamp = repr(float(camera.name))
    except ValueError:
        stamp = str(place)
    x, y, z, w = quaternion(camera.T_world_cam[:3, :3])
    numbers = [*camera.T_world_cam[:3, 3].tolist(), x, y, z, w]
    return " ".join([stamp, *map(repr, numbers)]) + "\n"


def _frame(camera: CameraPose) -> dict[str, Any]:
    k, (width, height), lens = _optics(camera)
    # OpenGL's axes: y up, z backwards.
    pose = camera.T_world_cam * [1.0, -1.0, -1.0, 1.0]
    frame = {"file_path": camera.name, "w": width, "h": height, "transform_matrix": pose.tolist()}
    frame.update({"fl_x": k[0, 0], "fl_y": k[1, 1], "cx": k[0, 2], "cy": k[1, 2]})
    frame.update(zip(("k1", "k2", "p1", "p2", "k3"), lens))
    return frame


def _colmap(number: int, camera: CameraPose) -> tuple[str, str]:
    """Returns the lines of a camera and of its image in COLMAP's lists."""
    k, (width, height), lens = _optics(camera)
    if len(lens) == 5 and lens[4]:
        raise UsageError(f"{camera.name}: COLMAP's OPENCV has no k3")
    numbers = [k[0, 0], k[1, 1], k[0, 2], k[1, 2], *lens[:4]]
    model = "OPENCV" if lens else "PINHOLE"
    to_camera = np.linalg.inv(camera.T_world_cam)
    x, y, z, w = quaternion(to_camera[:3, :3])
    pose = [w, x, y, z, *to_camera[:3, 3].tolist()]
    words = " ".join(map(repr, map(float, numbers)))
    return (
        f"{number} {model} {width} {height} {words}\n",
        f"{number} {' '.join(map(repr, map(float, pose)))} {number} {camera.name}\n\n",
    )


def _optics(camera: CameraPose) -> tuple[Matrix, tuple[int, int], list[float]]:
    if camera.K is None or camera.size is None:
        raise UsageError(f"{camera.name}: its intrinsics and its size are needed, or write a .txt")
    kind, numbers = camera.distortion or ("opencv", [])
    if kind != "opencv":
        raise UsageError(f"{camera.name}: a {kind} lens is not written")
    return camera.K, camera.size, numbers


def quaternion(rotation: npt.NDArray[Any]) -> tuple[float, float, float, float]:
    """Returns x, y, z, w of a rotation matrix, w ≥ 0. Source: the largest of four squares."""
    r = np.asarray(rotation, np.float64)
    diagonal = np.diagonal(r)
    squares = np.append(2 * diagonal - diagonal.sum(), diagonal.sum())
    largest = int(np.argmax(squares))
    sums = np.array(
        [
            [1 + squares[0], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2], r[2, 1] - r[1, 2]],
            [r[1, 0] + r[0, 1], 1 + squares[1], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
            [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], 1 + squares[2], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1 + squares[3]],
        ]
    )[largest]
    x, y, z, w = (sums / np.linalg.norm(sums) * (1.0 if sums[3] >= 0 else -1.0)).tolist()
    return x, y, z, w


def _write(path: Path, text: str) -> None:
    with replaced(path) as file:
        file.write(text.encode())
