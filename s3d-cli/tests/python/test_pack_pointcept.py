"""Reads `s3d pack --to pointcept` by the rules of Pointcept's loader, compares it with the S3DIS tree as its
preprocessing reads it, and exports it again.
"""

import json
import shutil

import pytest
from test_pack import CLASSES, pack  # noqa: F401

np = pytest.importorskip("numpy")


@pytest.fixture(scope="module")
def package(pack):  # noqa: F811
    return pack("pointcept")


def rooms_of(place):
    return sorted(path for path in (place / "Area_1").glob("*"))


def test_rooms_are_what_the_preprocessing_makes_of_the_tree(package, demo):
    trees = [path for path in sorted((demo / "s3dis" / "Area_1").iterdir()) if path.is_dir()]
    assert [room.name for room in rooms_of(package)] == [tree.name for tree in trees]
    for room, tree in zip(rooms_of(package), trees):
        assets = {path.stem: np.load(path) for path in room.iterdir()}
        assert {name: (a.dtype.str, a.shape[1:]) for name, a in assets.items()} == {
            "coord": ("<f4", (3,)),
            "color": ("|u1", (3,)),
            "normal": ("<f4", (3,)),
            "segment": ("<i2", (1,)),
            "instance": ("<i2", (1,)),
        }
        rows, segments, instances = [], [], []
        for number, path in enumerate(sorted((tree / "Annotations").glob("*.txt"))):
            points = np.loadtxt(path, ndmin=2)
            rows.append(points)
            segments += [CLASSES.index(path.name.split("_")[0])] * len(points)
            instances += [number] * len(points)
        rows = np.vstack(rows)
        assert (assets["coord"] == rows[:, :3].astype(np.float32)).all()
        assert (assets["color"] == rows[:, 3:]).all()
        assert (assets["segment"][:, 0] == segments).all() and (assets["instance"][:, 0] == instances).all()
        normals = assets["normal"]
        assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 1e-5
        floor = assets["segment"][:, 0] == CLASSES.index("floor")
        assert floor.any() and (np.abs(normals[floor, 2]) > 0.99).mean() > 0.95


def test_an_export_of_the_package_has_the_same_labels(package, s3d, demo, tmp_path):
    scan = tmp_path / "scan"
    shutil.copytree(demo / "scan", scan)
    text = (scan / "scene.toml").read_text()
    head, rest = text.split("[annotations]", 1)
    _, *after = rest.split("\n[", 1)
    annotations = f'[annotations]\npath = "{package / "Area_1"}"\n'
    (scan / "scene.toml").write_text(head + annotations + "".join(f"\n[{part}" for part in after))
    out = tmp_path / "again"
    s3d("export", scan / "scene.toml", "-o", out, "--views", "1", "--size", "32", "--pano-width", "64")
    names = [json.loads((root / "assets" / "semantic_labels.json").read_text()) for root in (demo, out)]
    assert names[0] == names[1]


def test_without_labels_it_says_so(s3d, demo, tmp_path):
    mesh = demo / "area_1" / "3d" / "rgb.obj"
    out = tmp_path / "bare"
    s3d("export", mesh, "-o", out, "--place-cameras", "4", "--views", "1", "--size", "32")
    told = s3d("pack", out, "--to", "pointcept", "-o", tmp_path / "package", code=1)
    assert "Pointcept's rooms need labels" in told.stderr
    told = s3d("pack", demo, "--to", "pointcept", "-o", tmp_path / "package", "--images", "views", code=2)
    assert "--images belongs to webdataset and colmap and" in told.stderr
    assert not (tmp_path / "package").exists()
