"""Pairs of images, held against Open3D's rays, all images against all."""

import importlib.util

import numpy as np
import pytest

o3d = pytest.importorskip("open3d")


def cameras(utils, data, names):
    """Of each image its pose, size, and the surface points of some pixels with their normals."""
    found = []
    for name in names:
        kind, stem = name.split("/")
        image = utils.Image(1, kind, stem)
        depth = data.depth(image)
        points = data.world_points(image)[2::5, 2::5].reshape(-1, 3)
        normals = data.world_normals(image)[2::5, 2::5].reshape(-1, 3)
        seen = ~np.isnan(points).any(axis=1)
        found.append((kind, data.pose(image), depth.shape, points[seen], normals[seen]))
    return found


def test_overlaps_are_those_of_rays(s3d, demo, tmp_path):
    out = tmp_path / "dataset"
    small = ["--views", "4", "--size", "100", "--pano-width", "200", "--points-per-m2", "50"]
    s3d("export", demo / "scan/scene.toml", "-o", out, *small, "--modalities", "depth,normal,pose")
    s3d("pairs", out, "--samples", "400", "--min-overlap", "0.1")
    assert "--overwrite" in s3d("pairs", out, code=2).stderr
    s3d("verify", out)

    spec = importlib.util.spec_from_file_location("utils_of_pairs", out / "assets/utils.py")
    utils = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(utils)
    data = utils.Dataset(out)
    with np.load(out / "area_1/pairs.npz") as arrays:
        pairs = {name: arrays[name] for name in arrays.files}
    names = pairs["images"].tolist()
    assert len(names) == len(data.images("data")) + len(data.images("pano"))

    mesh = o3d.io.read_triangle_mesh(str(out / "area_1/3d/rgb.obj"))
    mesh.rotate([[1, 0, 0], [0, 0, -1], [0, 1, 0]], center=[0, 0, 0])
    building = o3d.t.geometry.RaycastingScene()
    building.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))

    found = np.zeros((len(names), len(names)), np.float32)
    rows = np.repeat(np.arange(len(names)), np.diff(pairs["start"].astype(int)))
    found[rows, pairs["other"]] = pairs["overlap"]

    all_cameras = cameras(utils, data, names)
    expected = np.zeros_like(found)
    for a, (_, _, _, points, normals) in enumerate(all_cameras):
        for b, (kind, pose, (height, width), _, _) in enumerate(all_cameras):
            if a == b:
                continue
            eye = np.array(pose["camera_location"])
            to_eye = eye - points
            lengths = np.linalg.norm(to_eye, axis=1)
            seen = (normals * to_eye).sum(axis=1) > 0
            if kind == "data":
                RT, K = np.array(pose["camera_rt_matrix"]), np.array(pose["camera_k_matrix"])
                ahead = points @ RT[:, :3].T + RT[:, 3]
                with np.errstate(divide="ignore", invalid="ignore"):
                    pixels = (ahead / ahead[:, 2:]) @ K.T
                seen &= (ahead[:, 2] > 0) & (pixels[:, :2] >= 0).all(axis=1)
                seen &= (pixels[:, 0] < width) & (pixels[:, 1] < height)
            rays = np.concatenate([np.broadcast_to(eye, points.shape), -to_eye / lengths[:, None]], axis=1)
            hit = building.cast_rays(o3d.core.Tensor(rays[seen].astype(np.float32)))["t_hit"].numpy()
            expected[a, b] = (hit > lengths[seen] - 0.01).sum() / max(len(points), 1)

    # Depth has steps of 2 mm and normals of 8 bits, so single points may differ.
    large = np.maximum(expected, expected.T) > 0.13
    assert large.sum() > 100 and (np.abs(found - expected)[large] < 0.04).all()
    assert (expected[found == 0][np.maximum(found, found.T)[found == 0] == 0] < 0.13).all()

    locations = np.array([pose["camera_location"] for _, pose, *_ in all_cameras])
    distances = np.linalg.norm(locations[rows] - locations[pairs["other"]], axis=1)
    assert np.abs(distances - pairs["distance_m"]).max() < 1e-4
    assert (pairs["angle_deg"][distances == 0] < 1e-3).all() and (pairs["angle_deg"][distances > 0.5] > 0.5).mean() > 0.9
