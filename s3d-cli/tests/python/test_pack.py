"""Reads the output of `s3d pack` with the packages that trainers use, and compares it with the data set's own
files.
"""

import io
import json
import tarfile
from pathlib import Path

import pytest

np = pytest.importorskip("numpy")
Image = pytest.importorskip("PIL.Image")

SIZE = 96
CLASSES = "ceiling floor wall beam column window door table chair sofa bookcase board clutter".split()
SUFFIX = {d: d for d in ("rgb", "depth", "semantic", "semantic_pretty", "global_xyz", "pose")} | {"normal": "normals"}
EXTENSION = {"global_xyz": "exr", "pose": "json"}


@pytest.fixture(scope="module")
def pack(s3d, demo, tmp_path_factory):
    """Packs the demo. `pack("colmap", "--binary")` returns the package's folder or file."""

    def run(kind, *more):
        place = tmp_path_factory.mktemp("packs") / ("images.parquet" if kind == "parquet" else "package")
        s3d("pack", demo, "--to", kind, "-o", place, *more)
        return place

    return run


def stems(demo, kind):
    return sorted(p.name.split("_domain_")[0] for p in (demo / "area_1" / kind / "rgb").iterdir())


def image_path(demo, stem, domain):
    kind = "pano" if stem.endswith("equirectangular") else "data"
    name = f"{stem}_domain_{SUFFIX[domain]}.{EXTENSION.get(domain, 'png')}"
    return demo / "area_1" / kind / domain / name


def array(path):
    return np.asarray(Image.open(path))


def labels_of(demo, stem):
    """Returns the label index of each pixel, -1 where nothing was seen."""
    rgb = array(image_path(demo, stem, "semantic")).astype(np.int64)
    index = rgb[..., 0] * 65536 + rgb[..., 1] * 256 + rgb[..., 2]
    return np.where((rgb == 13).all(-1), -1, index)


def depth_of(demo, stem):
    """Returns metres, NaN where nothing was seen."""
    depth = array(image_path(demo, stem, "depth")).astype(np.float64)
    return np.where(depth == 65535, np.nan, depth / 512)


def pose_of(demo, stem):
    pose = json.loads(image_path(demo, stem, "pose").read_text())
    return np.array(pose["camera_k_matrix"]), np.array(pose["camera_rt_matrix"]), pose


# WebDataset


