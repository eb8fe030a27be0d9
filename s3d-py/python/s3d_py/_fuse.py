"""Fuses a raw scan to a mesh."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path

from . import _native
from ._progress import Progress, sink


@dataclass(frozen=True)
class Fused:
    """What was fused."""

    images: int
    """The number of depth pictures, or of laser scans."""
    fused_faces: int
    """The number of faces of the fused surface."""
    faces: int
    """The number of faces of the mesh."""
    closed: int
    """The number of holes that were closed."""
    max_error_m: float
    """The largest distance of the fused surface from the mesh, metres."""


def fuse(
    inputs: str | PathLike[str] | Iterable[str | PathLike[str]],
    output: str | PathLike[str],
    *,
    cell_m: float = 0.01,
    max_error_m: float = 0.003,
    faces: int | None = None,
    range_m: float | None = None,
    close_m: float | None = None,
    refine_poses: bool = False,
    every: int = 1,
    up: str | None = None,
    depth_unit_m: float | None = None,
    intrinsics: Iterable[float] = (),
    origin_m: Iterable[float] = (),
    trajectory: str | PathLike[str] | None = None,
    memory_gib: float = 4.0,
    overwrite: bool = False,
    threads: int | None = None,
    progress: Progress = None,
) -> Fused:
    """Fuses depth pictures with poses, or laser scans, to a mesh: `output` is a `.ply` (Z-up) or a `.glb`, or else
    a folder that gets the mesh and a `scene.toml` for `export`.

    Lengths are metres. The options are those of `s3d fuse`:

    - `cell_m`: the edge of a cell of the grid.
    - `max_error_m`: how far the simplified surface may lie from the fused one; 0 keeps all faces.
    - `faces`: stop simplifying at this number of faces.
    - `range_m`: leave out what is farther; 5 m for depth pictures and 60 m for laser scans if it is `None`.
    - `close_m`: close holes in floors and walls up to this width, along their plane.
    - `refine_poses`: move laser scans onto each other first.
    - `every`: take each Nth depth picture.
    - `up`: the axis of the scan's world that points up, "y" or "z".
    - `depth_unit_m`: how many metres a step of the numbers in depth pictures is.
    - `intrinsics`: fx, fy, cx, cy of the depth camera, in pixels.
    - `origin_m`: x, y, z of the scanner, for points whose file does not tell it.
    - `trajectory`: the path of a mobile scanner.
    - `memory_gib`: the memory that the grid may take.

    Raises `InputError` or a `FileError` for a raw scan that cannot be used.
    """
    one = isinstance(inputs, (str, PathLike))
    paths = [Path(inputs)] if one else [Path(path) for path in inputs]  # type: ignore[arg-type, union-attr]
    options = {
        "cell_m": cell_m,
        "max_error_m": max_error_m,
        "faces": faces,
        "range_m": range_m,
        "close_m": close_m,
        "refine_poses": refine_poses,
        "every": every,
        "up": up,
        "depth_unit_m": depth_unit_m,
        "intrinsics": list(intrinsics),
        "origin_m": list(origin_m),
        "trajectory": None if trajectory is None else fspath(trajectory),
        "memory_gib": memory_gib,
    }
    counts, error_m = _native.fuse(
        paths, Path(output), json.dumps(options), overwrite, threads, sink(progress)
    )
    images, fused_faces, after, closed = counts
    return Fused(images, fused_faces, after, closed, error_m)
