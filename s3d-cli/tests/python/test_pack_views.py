"""Reads the packages for networks of several views by the rules of their loaders, and compares the points of
pairs of views: they meet where both views see the same surface.

The rules are those of `dust3r/datasets/scannetpp.py`, MapAnything's `utils/wai` and VGGT's
`training/data/datasets/scannet.py`; docs/recipes.md names the versions.
"""

import gzip
import json
import os
import shutil

import pytest
from test_pack import SIZE, array, depth_of, exr, image_path, pack, pose_of, stems  # noqa: F401

np = pytest.importorskip("numpy")
Image = pytest.importorskip("PIL.Image")


def world_points(depth, k, world_from_camera, centre):
    """Returns the points of an image's pixels, NaN without depth. `centre` is the centre of the first pixel.
    """
    v, u = np.mgrid[: depth.shape[0], : depth.shape[1]] + centre
    z = np.where(depth > 0, depth, np.nan)
    camera = np.stack([(u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1], np.ones_like(u)]) * z
    return np.einsum("ij,jyx->yxi", world_from_camera[:3, :3], camera) + world_from_camera[:3, 3]


def share_that_meets(one, other, centre):
    """Returns the share of the points of `one` that meet the surface of `other`: they fall into a pixel of it
    whose point lies within the footprint of the pixel, which is what its neighbours span.
    """
    points = one["points"].reshape(-1, 3)
    points = points[np.isfinite(points).all(-1)]
    k, pose = other["k"], other["world_from_camera"]
    camera = (points - pose[:3, 3]) @ pose[:3, :3]
    front = camera[:, 2] > 0.05
    u = np.full(len(points), -1)
    v = np.full(len(points), -1)
    u[front] = np.floor(k[0, 0] * camera[front, 0] / camera[front, 2] + k[0, 2] + 0.5 - centre)
    v[front] = np.floor(k[1, 1] * camera[front, 1] / camera[front, 2] + k[1, 2] + 0.5 - centre)
    there = front & (u >= 1) & (u < SIZE - 1) & (v >= 1) & (v < SIZE - 1)
    u, v, points = u[there], v[there], points[there]
    near = other["points"][v, u]
    around = [other["points"][v + dy, u + dx] for dy, dx in [(-1, 0), (1, 0), (0, -1), (0, 1)]]
    footprint = np.nanmax([np.linalg.norm(a - near, axis=-1) for a in around], axis=0)
    meets = np.linalg.norm(points - near, axis=-1) <= footprint
    return meets.sum() / there.size


def check(views, pairs, demo, centre):
    """Checks the points of views, by their stem, against the data set, and the points of pairs against each
    other.
    """
    assert set(views) == set(stems(demo, "data"))
    for stem, view in views.items():
        view["points"] = world_points(view["depth"], view["k"], view["world_from_camera"], centre)
        expected = exr(image_path(demo, stem, "global_xyz"))
        assert (np.isnan(view["points"][..., 0]) == np.isnan(depth_of(demo, stem))).all()
        # Half floats step by 1.6 cm up to 32 m.
        assert np.nanmax(np.abs(view["points"] - expected)) < 0.02
    assert len(pairs) > 10
    off = []
    for one, other, share in pairs:
        off.append(share_that_meets(views[one], views[other], centre) - share)
    # Both shares are estimates: one of all pixels without the border, one of some pixels.
    assert np.abs(np.median(off)) < 0.05 and np.quantile(np.abs(off), 0.9) < 0.15


@pytest.fixture(scope="module")
def paired(s3d, demo, tmp_path_factory):
    """A copy of the data set with pairs, and the shares of `s3d pairs` by two stems."""
    copy = tmp_path_factory.mktemp("paired") / "dataset"
    shutil.copytree(demo, copy)
    s3d("pairs", copy)
    with np.load(copy / "area_1" / "pairs.npz") as file:
        names = [name.split("/")[1] for name in file["images"]]
        rows = np.repeat(np.arange(len(names)), np.diff(file["start"].astype(int)))
        shares = zip(rows, file["other"], file["overlap"])
        return copy, {(names[a], names[b]): float(share) for a, b, share in shares}


def test_dust3r_points_of_both_views_meet(pack, demo, paired):  # noqa: F811
    place = pack("dust3r")
    with np.load(place / "all_metadata.npz") as data:
        data = dict(data)
    assert list(data["scenes"]) == ["area_1"] and list(data["counts"]) == [0]
    assert (data["sceneids"] == 0).all() and len(data["images"]) == len(data["sceneids"])
    views = {}
    for name, k, pose in zip(data["images"], data["intrinsics"], data["trajectories"]):
        depth = array(place / "area_1" / "depth" / f"{name}.png")
        assert depth.dtype in (np.uint16, np.int32)
        color = Image.open(place / "area_1" / "images" / f"{name}.jpg")
        assert color.format == "JPEG"
        exact = array(image_path(demo, str(name), "rgb")).astype(float)
        assert np.abs(np.asarray(color) - exact).mean() < 3
        views[str(name)] = {"depth": depth / 1000, "k": k, "world_from_camera": pose}
    names = [str(name) for name in data["images"]]
    pairs = [(names[int(a)], names[int(b)], score) for a, b, score in data["pairs"]]
    assert all(a < b for a, b, _ in data["pairs"])
    _, shares = paired
    for a, b, score in pairs:
        assert score == min(shares[a, b], shares[b, a])
        assert max(shares[a, b], shares[b, a]) >= np.float32(0.05)
    # The score is the smaller share of both directions.
    check(views, [(a, b, shares[a, b]) for a, b, _ in pairs], demo, 0)


