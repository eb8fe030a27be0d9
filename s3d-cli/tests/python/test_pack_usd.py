"""Scenes of OpenUSD, read by usd-core and compared with the meshes and poses of the data set."""

import json

import numpy as np
import pytest
from test_scene_graph import UNLABELLED, labelled_faces

Usd = pytest.importorskip("pxr.Usd")
from pxr import UsdGeom, UsdSemantics, UsdShade  # noqa: E402


@pytest.fixture(scope="module")
def made(s3d, demo, tmp_path_factory):
    out = tmp_path_factory.mktemp("usd") / "dataset"
    small = ["--views", "3", "--size", "64", "--pano-width", "128", "--points-per-m2", "100"]
    s3d("export", demo / "scan/scene.toml", "-o", out, *small)
    s3d("pack", out, "--to", "usd")
    return out, Usd.Stage.Open(str(out.with_name("dataset_usd") / "area_1.usda"))


def test_the_frame_is_told(made):
    _, stage = made
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert stage.GetDefaultPrim().GetPath() == "/area_1"


def test_meshes_and_labels_are_those_of_the_data_set(made):
    out, stage = made
    corners, labels = labelled_faces(out / "area_1/3d/semantic.obj")
    found = 0
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Mesh):
            continue
        mesh = UsdGeom.Mesh(prim)
        points = np.array(mesh.GetPointsAttr().Get())
        indices = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
        assert (np.array(mesh.GetFaceVertexCountsAttr().Get()) == 3).all()
        assert np.allclose(mesh.GetExtentAttr().Get(), [points.min(axis=0), points.max(axis=0)])
        name = prim.GetName()
        if name == "unlabelled":
            own = labels == UNLABELLED
        else:
            own = labels == name
            values = {of: UsdSemantics.LabelsAPI(prim, of).GetLabelsAttr().Get() for of in ["class", "instance"]}
            assert list(values["instance"]) == [name] and name.startswith(values["class"][0] + "_")
            assert prim.GetParent().GetName() in name
        assert np.abs(points[indices] - corners[own]).max() < 1e-5, name
        found += len(indices)
    assert found == len(labels)


def test_textures_are_bound(made):
    _, stage = made
    subsets = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Subset)]
    assert subsets
    for subset in subsets:
        mesh = UsdGeom.Mesh(subset.GetParent())
        st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
        assert st.GetInterpolation() == "faceVarying"
        assert len(st.Get()) == len(mesh.GetFaceVertexIndicesAttr().Get())
        material, _ = UsdShade.MaterialBindingAPI(subset).ComputeBoundMaterial()
        surface, _, _ = material.ComputeSurfaceSource()
        assert surface.GetIdAttr().Get() == "UsdPreviewSurface"
        image, _, _ = surface.GetInput("diffuseColor").GetConnectedSource()
        file = UsdShade.Shader(image.GetPrim()).GetInput("file").Get()
        assert file.resolvedPath, file


def test_cameras_project_as_the_views(made):
    out, stage = made
    poses = {p.name.split("_frame_")[0] + "_frame_" + p.name.split("_frame_")[1].split("_")[0]:
             json.loads(p.read_text()) for p in (out / "area_1/data/pose").glob("*.json")}
    cameras = [UsdGeom.Camera(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    assert len(cameras) == len(poses) > 1
    for camera in cameras:
        name = camera.GetPrim().GetName()
        uuid = name.split("_")[1]
        [pose] = [p for key, p in poses.items() if uuid in key and key.endswith("_" + name.rsplit("_", 1)[1])]
        rt, k = np.array(pose["camera_rt_matrix"]), np.array(pose["camera_k_matrix"])
        gf = camera.GetCamera()
        projection = np.array(gf.frustum.ComputeViewMatrix() * gf.frustum.ComputeProjectionMatrix())

        # Points before the camera, by the pose and by USD.
        local = np.random.default_rng(1).uniform([-1, -1, 2], [1, 1, 6], (50, 3))
        world = (local - rt[:, 3]) @ rt[:, :3]
        pixels = local @ k.T
        pixels = pixels[:, :2] / pixels[:, 2:]
        clip = np.c_[world, np.ones(50)] @ projection
        device = clip[:, :2] / clip[:, 3:]
        usd = np.c_[(device[:, 0] + 1) * 32, (1 - device[:, 1]) * 32]
        assert np.abs(usd - pixels).max() < 1e-2, name
