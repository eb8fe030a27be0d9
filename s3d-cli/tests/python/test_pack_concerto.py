"""The package for Concerto, read by the rules of Pointcept's DefaultImagePointDataset (at d74c646) and compared with
the points of the rooms and the depth of the views."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image


@pytest.fixture(scope="module")
def made(s3d, demo, tmp_path_factory):
    out = tmp_path_factory.mktemp("concerto") / "dataset"
    small = ["--views", "3", "--size", "120", "--pano-width", "128", "--points-per-m2", "400"]
    s3d("export", demo / "scan/scene.toml", "-o", out, *small)
    s3d("pack", out, "--to", "concerto")
    package = out.with_name("dataset_concerto")
    return out, package, json.loads((package / "splits/Area_1.json").read_text())


def below(package, path):
    """The loader looks below data/s3dis, where the package is linked."""
    assert path.startswith("data/s3dis/")
    return package / Path(path).relative_to("data/s3dis")


def test_samples_are_all_views_of_rooms_four_at_a_time(made):
    out, package, samples = made
    listed = [path for sample in samples.values() for path in sample["images"]]
    assert len(listed) == len(set(listed)) == len(list((out / "area_1/data/rgb").glob("*.png")))
    for name, sample in samples.items():
        room = Path(sample["pointclouds"]).name
        assert name.startswith(room + "_") and 1 <= len(sample["images"]) <= 4
        frames = [int(path.split("_frame_")[1].split("_domain_")[0]) for path in sample["images"]]
        assert frames == sorted(frames), "as their own lists are"
        for image, correspondence in zip(sample["images"], sample["correspondences"], strict=True):
            image = below(package, image)
            assert f"_{room}_frame_" in image.name
            assert image.read_bytes() == (out / "area_1/data/rgb" / image.name).read_bytes()
            assert below(package, correspondence).name == image.with_suffix(".npy").name


def test_pixels_show_their_points(made):
    out, package, samples = made
    shown = total = 0
    for sample in samples.values():
        points = np.load(below(package, sample["pointclouds"]) / "coord.npy")
        for image, correspondence in zip(sample["images"], sample["correspondences"]):
            camera = below(package, image).parent.parent
            stems = sorted(p.name for p in (camera / "color").iterdir())
            stems.sort(key=lambda name: int(name.split("_frame_")[1].split("_domain_")[0]))
            number = stems.index(Path(image).name)
            k = np.load(camera / f"intrinsic/{number}.npy")
            to_camera = np.load(camera / f"pose/{number}.npy")
            stem = Path(image).name.replace("_domain_rgb.png", "")
            pose = json.loads((out / f"area_1/data/pose/{stem}_domain_pose.json").read_text())
            assert np.array_equal(k, pose["camera_k_matrix"])
            assert np.array_equal(to_camera[:3], pose["camera_rt_matrix"]) and list(to_camera[3]) == [0, 0, 0, 1]

            rows = np.load(below(package, correspondence))
            pixels, index = rows[:, :2], rows[:, 2]
            assert len(np.unique(pixels, axis=0)) == len(pixels)
            # The place of each pixel, by its depth.
            depth = np.array(Image.open(camera / f"depth/{stem}_domain_depth.png")).astype(float) / 512
            z = depth[pixels[:, 1], pixels[:, 0]]
            local = np.c_[pixels + 0.5, np.ones(len(pixels))] @ np.linalg.inv(k).T * z[:, None]
            world = (local - to_camera[:3, 3]) @ to_camera[:3, :3]
            away = np.linalg.norm(points[index] - world, axis=1)
            assert away.max() < 0.01
            # No other point is nearer: a few pixels against all points.
            for i in range(0, len(rows), max(len(rows) // 20, 1)):
                assert np.linalg.norm(points - world[i], axis=1).min() >= away[i] - 1e-6
            shown += len(rows)
            total += depth.size
    # 400 points per m² are 5 cm apart: about 12 % of a plane is within 1 cm of one.
    assert 0.05 < shown / total < 0.6, shown / total
