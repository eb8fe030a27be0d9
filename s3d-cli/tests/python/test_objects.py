"""Objects of images, held against Open3D's rays at each instance alone, pycocotools and trimesh's boxes."""

import importlib.util
import json
import shutil
import subprocess
import sys

import numpy as np
import pytest

o3d = pytest.importorskip("open3d")


@pytest.fixture(scope="module")
def exported(s3d, demo, tmp_path_factory):
    out = tmp_path_factory.mktemp("objects") / "dataset"
    small = ["--views", "6", "--size", "120", "--pano-width", "240", "--points-per-m2", "100"]
    s3d("export", demo / "scan/scene.toml", "-o", out, *small, "--modalities", "semantic,depth,pose,objects")
    return out


@pytest.fixture(scope="module")
def utils(exported):
    spec = importlib.util.spec_from_file_location("utils_of_objects", exported / "assets/utils.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def instances(exported):
    """The corners and faces of the instances of the mesh, by name, in the world."""
    corners, faces, name = [], {}, None
    for line in (exported / "area_1/3d/semantic.obj").read_text().splitlines():
        word, *rest = line.split()[:4] or [""]
        if word == "v":
            x, y, z = map(float, rest)
            corners.append((x, -z, y))
        elif word == "usemtl":
            name = line.split(maxsplit=1)[1]
        elif word == "f":
            faces.setdefault(name, []).append([int(corner.split("/")[0]) - 1 for corner in rest])
    return np.array(corners), {name: np.array(faces) for name, faces in faces.items()}


def alone(corners, faces):
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor(corners.astype(np.float32)), o3d.core.Tensor(faces.astype(np.uint32))
    )
    return scene


def rays_of_view(pose, height, width):
    """The rays of the pixels, z along the optical axis 1."""
    K, RT = np.array(pose["camera_k_matrix"]), np.array(pose["camera_rt_matrix"])
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    ahead = np.stack([(x - K[0, 2]) / K[0, 0], (y - K[1, 2]) / K[1, 1], np.ones_like(x)], axis=-1)
    rays = ahead @ RT[:, :3]
    return np.concatenate([np.broadcast_to(pose["camera_location"], rays.shape), rays], axis=-1)