def test_webdataset_gives_every_image_with_all_its_fields(pack, demo):
    wds = pytest.importorskip("webdataset")
    place = pack("webdataset", "--max-count", "10")
    index = json.loads((place / "shards.json").read_text())
    urls = [str(place / s["url"]) for s in index["shardlist"] if "_views-" in s["url"]]
    assert len(urls) == -(-len(stems(demo, "data")) // 10)
    # With "pil" alone, every image would become 8-bit RGB.
    depth = wds.autodecode.handle_extension("depth.png", lambda data: np.asarray(Image.open(io.BytesIO(data))))
    samples = list(wds.WebDataset(urls, shardshuffle=False).decode(depth, "pil"))
    assert len(samples) == len(stems(demo, "data"))
    assert {s["__key__"] for s in samples} == {f"area_1/{s}" for s in stems(demo, "data")}
    fields = {f"{SUFFIX[d]}.{EXTENSION.get(d, 'png')}" for d in SUFFIX}
    for sample in samples:
        assert {key for key in sample if not key.startswith("__")} == fields
        stem = sample["__key__"].removeprefix("area_1/")
        assert (np.asarray(sample["rgb.png"]) == array(image_path(demo, stem, "rgb"))).all()
        assert (sample["depth.png"] == array(image_path(demo, stem, "depth"))).all()
        assert sample["global_xyz.exr"] == image_path(demo, stem, "global_xyz").read_bytes()
        assert sample["pose.json"] == pose_of(demo, stem)[2]


def test_workers_share_shards_without_a_word(pack, demo):
    wds = pytest.importorskip("webdataset")
    place = pack("webdataset", "--images", "views")
    shards = json.loads((place / "pack.json").read_text())["notes"][0]
    name = shards.split('"')[1]
    count = len(list(place.glob("area_1_views-*.tar")))
    assert count >= 8 and name == f"area_1_views-{{000000..{count - 1:06}}}.tar"
    keys = []
    for worker in range(2):
        # A DataLoader with two workers: each takes every second shard.
        urls = list(wds.shardlists.expand_urls(str(place / name)))[worker::2]
        assert urls
        keys += [sample["__key__"] for sample in wds.WebDataset(urls, shardshuffle=False)]
    assert sorted(keys) == sorted(f"area_1/{s}" for s in stems(demo, "data"))


def test_shards_are_plain_tar_files(pack, demo):
    place = pack("webdataset", "--prefix", "all", "--shuffle", "3", "--max-count", "10000")
    with tarfile.open(place / "all-000000.tar") as archive:
        members = [m for m in archive.getmembers() if not m.name.startswith("__s3d__/")]
        labels = json.load(archive.extractfile("__s3d__/semantic_labels.json"))
        assert labels == json.loads((demo / "assets/semantic_labels.json").read_text())
        assert {(m.mtime, m.uid, m.gid, m.mode, m.type) for m in members} == {(0, 0, 0, 0o644, tarfile.REGTYPE)}
        keys = list(dict.fromkeys(m.name.split(".")[0] for m in members))
        # The files of a sample are adjacent.
        assert len(members) == 7 * len(keys)
        assert all(m.name.split(".")[0] == keys[i // 7] for i, m in enumerate(members))
        everything = [f"area_1/{s}" for kind in ("data", "pano") for s in stems(demo, kind)]
        assert sorted(keys) == sorted(everything) and keys != everything
        for member in members:
            key, field = member.name.split(".", 1)
            domain = next(d for d in SUFFIX if f"{SUFFIX[d]}.{EXTENSION.get(d, 'png')}" == field)
            content = archive.extractfile(member).read()
            assert content == image_path(demo, key.removeprefix("area_1/"), domain).read_bytes()


# COLMAP


def read_colmap_text(model):
    cameras, images = {}, {}
    for line in (model / "cameras.txt").read_text().splitlines():
        if not line.startswith("#"):
            number, name, w, h, *parameters = line.split()
            cameras[int(number)] = (name, int(w), int(h), [float(p) for p in parameters])
    lines = [line for line in (model / "images.txt").read_text().split("\n") if not line.startswith("#")]
    for line, points in zip(lines[0::2], lines[1::2]):
        number, *numbers, camera, name = line.split()
        assert points == ""
        images[name] = (int(number), np.array([float(n) for n in numbers]), int(camera))
    return cameras, images


def rotation(w, x, y, z):
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_colmap_points_fall_where_the_depth_images_have_them(pack, demo):
    model = pack("colmap", "--points", "30000") / "area_1" / "sparse" / "0"
    cameras, images = read_colmap_text(model)
    points = np.loadtxt(model / "points3D.txt")
    assert points.shape == (30000, 8) and (points[:, 0] == np.arange(1, 30001)).all()
    assert {Path(n).name.split("_domain_")[0] for n in images} == set(stems(demo, "data"))
    seen = 0
    for name, (number, (qw, qx, qy, qz, *t), camera) in images.items():
        assert camera == number and qw >= 0
        kind, w, h, (fx, fy, cx, cy) = cameras[camera]
        assert (kind, w, h) == ("PINHOLE", SIZE, SIZE)
        stem = name.split("_domain_")[0]
        k, rt, _ = pose_of(demo, stem)
        np.testing.assert_allclose([fx, fy, cx, cy], [k[0, 0], k[1, 1], k[0, 2], k[1, 2]], rtol=1e-12)
        r = rotation(qw, qx, qy, qz)
        np.testing.assert_allclose(np.c_[r, t], rt, atol=1e-9)
        # Points of the cloud lie on the surfaces of the depth image, or are hidden behind them.
        x, y, z = r @ points[:, 1:4].T + np.array(t)[:, None]
        front = z > 0.05
        u, v = np.floor(fx * x[front] / z[front] + cx), np.floor(fy * y[front] / z[front] + cy)
        inside = (u >= 0) & (u < w) & (v >= 0) & (v < h)
        u, v, z = u[inside].astype(int), v[inside].astype(int), z[front][inside]
        image = depth_of(demo, stem)
        # The pixel and its neighbours, to leave out points within one pixel of an edge.
        padded = np.pad(image, 1, mode="edge")
        around = np.stack([padded[1 + dy : 1 + dy + h, 1 + dx : 1 + dx + w] for dy in (-1, 0, 1) for dx in (-1, 0, 1)])
        near, far = np.nanmin(around, 0)[v, u], np.nanmax(around, 0)[v, u]
        assert (z < near - 0.03).mean() < 0.002, "points stand before what is seen"
        seen += ((z > near - 0.01) & (z < far + 0.01)).sum()
    assert seen > 2000


def test_colmap_binary_holds_what_text_holds(pack):
    import struct

    text = pack("colmap", "--points", "100") / "area_1" / "sparse" / "0"
    binary = pack("colmap", "--points", "100", "--binary") / "area_1" / "sparse" / "0"
    cameras, images = read_colmap_text(text)
    stream = io.BytesIO((binary / "cameras.bin").read_bytes())
    take = lambda form: struct.unpack("<" + form, stream.read(struct.calcsize("<" + form)))
    for _ in range(take("Q")[0]):
        number, model, w, h, *parameters = take("iiQQ4d")
        assert (model, cameras[number]) == (1, ("PINHOLE", w, h, list(parameters)))
    assert not stream.read()
    stream = io.BytesIO((binary / "images.bin").read_bytes())
    for _ in range(take("Q")[0]):
        number, *pose, camera = take("i7di")
        name = b""
        while (c := stream.read(1)) != b"\0":
            name += c
        assert take("Q") == (0,)
        assert images[name.decode()][0] == number and (images[name.decode()][1] == pose).all()
    assert not stream.read()
    stream = io.BytesIO((binary / "points3D.bin").read_bytes())
    points = [take("Q3d3BdQ") for _ in range(take("Q")[0])]
    expected = np.loadtxt(text / "points3D.txt")
    # The text has the shortest decimals of single precision.
    np.testing.assert_allclose(np.array(points)[:, :8], expected, atol=1e-6)
    assert not stream.read()


# nerfstudio


def transforms(place, name="transforms.json"):
    folder = place / "area_1"
    return folder, json.loads((folder / name).read_text())


def exr(path):
    OpenEXR = pytest.importorskip("OpenEXR")
    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        if "RGB" in channels:
            return channels["RGB"].pixels.astype(np.float64)
        return np.stack([channels[c].pixels for c in "RGB"], -1).astype(np.float64)


def test_nerfstudio_views_reproject_to_world_coordinates(pack, demo):
    folder, file = transforms(pack("nerfstudio"))
    assert file["camera_model"] == "OPENCV"
    assert (np.array(file["applied_transform"]) == np.eye(4)[:3]).all()
    assert len(file["frames"]) == len(stems(demo, "data"))
    for frame in file["frames"]:
        path = (folder / frame["file_path"]).resolve()
        stem = path.name.split("_domain_")[0]
        assert path == image_path(demo, stem, "rgb").resolve() and (frame["w"], frame["h"]) == (SIZE, SIZE)
        depth = array(folder / frame["depth_file_path"])
        assert depth.dtype == np.uint16 or depth.dtype == np.int32
        expected = depth_of(demo, stem)
        assert ((depth == 0) == np.isnan(expected)).all()
        assert np.nanmax(np.abs(depth / 1000 - expected)) <= 0.0005 + 1e-9
        # OpenGL's axes: y up, z back.
        v, u = np.mgrid[:SIZE, :SIZE] + 0.5
        z = np.where(depth == 0, np.nan, depth / 1000)
        camera = np.stack([(u - frame["cx"]) / frame["fl_x"], -(v - frame["cy"]) / frame["fl_y"], -np.ones_like(u)])
        m = np.array(frame["transform_matrix"])
        world = np.einsum("ij,jyx->yxi", m[:3, :3], camera * z) + m[:3, 3]
        # Half floats step by 1.6 cm up to 32 m.
        assert np.nanmax(np.abs(world - exr(image_path(demo, stem, "global_xyz")))) < 0.02


def test_nerfstudio_panoramas_reproject_to_world_coordinates(pack, demo):
    folder, file = transforms(pack("nerfstudio", "--depth", "original", "--copy-images"), "transforms_panoramas.json")
    assert file["camera_model"] == "EQUIRECTANGULAR"
    assert len(file["frames"]) == len(stems(demo, "pano"))
    for frame, stem in zip(file["frames"], stems(demo, "pano")):
        assert (folder / frame["file_path"]).read_bytes() == image_path(demo, stem, "rgb").read_bytes()
        w, h = frame["w"], frame["h"]
        assert (frame["fl_x"], frame["fl_y"], frame["cx"], frame["cy"]) == (h, h, w / 2, h / 2)
        raw = array(folder / frame["depth_file_path"]).astype(np.float64)
        distance = np.where(raw == 65535, np.nan, raw * 0.001953125)
        v, u = np.mgrid[:h, :w] + 0.5
        theta = -np.pi * (u - frame["cx"]) / frame["fl_x"]
        phi = np.pi * (0.5 + (v - frame["cy"]) / frame["fl_y"])
        ray = np.stack([-np.sin(theta) * np.sin(phi), np.cos(phi), -np.cos(theta) * np.sin(phi)])
        m = np.array(frame["transform_matrix"])
        world = np.einsum("ij,jyx->yxi", m[:3, :3], ray * distance) + m[:3, 3]
        assert np.nanmax(np.abs(world - exr(image_path(demo, stem, "global_xyz")))) < 0.02


def test_nerfstudio_cloud_opens(pack, demo):
    o3d = pytest.importorskip("open3d")
    folder, file = transforms(pack("nerfstudio", "--points", "5000"))
    cloud = o3d.io.read_point_cloud(str(folder / file["ply_file_path"]))
    assert len(cloud.points) == 5000 and len(cloud.colors) == 5000
    whole = o3d.io.read_point_cloud(str(demo / "area_1" / "3d" / "pointcloud.ply"))
    assert np.max(whole.compute_point_cloud_distance(cloud)) > 0
    assert np.max(cloud.compute_point_cloud_distance(whole)) == 0
    np.testing.assert_allclose(np.mean(cloud.colors, 0), np.mean(whole.colors, 0), atol=0.02)


# COCO


def test_coco_panoptic_agrees_with_its_images(pack, demo):
    place = pack("coco")
    file = json.loads((place / "panoptic.json").read_text())
    names = json.loads((demo / "assets" / "semantic_labels.json").read_text())
    assert [(c["id"], c["name"]) for c in file["categories"]] == list(enumerate(CLASSES, 1))
    stuff = {c["id"] for c in file["categories"] if not c["isthing"]}
    assert stuff == {1, 2, 3}
    images = {i["id"]: i for i in file["images"]}
    assert len(images) == len(file["annotations"]) == len(stems(demo, "data")) + len(stems(demo, "pano"))
    for annotation in file["annotations"]:
        image = images[annotation["image_id"]]
        assert (demo / image["file_name"]).is_file() and image["file_name"] == annotation["file_name"]
        stem = Path(image["file_name"]).name.split("_domain_")[0]
        png = array(place / "panoptic" / annotation["file_name"]).astype(np.int64)
        assert png.shape == (image["height"], image["width"], 3)
        ids = png[..., 0] + 256 * png[..., 1] + 65536 * png[..., 2]
        segments = {s["id"]: s for s in annotation["segments_info"]}
        assert set(np.unique(ids)) - {0} == set(segments)
        label = labels_of(demo, stem)
        category = np.array([0] + [CLASSES.index(n.split("_")[0]) + 1 for n in names[1:] if "<UNK>" not in n] + [0])
        category_of = np.where(label < 0, 0, category[np.clip(label, 0, len(category) - 1)])
        assert ((ids == 0) == (category_of == 0)).all()
        of_stuff = {s["category_id"] for s in segments.values()} & stuff
        for number, s in segments.items():
            mask = ids == number
            rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
            box = [columns[0], rows[0], columns[-1] - columns[0] + 1, rows[-1] - rows[0] + 1]
            assert (s["area"], s["bbox"], s["iscrowd"]) == (mask.sum(), box, 0)
            assert (category_of[mask] == s["category_id"]).all()
            if s["category_id"] not in stuff:
                assert (mask == (label == number)).all()
        assert sum(s["category_id"] in stuff for s in segments.values()) == len(of_stuff)


# Parquet


@pytest.fixture(scope="module")
def index(pack):
    return pack("parquet")


def test_parquet_in_pandas(index, demo):
    pd = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    table = pd.read_parquet(index)
    assert len(table) == len(stems(demo, "data")) + len(stems(demo, "pano"))
    kept = {
        (v["camera_uuid"], v["frame_num"]): v
        for v in json.loads((demo / "area_1" / "views.json").read_text())
        if v["frame_num"] is not None
    }
    names = json.loads((demo / "assets" / "semantic_labels.json").read_text())
    for row in table.itertuples():
        for domain in SUFFIX:
            assert (demo / getattr(row, domain)).is_file()
        stem = Path(row.rgb).name.split("_domain_")[0]
        k, rt, pose = pose_of(demo, stem)
        assert (np.reshape(row.k, (3, 3)) == k).all() and (np.reshape(row.rt, (3, 4)) == rt).all()
        assert [row.x, row.y, row.z] == pose["camera_location"] and row.camera_uuid == pose["camera_uuid"]
        assert f"{row.room}_{row.area}" == pose["room"] and f"{row.room_type}_{row.room_number}" == row.room
        if row.kind == "view":
            view = kept.pop((row.camera_uuid, row.frame_num))
            for column in ("yaw_rad", "pitch_rad", "fov_rad"):
                assert getattr(row, column) == view[column]
            assert row.selection_entropy == view["entropy"]
            assert (row.width, row.height) == (SIZE, SIZE)
        else:
            assert np.isnan(row.frame_num) and np.isnan(row.yaw_rad) and np.isnan(row.selection_entropy)
            assert row.width == 2 * row.height
        label = labels_of(demo, stem)
        assert row.coverage == (label >= 0).mean()
        classes = [CLASSES.index(names[i].split("_")[0]) for i in label[label > 0]]
        shares = np.bincount(classes, minlength=13) / label.size
        np.testing.assert_allclose([getattr(row, f"share_{c}") for c in CLASSES], shares, atol=1e-12)
        np.testing.assert_allclose(shares.sum() + row.share_unlabelled, row.coverage, atol=1e-12)
        p = shares[shares > 0] / shares.sum()
        np.testing.assert_allclose(row.entropy, -(p * np.log(p)).sum(), atol=1e-12)
        assert row.instances == len(np.unique(label[label > 0]))
        depth = depth_of(demo, stem)
        expected = [np.nanmin(depth), np.nanmean(depth), np.nanmax(depth)]
        np.testing.assert_allclose([row.depth_min_m, row.depth_mean_m, row.depth_max_m], expected, rtol=1e-12)
    assert not kept


def test_parquet_in_duckdb(index, demo):
    duckdb = pytest.importorskip("duckdb")
    rows = duckdb.sql(f"select kind, count(*), min(coverage), max(len(rt)) from '{index}' group by kind").fetchall()
    counts = {kind: (count, length) for kind, count, _, length in rows}
    assert counts == {"view": (len(stems(demo, "data")), 12), "panorama": (len(stems(demo, "pano")), 12)}
    null = duckdb.sql(f"select count(*) from '{index}' where frame_num is null").fetchall()[0][0]
    assert null == len(stems(demo, "pano"))
    query = f"select rgb from '{index}' where kind = 'view' and share_chair > 0 order by share_chair desc limit 1"
    best = duckdb.sql(query).fetchall()
    assert len(best) == 1 and (demo / best[0][0]).is_file()
