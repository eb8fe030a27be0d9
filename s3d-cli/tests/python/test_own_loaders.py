"""Reads packages with the loaders of other projects themselves, as they are.

`S3D_LOADERS` names a folder with checkouts of their repositories: `dust3r`, `must3r`, `map-anything`, `vggt` and
`Pointcept`. They need torch and torchvision; what each needs besides is skipped by name where it is missing. Other
tests read the same files by the rules of these loaders, and need none of it.
"""

import importlib
import json
import os
import subprocess
import sys
import types
from pathlib import Path

import pytest
from test_pack import SIZE, depth_of, pack, pose_of, stems  # noqa: F401
from test_pack_views import paired, share_that_meets  # noqa: F401

np = pytest.importorskip("numpy")
Image = pytest.importorskip("PIL.Image")


@pytest.fixture
def loader(monkeypatch):
    """`loader("dust3r.datasets.scannetpp", "dust3r")` imports a module from the checkouts that follow."""
    place = os.environ.get("S3D_LOADERS") or pytest.skip("S3D_LOADERS names no checkouts of loaders")
    pytest.importorskip("torch", reason="torch is not installed")
    pytest.importorskip("torchvision", reason="torchvision is not installed")
    monkeypatch.setenv("OPENCV_IO_ENABLE_OPENEXR", "1")

    def load(module, *folders):
        for folder in folders:
            path = Path(place) / folder
            if not path.is_dir():
                pytest.skip(f"S3D_LOADERS has no {folder}")
            monkeypatch.syspath_prepend(str(path.resolve()))
        return pytest.importorskip(module, exc_type=ImportError)

    return load


def seen(views, stem, points, k, world_from_camera):
    views[stem] = {
        "points": np.where(np.isfinite(points), points, np.nan).astype(float),
        "k": np.asarray(k, float),
        "world_from_camera": np.asarray(world_from_camera, float),
    }


def pairs_meet(views, pairs, centre, at_least):
    """The points of one view meet the other's surface for the share that `s3d pairs` tells."""
    assert len(pairs) >= at_least
    off = [share_that_meets(views[a], views[b], centre) - share for a, b, share in pairs]
    assert np.abs(np.median(off)) < 0.05 and np.quantile(np.abs(off), 0.9) < 0.15, np.sort(off)


@pytest.mark.parametrize("project", ["dust3r", "must3r"])
def test_dust3r_and_must3r(loader, pack, demo, paired, project):  # noqa: F811
    folders = {"dust3r": ["dust3r"], "must3r": ["must3r", "dust3r"]}[project]
    module = loader(f"{project}.datasets.scannetpp", *folders)
    in_memory = {"num_views": 2, "min_memory_num_views": 2, "max_memory_num_views": 2}
    more = {"split": "train"} if project == "dust3r" else in_memory
    data = module.ScanNetpp(ROOT=str(pack("dust3r")), resolution=SIZE, aug_crop=0, seed=1, **more)
    _, shares = paired
    views, pairs = {}, []
    for i in range(len(data)):
        sample = (data[i] if project == "dust3r" else data[(i, 0, 2)])[:2]
        names = [view["label"].removeprefix("area_1_") for view in sample]
        for name, view in zip(names, sample):
            points = np.where(view["valid_mask"][..., None], view["pts3d"], np.nan)
            seen(views, name, points, view["camera_intrinsics"], view["camera_pose"])
        pairs.append((*names, shares[tuple(names)]))
    pairs_meet(views, pairs, 0, 10)