def test_pairs_on_the_disk_are_used(pack, s3d, paired, tmp_path):  # noqa: F811
    found = (pack("dust3r") / "all_metadata.npz").read_bytes()
    dataset, _ = paired
    told = s3d("pack", dataset, "--to", "dust3r", "-o", tmp_path / "of_file")
    assert (tmp_path / "of_file" / "all_metadata.npz").read_bytes() == found
    assert "finding its pairs" not in told.stderr


def test_wai_points_of_both_views_meet(pack, demo, paired):  # noqa: F811
    OpenEXR = pytest.importorskip("OpenEXR")
    place = pack("wai")
    for split in ["train", "val", "test"]:
        scenes = place / "metadata" / split / f"scannetppv2_scene_list_{split}.npy"
        assert list(np.load(scenes)) == ["area_1"]
    scene = place / "area_1"
    meta = json.loads((scene / "scene_meta.json").read_text())
    assert (meta["camera_model"], meta["camera_convention"]) == ("PINHOLE", "opencv")
    assert meta["scale_type"] == "metric"
    assert meta["frame_modalities"]["rendered_depth"] == {"frame_key": "rendered_depth", "format": "depth"}
    views = {}
    for frame in meta["frames"]:
        with OpenEXR.File(str(scene / frame["rendered_depth"])) as file:
            (channel,) = file.channels().values()
            assert channel.name == "Y" and channel.pixels.dtype == np.float32
            depth = channel.pixels.copy()
        assert depth.shape == (frame["h"], frame["w"])
        stem = frame["frame_name"]
        assert (array(scene / frame["image"]) == array(image_path(demo, stem, "rgb"))).all()
        k = np.array([[frame["fl_x"], 0, frame["cx"]], [0, frame["fl_y"], frame["cy"]], [0, 0, 1]])
        views[stem] = {"depth": depth, "k": k, "world_from_camera": np.array(frame["transform_matrix"])}
    names = [frame["frame_name"] for frame in meta["frames"]]
    n = len(names)
    # The loader takes the shape from the file's name, and maps the numbers from byte 128.
    (path,) = (scene / "covisibility" / "v0").iterdir()
    assert path.name == f"pairwise_covisibility--{n}x{n}.npy"
    matrix = np.memmap(path, np.float32, "r", 128, (n, n))
    assert (matrix == np.load(path)).all() and (np.diag(matrix) == 1).all()
    pairs = [(names[a], names[b], matrix[a, b]) for a, b in zip(*np.nonzero(matrix)) if a != b]
    _, shares = paired
    among = {(a, b): share for (a, b), share in shares.items() if share > 0 and a in views and b in views}
    assert {(a, b): float(share) for a, b, share in pairs} == among
    check(views, pairs, demo, 0)


def test_wai_depth_in_opencv(pack, demo):  # noqa: F811
    os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"
    cv2 = pytest.importorskip("cv2")
    if "OpenEXR:                     NO" in cv2.getBuildInformation():
        pytest.skip("this OpenCV is built without OpenEXR")
    for path in sorted((pack("wai") / "area_1" / "rendered_depth").iterdir()):
        depth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert depth.dtype == np.float32 and depth.ndim == 2
        expected = np.nan_to_num(depth_of(demo, path.stem))
        assert (depth == expected.astype(np.float32)).all()


def test_vggt_points_of_both_views_meet(pack, demo, paired):  # noqa: F811
    place = pack("vggt")
    sequences = {}
    for split in ["train", "test"]:
        with gzip.open(place / "annotations" / "scannet" / f"{split}.jgz") as file:
            sequences = json.loads(file.read())
        views = {}
        for name, images in sequences.items():
            for image in images:
                stem = image["filepath"].split("/")[-1].removesuffix(".png")
                assert name == f"area_1_{stem.split('_', 2)[2].split('_frame_')[0]}"
                assert (array(place / image["filepath"]) == array(image_path(demo, stem, "rgb"))).all()
                k, extri = np.array(image["intri"]), np.array(image["extri"])
                assert k[0, 1] == k[1, 0] == 0 and extri.shape == (3, 4)
                assert (k == pose_of(demo, stem)[0]).all() and (extri == pose_of(demo, stem)[1]).all()
                pose = np.linalg.inv(np.vstack([extri, [0, 0, 0, 1]]))
                depth = array(place / image["depthpath"]) / 1000
                views[stem] = {"depth": depth, "k": k, "world_from_camera": pose}
        _, shares = paired
        pairs = [(*pair, share) for pair, share in shares.items() if pair[0] in views and pair[1] in views]
        check(views, pairs, demo, 0.5)


@pytest.mark.parametrize("kind, title", [("dust3r", "DUSt3R"), ("wai", "WAI"), ("vggt", "VGGT")])
def test_what_is_missing_is_named(s3d, demo, tmp_path, kind, title):
    out = tmp_path / "bare"
    small = ["--views", "2", "--size", "32", "--pano-width", "64", "--modalities", "rgb,pose"]
    s3d("export", demo / "scan" / "scene.toml", "-o", out, *small)
    told = s3d("pack", out, "--to", kind, "-o", tmp_path / "package", code=1)
    assert f"{title} needs depth; export with this modality" in told.stderr
    told = s3d("pack", demo, "--to", kind, "-o", tmp_path / "package", "--images", "panoramas", code=2)
    assert f"{title}'s cameras are pinholes" in told.stderr
    assert not (tmp_path / "package").exists()
