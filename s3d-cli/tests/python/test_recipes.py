"""Runs the lines of docs/recipes.md, in a folder as the recipes expect it: they must work as printed."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT


def blocks(heading):
    """Returns the code below a heading of the recipes, as (language, text)."""
    text = (ROOT / "docs" / "recipes.md").read_text()
    part = re.split(rf"^#+ {re.escape(heading)}\n", text, flags=re.MULTILINE)[1]
    part = re.split(r"^#{2,3} ", part, flags=re.MULTILINE)[0]
    return re.findall(r"^```(\w+)\n(.*?)^```", part, flags=re.MULTILINE | re.DOTALL)


def run(s3d, heading, folder):
    """Runs the shell and Python of a recipe, and returns what Python printed."""
    printed = ""
    for language, text in blocks(heading):
        if language == "sh":
            for line in text.splitlines():
                words = shlex.split(line, comments=True)
                if words[:1] == ["s3d"]:
                    s3d(*words[1:])
        if language == "python":
            done = subprocess.run([sys.executable, "-c", text], cwd=folder, capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
            printed += done.stdout
    return printed


@pytest.fixture
def beside(demo, tmp_path, monkeypatch):
    """The folder that recipes expect: the data set is `dataset` in it."""
    (tmp_path / "dataset").symlink_to(demo)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_webdataset(s3d, beside):
    pytest.importorskip("webdataset")
    rows = run(s3d, "WebDataset and PyTorch", beside).splitlines()
    assert len(rows) == len(list((beside / "dataset/area_1/data/rgb").iterdir())) and "(96, 96, 3)" in rows[0]


def test_tables(s3d, beside):
    pytest.importorskip("duckdb")
    pytest.importorskip("pyarrow")
    assert "office_1" in run(s3d, "pandas and DuckDB", beside)


def test_hugging_face(s3d, beside, monkeypatch):
    pytest.importorskip("datasets")
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    monkeypatch.setenv("HF_HOME", str(beside / "cache"))
    assert "office_1 (96, 96) [[" in run(s3d, "Hugging Face", beside)


def test_numpy_alone(s3d, beside):
    pytest.importorskip("OpenEXR")
    run(s3d, "numpy alone", beside)


@pytest.mark.parametrize("heading", ["nerfstudio", "COLMAP and Gaussian splatting", "COCO panoptic"])
def test_packages(s3d, beside, heading):
    made = {
        "nerfstudio": "dataset_nerfstudio/area_1/transforms.json",
        "COLMAP and Gaussian splatting": "dataset_colmap/area_1/sparse/0",
        "COCO panoptic": "coco_train/panoptic.json",
    }[heading]
    # Of the areas in the recipe, only one exists.
    for _, text in blocks(heading):
        for line in (line for line in text.splitlines() if line.startswith("s3d ")):
            words = shlex.split(line.replace("1,2,3,4,6", "1"), comments=True)
            if "5" not in words:
                s3d(*words[1:])
    assert (beside / made).exists()


def test_a_laser_scan_without_a_mesh(s3d, demo, tmp_path, monkeypatch):
    np = pytest.importorskip("numpy")
    o3d = pytest.importorskip("open3d")
    pye57 = pytest.importorskip("pye57")
    monkeypatch.chdir(tmp_path)
    pose = next((demo / "area_1/pano/pose").glob("camera_*_office_1_frame_*.json"))
    standing = np.array(json.loads(pose.read_text())["camera_location"])

    # A scanner turns once around: a pixel for each half degree, up to 60 degrees below the horizon.
    column, row = np.meshgrid(np.arange(720), np.arange(300))
    azimuth, elevation = np.deg2rad(column * 0.5).ravel(), np.deg2rad(90 - row * 0.5).ravel()
    across = np.cos(elevation)
    rays = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)], axis=1)
    building = o3d.t.geometry.RaycastingScene()
    # The file has +Y up.
    mesh = o3d.io.read_triangle_mesh(str(demo / "scan/rgb.obj"))
    mesh.rotate([[1, 0, 0], [0, 0, -1], [0, 1, 0]], center=[0, 0, 0])
    building.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    wanted = np.concatenate([np.broadcast_to(standing, rays.shape), rays], axis=1).astype(np.float32)
    distance = building.cast_rays(o3d.core.Tensor(wanted))["t_hit"].numpy()

    met = np.isfinite(distance)
    points = rays[met] * distance[met, None]
    scan = {f"cartesian{axis}": points[:, k] for k, axis in enumerate("XYZ")}
    scan |= {"rowIndex": row.ravel()[met], "columnIndex": column.ravel()[met]}
    scan |= {f"color{name}": np.full(met.sum(), 128, np.uint8) for name in ["Red", "Green", "Blue"]}
    with pye57.E57("scan.e57", mode="w") as file:
        file.write_scan_raw(scan, name="office", translation=standing)

    small = ["--views", "2", "--size", "64", "--pano-width", "128", "--points-per-m2", "50"]
    run(lambda *words: s3d(*words, *(small if words[0] == "export" else [])), "A laser scan without a mesh", tmp_path)
    told = s3d("info", "scan/scene.toml").stdout
    assert "1 storey: " in told and "office" not in told, told

    fused = o3d.io.read_triangle_mesh("scan/mesh.ply")
    corners = o3d.core.Tensor(np.asarray(fused.vertices, dtype=np.float32))
    off = building.compute_distance(corners).numpy()
    assert np.quantile(off, 0.95) < 0.03, np.quantile(off, [0.5, 0.95, 1])
    [pose] = Path("dataset/area_1/pano/pose").iterdir()
    assert np.allclose(json.loads(pose.read_text())["camera_location"], standing, atol=1e-3)