def test_mapanything(loader, pack, demo, paired):  # noqa: F811
    module = loader("mapanything.datasets.wai.scannetpp", "map-anything")
    place = pack("wai")
    data = module.ScanNetPPWAI(
        ROOT=str(place), dataset_metadata_dir=str(place / "metadata"), split="train", num_views=2,
        covisibility_thres=0.25, resolution=(SIZE, SIZE), transform="imgnorm", data_norm_type="dinov2", seed=1,
    )  # fmt: skip
    _, shares = paired
    views, pairs = {}, []
    for i in range(30):
        data.seed = i
        sample = data[0]
        names = [Path(view["instance"]).name for view in sample]
        for name, view in zip(names, sample):
            points = np.where(np.asarray(view["valid_mask"])[..., None], view["pts3d"], np.nan)
            seen(views, name, points, view["camera_intrinsics"], view["camera_pose"])
        pairs.append((*names, shares[tuple(names)]))
    pairs_meet(views, pairs, 0, 30)


def test_vggt(loader, pack, demo, paired):  # noqa: F811
    module = loader("data.datasets.scannet", "vggt", "vggt/training")
    place = pack("vggt")
    settings = dict(
        debug=False, training=False, get_nearby=False, load_depth=True, inside_random=False, allow_duplicate_img=False,
        img_size=SIZE, patch_size=16, rescale=True, rescale_aug=False, landscape_check=False,
        augs=types.SimpleNamespace(scales=None),
    )  # fmt: skip
    folders = {"SCANNET_DIR": str(place), "SCANNET_ANNOTATION_DIR": str(place / "annotations")}
    data = module.ScanNetDataset(types.SimpleNamespace(**settings), min_num_images=2, **folders)
    views = {}
    for name in data.sequence_list:
        images = data.data_store[name]
        batch = data.get_data(seq_name=name, ids=list(range(len(images))))
        for i, image in enumerate(images):
            stem = Path(image["filepath"]).stem
            pose = np.linalg.inv(np.vstack([batch["extrinsics"][i], [0, 0, 0, 1]]))
            points = np.where(batch["point_masks"][i][..., None], batch["world_points"][i], np.nan)
            assert points.shape == (SIZE, SIZE, 3) and batch["images"][i].shape == (SIZE, SIZE, 3)
            seen(views, stem, points, batch["intrinsics"][i], pose)
    assert set(views) == set(stems(demo, "data"))
    _, shares = paired
    pairs = [(*pair, share) for pair, share in shares.items() if set(pair) <= set(views)]
    pairs_meet(views, pairs, 0.5, 10)


def without_networks(monkeypatch):
    """Pointcept's data sets import a helper from beside its networks, and these import extensions that are compiled for
    one torch. The helper is taken without them; what the data sets tried here do not call is empty.
    """
    monkeypatch.setitem(sys.modules, "pointops", types.ModuleType("pointops"))
    scatter = types.ModuleType("torch_scatter")
    scatter.scatter_min = scatter.segment_csr = None
    monkeypatch.setitem(sys.modules, "torch_scatter", scatter)
    networks = types.ModuleType("pointcept.models")
    networks.__path__ = [str(Path(os.environ["S3D_LOADERS"]).resolve() / "Pointcept/pointcept/models")]
    monkeypatch.setitem(sys.modules, "pointcept.models", networks)


@pytest.fixture(scope="module")
def concerto(s3d, demo, tmp_path_factory):
    """A data set with as many points as Concerto wants, and its package where Pointcept looks for it."""
    place = tmp_path_factory.mktemp("concerto")
    small = ["--views", "5", "--size", "160", "--pano-width", "128", "--points-per-m2", "4000"]
    s3d("export", demo / "scan/scene.toml", "-o", place / "dataset", *small, "--profile", "pointcept")
    s3d("pack", place / "dataset", "--to", "concerto", "-o", place / "run/data/s3dis")
    return place


