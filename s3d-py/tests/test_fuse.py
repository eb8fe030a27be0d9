"""A raw scan to a mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import s3d_py as s3d


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    """What a scanner in the middle of a room of 4 × 3 × 2.5 m measures, as text."""
    azimuth, polar = np.meshgrid(np.arange(360) * np.pi / 180, np.arange(1, 180) * np.pi / 180)
    ray = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
    ranges = (np.array([2.0, 1.5, 1.25]) / np.maximum(np.abs(ray), 1e-9)).min(-1, keepdims=True)
    path = tmp_path / "room.xyz"
    np.savetxt(path, (ray * ranges).reshape(-1, 3), fmt="%.5f")
    return path


def test_a_scan_becomes_a_mesh(scan: Path, tmp_path: Path) -> None:
    made = s3d.fuse(scan, tmp_path / "room.ply", cell_m=0.03, origin_m=(0, 0, 0))
    mesh = s3d.read_mesh(tmp_path / "room.ply", up="z")
    assert made.images == 1 and made.faces == len(mesh.faces) <= made.fused_faces
    # Cells of 3 cm round the corners off.
    points = s3d.sample(mesh, points=10_000).xyz
    off = np.abs((np.abs(points) - [2.0, 1.5, 1.25]).max(axis=1))
    assert np.quantile(off, 0.9) < 0.005 and off.max() < 0.06
    assert made.max_error_m <= 0.003


def test_bad_calls_are_told(scan: Path, tmp_path: Path) -> None:
    few = tmp_path / "few.xyz"
    few.write_text("2 0 1\n0 3 1\n0 3 2\n")
    with pytest.raises(s3d.Error, match="where the scanner stood"):
        s3d.fuse([few], tmp_path / "room.ply")
    with pytest.raises(s3d.UsageError):
        s3d.fuse(scan, tmp_path / "room.obj", origin_m=(0, 0, 0))
    with pytest.raises(s3d.UsageError):
        s3d.fuse(scan, tmp_path / "room.ply", origin_m=(0, 0, 0), up="x")
