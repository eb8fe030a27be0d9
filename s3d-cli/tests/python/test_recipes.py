"""Runs the lines of docs/recipes.md, in a folder as the recipes expect it: they must work as printed."""

import json
import os
import re
import shlex
import subprocess
import sys

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


def test_a_cloud_without_a_mesh(s3d, demo, tmp_path, monkeypatch):
    o3d = pytest.importorskip("open3d")
    np = pytest.importorskip("numpy")
    monkeypatch.chdir(tmp_path)
    s3d("sample", demo / "scan/rgb.obj", "-o", "whole.ply", "--points-per-m2", "2000")
    room = next(r for r in json.loads((demo / "area_1/3d/rooms.json").read_text()) if r["room"] == "office_1")
    outline = np.concatenate([np.array(p["outer"]) for p in room["outline"]])
    cloud = o3d.io.read_point_cloud("whole.ply")
    low, high = [*outline.min(0) - 0.05, -1], [*outline.max(0) + 0.05, 5]
    o3d.io.write_point_cloud("scan.ply", cloud.crop(o3d.geometry.AxisAlignedBoundingBox(low, high)))
    run(s3d, "A cloud without a mesh", tmp_path)
    told = s3d("info", "mesh.ply", "--up", "z").stdout
    assert "1 storey: " in told and "office" not in told, told
    assert os.path.getsize("mesh.ply") > 100_000