def test_concerto(loader, concerto, monkeypatch):
    if "S3D_LOADERS" in os.environ:
        without_networks(monkeypatch)
    module = loader("pointcept.datasets.defaults", "Pointcept")
    monkeypatch.chdir(concerto / "run")
    patch, size = 10, 160
    data = module.DefaultImagePointDataset(
        split=["Area_1"], data_root="data/s3dis", transform=[], crop_h=size, crop_w=size, patch_size=patch
    )
    assert len(data) == len(json.loads(Path("data/s3dis/splits/Area_1.json").read_text()))
    for i in range(len(data)):
        sample = data[i]
        listed = data.data_list[sample["name"]]
        assert sample["images"].shape == (len(listed["images"]), 3, size, size)
        assert sample["correspondence"].shape == (len(sample["coord"]), len(listed["images"]), 2)
        for j, image in enumerate(listed["images"]):
            stem = Path(image).name.replace("_domain_rgb.png", "")
            k, world_to_camera, _ = pose_of(concerto / "dataset", stem)
            shown = (sample["correspondence"][:, j] >= 0).all(1)
            camera = sample["coord"][shown] @ world_to_camera[:, :3].T + world_to_camera[:, 3]
            where = (camera @ k.T)[:, :2] / camera[:, 2:]
            # Rows, then columns, in patches. A point is up to 1 cm from what the pixel's centre shows.
            rows_columns = sample["correspondence"][shown, j] * patch + 0.5
            away = np.linalg.norm(where[:, ::-1] - rows_columns, axis=1) * camera[:, 2] / k[0, 0]
            # Towards the border, a picture's plane is slanted to the ray.
            slant = np.linalg.norm(camera, axis=1) / camera[:, 2]
            assert shown.sum() > 1000 and (away / slant).max() < 0.0101


def test_concerto_prepares_its_own(concerto):
    """Their preprocessing of 2D-3D-S makes the same rooms, and correspondences as near as it means them to be.

    It goes along the ray of a pixel's corner as far as the surface is along that of its centre. Its points lie
    within 1 cm of there.
    """
    place = os.environ.get("S3D_LOADERS") or pytest.skip("S3D_LOADERS names no checkouts of loaders")
    script = Path(place).resolve() / "Pointcept/pointcept/datasets/preprocessing/concerto/s3dis/preprocess_s3dis.py"
    if not script.is_file():
        pytest.skip("S3D_LOADERS has no Pointcept")
    for name in ["camtools", "open3d", "trimesh", "rtree", "scipy"]:
        pytest.importorskip(name)
    dataset, theirs, ours = concerto / "dataset", concerto / "theirs", concerto / "run/data/s3dis"
    options = ["--splits", "Area_1", "--dataset_root", dataset / "profiles/pointcept", "--raw_root", dataset]
    options += ["--output_root", theirs, "--parse_normal", "--parse_pointclouds", "--parse_depths"]
    subprocess.run([sys.executable, script, *options], check=True, cwd=concerto)
    views = 0
    for room in sorted((theirs / "images/Area_1").iterdir()):
        for name in ["coord", "color", "segment", "instance"]:
            one, other = (np.load(side / "Area_1" / room.name / f"{name}.npy") for side in (theirs, ours))
            assert np.array_equal(one, other), f"{room.name}/{name}"
        points = np.load(theirs / "Area_1" / room.name / "coord.npy")
        for image in room.glob("*/color/*.png"):
            stem = image.name.replace("_domain_rgb.png", "")
            k, world_to_camera, _ = pose_of(dataset, stem)
            pixels = np.load(image.parent.parent / "correspondence" / f"{image.stem}.npy").astype(int)
            depth = depth_of(dataset, stem)[pixels[:, 1], pixels[:, 0]]
            centre, corner = (
                np.c_[pixels[:, :2] + off, np.ones(len(pixels))] @ np.linalg.inv(k).T for off in (0.5, 0)
            )
            distance = depth * np.linalg.norm(centre, axis=1)
            there = corner / np.linalg.norm(corner, axis=1)[:, None] * distance[:, None]
            world = (there - world_to_camera[:, 3]) @ world_to_camera[:, :3]
            away = np.linalg.norm(points[pixels[:, 2]] - world, axis=1)
            # Pictures of depth step by 2 mm.
            assert len(pixels) > 1000 and np.quantile(away, 0.999) < 0.012
            views += 1
    assert views >= 4