def test_the_reader_of_the_data_set_holds_them_against_the_labels(exported):
    done = subprocess.run([sys.executable, "-W", "error", exported / "assets/utils.py", exported], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_verify_finds_each_planted_change(s3d, exported, tmp_path):
    s3d("verify", exported)
    copy = tmp_path / "dataset"
    shutil.copytree(exported, copy)
    image = sorted((copy / "area_1/data/objects").iterdir())[3]
    whole = json.loads(image.read_text())
    thing = max(range(len(whole["objects"])), key=lambda k: whole["objects"][k]["occlusion"])
    for key, value, told in [
        ("visible_pixels", 1, "the number of visible pixels"),
        ("occlusion", 0.999, "the occlusion"),
        ("amodal_mask", {"size": [120, 120], "counts": "0"}, "the amodal mask"),
        ("hidden_by", [], "what hides it"),
        ("median_m", 99.0, "the median distance"),
    ]:
        changed = json.loads(json.dumps(whole))
        changed["objects"][thing][key] = value
        image.write_text(json.dumps(changed))
        found = s3d("verify", copy, code=1)
        assert f"{told} is not what the mesh shows" in found.stdout + found.stderr, found.stdout


def test_masks_are_those_of_rays_at_each_instance(exported, utils, instances):
    corners, faces = instances
    data = utils.Dataset(exported)
    views = data.images("data")
    assert len(views) > 8
    compared = hidden = 0
    for image in views[::3]:
        index = data.semantic(image)
        rays = rays_of_view(data.pose(image), *index.shape)
        for thing in data.objects(image):
            hit = alone(corners, faces[thing["label"]]).cast_rays(o3d.core.Tensor(rays.astype(np.float32)))
            shown = np.isfinite(hit["t_hit"].numpy())
            mask = utils.decode_mask(thing["amodal_mask"])
            # Rays of 32 bits may miss at edges.
            assert (shown != mask).sum() <= 0.01 * mask.sum() + 4, thing["label"]
            assert mask.sum() == thing["amodal_pixels"]
            rows, columns = np.nonzero(mask)
            x, y, width, height = thing["amodal_box"]
            assert (x, y) == (columns.min(), rows.min())
            assert (x + width, y + height) == (columns.max() + 1, rows.max() + 1)

            over = index[mask & (index != thing["label_index"])]
            counts = {int(label): int((over == label).sum()) for label in np.unique(over)}
            assert counts == {hider["label_index"]: hider["pixels"] for hider in thing["hidden_by"]}
            assert abs(thing["occlusion"] - len(over) / mask.sum()) < 1e-6
            compared += 1
            hidden += len(over) > 0
    assert compared > 20 and hidden > 5


def test_masks_of_panoramas_hold_the_visible_pixels(exported, utils):
    data = utils.Dataset(exported)
    panoramas = data.images("pano")
    for image in panoramas:
        index, width = data.semantic(image), 240
        for thing in data.objects(image):
            mask = utils.decode_mask(thing["amodal_mask"])
            assert mask[index == thing["label_index"]].all()
            x, _, columns, _ = thing["amodal_box"]
            used = np.zeros(width, bool)
            used[np.arange(x, x + columns) % width] = True
            assert (mask.any(axis=0) <= used).all() and mask.any(axis=0)[[x, (x + columns - 1) % width]].all()
            left, right = thing["angles"]["azimuth_deg"]
            assert abs(left - right - columns * 1.5) < 1e-5 and -180 < left <= 180


def test_pycocotools_reads_the_masks(exported, utils):
    mask = pytest.importorskip("pycocotools.mask")
    data = utils.Dataset(exported)
    for image in data.images("data")[:6]:
        for thing in data.objects(image):
            assert (mask.decode(thing["amodal_mask"]) == utils.decode_mask(thing["amodal_mask"])).all()


def test_corners_are_projected_and_distances_measured(exported, utils):
    data = utils.Dataset(exported)
    boxes = {one["label"]: one["surface"] for one in json.loads((exported / "area_1/3d/instances.json").read_text())["instances"]}
    for image in data.images("data")[:8]:
        pose, depth, index = data.pose(image), data.depth(image), data.semantic(image)
        K, RT = np.array(pose["camera_k_matrix"]), np.array(pose["camera_rt_matrix"])
        lengths = np.linalg.norm(rays_of_view(pose, *index.shape)[..., 3:], axis=-1)
        for thing in data.objects(image):
            distances = (depth * lengths)[index == thing["label_index"]]
            assert abs(np.nanmin(distances) - thing["nearest_m"]) < 0.01
            assert abs(np.nanmedian(distances) - thing["median_m"]) < 0.02 + 0.02 * thing["median_m"]

            low, high = np.split(np.array(boxes[thing["label"]]["bbox"]), 2)
            for k, found in enumerate(thing["corners"]["axis_aligned"]):
                corner = np.where([k & 1, k & 2, k & 4], high, low)
                ahead = RT[:, :3] @ corner + RT[:, 3]
                assert (found is None) == (ahead[2] <= 0)
                if found is not None and ahead[2] > 0.1:
                    pixel = K @ (ahead / ahead[2])
                    assert np.abs(pixel[:2] - found[:2]).max() < 0.05 and abs(ahead[2] - found[2]) < 1e-3


def test_boxes_hold_the_faces_and_are_small(exported, instances):
    trimesh = pytest.importorskip("trimesh")
    corners, faces = instances
    entries = json.loads((exported / "area_1/3d/instances.json").read_text())["instances"]
    ratios = []
    for entry in entries:
        points = corners[np.unique(faces[entry["label"]])]
        surface = entry["surface"]
        assert np.allclose(np.concatenate([points.min(0), points.max(0)]), surface["bbox"], atol=1e-5)

        box = surface["oriented"]
        inside = (points - box["center"]) @ np.array(box["axes"]).T
        assert (np.abs(inside) <= np.array(box["size"]) / 2 + 1e-5).all()
        upright = surface["upright"]
        turn = np.deg2rad(upright["yaw_deg"])
        along = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        inside = (points - upright["center"]) @ along.T
        assert (np.abs(inside) <= np.array(upright["size"]) / 2 + 1e-5).all()

        if min(box["size"]) > 0.01:
            peer = trimesh.Trimesh(corners, faces[entry["label"]]).bounding_box_oriented.volume
            ratios.append(np.prod(box["size"]) / peer)
    assert len(ratios) > 10 and np.mean(ratios) < 1.01 and np.quantile(ratios, 0.95) < 1.06, sorted(ratios)[-9:]


def test_a_table_holds_what_the_files_hold(exported, s3d, tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    path = tmp_path / "objects.parquet"
    s3d("pack", exported, "--to", "objects", "-o", path)
    table = pandas.read_parquet(path)
    for file, rows in table.groupby("objects"):
        told = json.loads((exported / file).read_text())
        assert len(rows) == len(told["objects"])
        for (_, row), thing in zip(rows.iterrows(), told["objects"], strict=True):
            for name in ["label", "label_index", "class", "visible_pixels", "amodal_pixels", "occlusion"]:
                assert row[name] == thing[name], (file, name)
            assert row["object_room"] == thing["room"]
            assert row["amodal_mask"] == thing["amodal_mask"]["counts"]
            assert list(row["size"]) == thing["amodal_mask"]["size"] == [told["height"], told["width"]]
            for name in ["visible_box", "amodal_box"]:
                assert list(row[name]) == thing[name]
            hidden = zip(row["hidden_by"], row["hidden_pixels"], strict=True)
            assert [{"label_index": i, "pixels": n} for i, n in hidden] == thing["hidden_by"]
            for name in ["nearest_m", "median_m"]:
                assert row[name] == pytest.approx(thing[name], rel=1e-6)
            if row["kind"] == "view":
                assert row["truncation"] == thing["beyond"]["truncation"] and row["azimuth_deg"] is None
                box = thing["beyond"]["box"]
                assert row["beyond_box"] is None if box is None else list(row["beyond_box"]) == box
            else:
                assert list(row["azimuth_deg"]) == thing["angles"]["azimuth_deg"]
            for name in ["axis_aligned", "upright", "oriented"]:
                corners = np.array([c or [np.nan] * 3 for c in thing["corners"][name]])
                assert np.array_equal(row[f"corners_{name}"].reshape(8, 3), corners, equal_nan=True)
    files = {str(p.relative_to(exported)) for p in (exported / "area_1").glob("*/objects/*.json")}
    empty = {f for f in files if not json.loads((exported / f).read_text())["objects"]}
    assert set(table["objects"]) == files - empty
