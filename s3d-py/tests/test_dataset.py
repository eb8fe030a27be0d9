"""Reads a data set, and compares it with its files as other programs read them."""

from __future__ import annotations

import json
import pickle
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import s3d_py as s3d


@pytest.fixture(scope="module")
def ds(demo: Path) -> s3d.DataSet:
    return s3d.open(demo)


def stored(view: s3d.Image, modality: str) -> npt.NDArray[Any]:
    """Returns the pixels of a PNG file, decoded by Pillow."""
    pillow = pytest.importorskip("PIL.Image", reason="Pillow is not installed")
    return np.array(pillow.open(view.path(modality)))


def test_it_is_a_sequence_of_images(ds: s3d.DataSet, demo: Path) -> None:
    manifest = json.loads((demo / "manifest.json").read_text())
    assert ds.areas == [area["area"] for area in manifest["areas"]]
    assert len(ds) == len(list(demo.glob("area_*/*/pose/*.json")))
    views, panoramas = ds.views(), ds.panoramas()
    assert len(views) + len(panoramas) == len(ds)
    assert [view.index for view in ds] == list(range(len(ds)))
    assert ds[-1].index == len(ds) - 1 and [v.index for v in ds[2:4]] == [2, 3]
    for view in (views[0], panoramas[0]):
        assert ds[view.name].index == view.index
        assert view.path("rgb").exists() and view.name in view.path("rgb").name
        assert view.is_panorama == (view.K is None) == (view.frame is None)
    assert views[0].size == (160, 160) and panoramas[0].size == (256, 128)
    with pytest.raises(IndexError):
        ds[len(ds)]
    with pytest.raises(KeyError, match="nobody"):
        ds["nobody"]
    assert (
        "views" in repr(ds)
        and "classes" in repr(ds)
        and "office" in repr(views) + repr(views[0]) + repr(ds.rooms)
    )


def test_pixels_are_those_of_the_files(ds: s3d.DataSet) -> None:
    for view in (ds.views()[3], ds.panoramas()[1]):
        assert np.array_equal(view.rgb, stored(view, "rgb"))
        assert np.array_equal(view.pretty, stored(view, "pretty"))
        depth = stored(view, "depth")
        expected = np.where(depth == 65_535, np.nan, depth / 512.0).astype(np.float32)
        assert np.array_equal(view.depth, expected, equal_nan=True)
        pixels = stored(view, "normal").astype(np.float64)
        normals = (pixels - 127.5) / 127.5
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        if not view.is_panorama:
            normals[..., 2] *= -1  # stored towards the camera
        normals[(pixels == 128).all(-1)] = np.nan
        assert np.allclose(view.normal, normals, atol=1e-6, equal_nan=True)
        r, g, b = np.moveaxis(stored(view, "semantic").astype(np.int32), -1, 0)
        index = r * 65_536 + g * 256 + b
        unseen = index == 0x0D0D0D
        assert np.array_equal(view.labels, np.where(unseen, -1, index))
        names = np.array(["", *(ds.classes or [])])
        of_label = [label.class_name or "" for label in ds.labels]
        seen = ~unseen
        assert (names[view.classes[seen] + 1] == np.array(of_label)[index[seen]]).all()
        assert (view.classes[unseen] == -1).all() and (view.instances[unseen] == -1).all()
        assert np.array_equal(view.instances > 0, view.labels > 0)
        # The image is decoded once, and its array is read-only.
        assert view.rgb is view.rgb
        with pytest.raises(ValueError, match="read-only"):
            view.rgb[0, 0, 0] = 1


def test_points_come_from_depth_and_pose(ds: s3d.DataSet) -> None:
    for view in (ds.views()[5], ds.panoramas()[0]):
        points = view.points()
        assert np.array_equal(np.isnan(points[..., 0]), np.isnan(view.depth))
        # Coordinates are half floats, which step by a centimetre at 10 m.
        apart = np.linalg.norm(points - view.xyz, axis=-1)
        assert np.nanmax(apart) < 0.02
        eye = view.T_world_cam[:3, 3]
        if view.K is None:
            assert np.allclose(np.linalg.norm(points - eye, axis=-1), view.depth, atol=1e-3, equal_nan=True)
            continue
        camera = (points - eye) @ view.T_world_cam[:3, :3]
        assert np.allclose(camera[..., 2], view.depth, atol=1e-4, equal_nan=True)
        pixel = (camera / camera[..., 2:]) @ view.K.T
        rows, columns = np.mgrid[: view.size[1], : view.size[0]] + 0.5
        assert np.nanmax(np.abs(pixel[..., 0] - columns)) < 0.01
        assert np.nanmax(np.abs(pixel[..., 1] - rows)) < 0.01
        assert np.allclose(view.pose["camera_k_matrix"], view.K)


def test_a_view_is_rendered_again_to_the_bit(ds: s3d.DataSet) -> None:
    view = ds.views()[0]
    assert view.K is not None
    made = ds.scene(view.area).render_stored(
        view.K, view.T_world_cam, view.size, modalities=["depth", "normal"]
    )
    # The mesh of the data set is written with fewer digits than the scan's mesh.
    assert (np.abs(made["depth"].astype(int) - stored(view, "depth")) > 1).mean() < 0.01
    assert (made["normal"] != stored(view, "normal")).any(-1).mean() < 0.02


def test_views_are_selected(ds: s3d.DataSet) -> None:
    room, location = ds.views()[0].room, ds.views()[0].location
    in_room = ds.views(room=room)
    assert 0 < len(in_room) < len(ds.views()) and all(view.room == room for view in in_room)
    at = ds.views(location=location[:10])
    assert [v.index for v in at] == [v.index for v in ds.views() if v.location == location]
    assert [v.location for v in ds.panoramas(location=location)] == [location]
    with_chairs = ds.views(min_share={"chair": 0.02})
    assert ds.classes is not None
    chair = ds.classes.index("chair")
    expected = [v.index for v in ds.views() if (v.classes == chair).mean() >= 0.02]
    assert [v.index for v in with_chairs] == expected and 0 < len(expected) < len(ds.views())
    shares = with_chairs[0].shares
    assert shares["chair"] == pytest.approx((with_chairs[0].classes == chair).mean())
    for wrong in ({"room": "office_99"}, {"area": 7}, {"location": "zz"}, {"min_share": {"unicorn": 0.1}}):
        with pytest.raises(s3d.UsageError, match="|".join(wrong)):
            ds.views(**wrong)  # pyright: ignore[reportArgumentType]


def test_tables_are_those_of_the_files(ds: s3d.DataSet, demo: Path) -> None:
    table = json.loads((demo / "assets/semantic_labels.json").read_text())
    names = [label.name for label in ds.labels]
    # The file is padded with entries that are no labels, for published loaders.
    assert table[: len(names)] == names and set(table[len(names) :]) <= {names[0]}
    assert len(ds.class_of_label) == len(ds.labels) and ds.labels[0].class_name is None
    instances = json.loads((demo / "area_1/3d/instances.json").read_text())["instances"]
    assert [i.label for i in ds.instances(1)] == [i["label"] for i in instances]
    assert np.array_equal(ds.instances()[0].bounds, np.array(instances[0]["bbox"], np.float32))
    mesh, votes = ds.mesh(), ds.votes()
    assert votes is not None and len(votes.label) == len(mesh.faces)
    assert np.array_equal(votes.votes, np.load(demo / "area_1/3d/votes.npz")["votes"])
    source = ds.source_faces()
    assert source is not None and source.files == ["rgb.obj"] and not source.file.any()
    assert len(source.face) == len(mesh.faces) and (np.diff(source.face.astype(np.int64)) >= 0).all()
    candidates = ds.candidates()
    kept = [c for c in candidates if c.frame is not None]
    assert len(kept) == len(ds.views()) < len(candidates)
    assert {room.name for room in ds.rooms} >= {view.room for view in ds}
    assert {room.type for room in ds.rooms} >= {"office", "hallway"}
    assert ds.options["size"] == 160 and ds.class_colors is not None and ds.class_colors.shape == (13, 3)


def test_threads_and_pickles_read_the_same(ds: s3d.DataSet) -> None:
    again = pickle.loads(pickle.dumps(ds))
    assert again.root == ds.root and len(again) == len(ds)
    view = pickle.loads(pickle.dumps(ds[4]))
    assert np.array_equal(view.depth, ds[4].depth, equal_nan=True)

    def depth(index: int) -> npt.NDArray[np.float32]:
        return ds[index].depth

    with ThreadPoolExecutor(8) as pool:
        depths = list(pool.map(depth, list(range(8)) * 4))
    assert all(np.array_equal(depths[k], depths[k % 8], equal_nan=True) for k in range(32))
    loaded = ds[2].load()
    kept = loaded._loaded  # pyright: ignore[reportPrivateUsage]
    assert set(kept) >= {"rgb", "depth", "normal", "xyz", "labels", "classes"}


def test_an_image_in_another_size_has_the_same_camera(ds: s3d.DataSet) -> None:
    view = ds.views()[0]
    assert view.size == (160, 160)
    small = view.at((40, 80))
    assert small.size == (40, 80) and small.rgb.shape == (80, 40, 3)
    means = view.rgb.reshape(80, 2, 40, 4, 3).mean((1, 3))
    assert abs(small.rgb - means).max() <= 0.5 + 1e-4
    assert np.array_equal(small.depth, view.depth[1::2, 2::4], equal_nan=True)
    assert np.array_equal(small.labels, view.labels[1::2, 2::4]) and small.normal.shape == (80, 40, 3)
    assert np.array_equal(small.points(), view.points()[1::2, 2::4], equal_nan=True)

    # A place is at the same share of the image, and a crop begins elsewhere.
    points = view.points()[::40, ::40].reshape(-1, 3)
    points = points[~np.isnan(points).any(1)]
    at, depth = view.project(points)
    assert small.project(points)[0] == pytest.approx(at * [0.25, 0.5])
    assert small.project(points)[1] == pytest.approx(depth)
    part = view.at(crop=(10, 20, 60, 90))
    assert part.size == (60, 90) and np.array_equal(part.rgb, view.rgb[20:110, 10:70])
    assert part.project(points)[0] == pytest.approx(at - [10, 20])
    both = view.at((30, 45), crop=(10, 20, 60, 90))
    assert both.project(points)[0] == pytest.approx((at - [10, 20]) / 2)

    # Sizes that do not divide: means add up to the same.
    odd = view.at((37, 53))
    assert odd.rgb.mean() == pytest.approx(view.rgb.mean(), abs=0.5) and odd.classes.shape == (53, 37)
    assert odd != view and odd == view.at((37, 53)) and pickle.loads(pickle.dumps(odd)).size == (37, 53)
    assert np.array_equal(view.at((160, 160)).rgb, view.rgb)
    pano = ds.panoramas()[0]
    assert pano.at((64, 32)).depth.shape == (32, 64)
    image: s3d.Image
    size: Any
    crop: Any
    for image, size, crop, message in [
        (view, (0, 5), None, "size=0: must be a whole number from 1"),
        (view, None, (150, 0, 20, 5), "within 160 × 160 pixels"),
        (view, (4, 4, 4), None, "2 whole numbers"),
        (small, (4, 4), None, "already"),
        (pano, None, (0, 0, 4, 4), "panorama"),
    ]:
        with pytest.raises(s3d.UsageError, match=message):
            image.at(size, crop=crop)


def test_torch_takes_it(ds: s3d.DataSet) -> None:
    chairs = ds.views(room=ds.views()[0].room)
    samples = chairs.torch(["rgb", "depth", "classes", "K"], lambda sample: sample)
    assert len(samples) == len(chairs) and pickle.loads(pickle.dumps(ds.torch(["rgb"])))
    with pytest.raises(s3d.UsageError, match="smell"):
        ds.torch(["smell"])
    torch = pytest.importorskip("torch", reason="torch is not installed")
    loader = torch.utils.data.DataLoader(
        ds.torch(["rgb", "depth", "classes", "K"]), batch_size=2, num_workers=8
    )
    batches = list(loader)
    assert sum(len(batch["index"]) for batch in batches) == len(ds.views())
    first, view = batches[0], ds.views()[0]
    assert first["rgb"].shape == (2, 3, 160, 160) and first["classes"].dtype == torch.int64
    assert np.array_equal(first["depth"][0].numpy(), view.depth, equal_nan=True)
    assert ds.torch(["rgb", "K"], size=(64, 48))[0]["rgb"].shape == (3, 48, 64)


def test_what_is_damaged_is_told_with_its_file(ds: s3d.DataSet, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(ds.root, copy)
    other = s3d.open(copy)
    path = other[0].path("depth")
    content = bytearray(path.read_bytes())
    content[-20] ^= 1
    path.write_bytes(content)
    with pytest.raises(s3d.FileError) as raised:
        other[0].depth
    assert raised.value.path == str(path) and "checksum" in str(raised.value)
    path.unlink()
    with pytest.raises(s3d.MissingFileError):
        other[0].depth
    report = s3d.verify(other)
    assert not report.ok and report.fault_count >= 1
    assert any(path.name in name for group in report.faults for name, _ in group.first)
    with pytest.raises(s3d.FileError):
        s3d.open(tmp_path / "nothing")
    for modality, told in (("smell", "must be one of"), ("semantic_class", "must be one of")):
        with pytest.raises(s3d.UsageError, match=told):
            other[0][modality]


def test_refined_labels_are_read_when_they_are_asked_for(ds: s3d.DataSet, tmp_path: Path) -> None:
    with pytest.raises(s3d.UsageError, match="has no semantic_refined"):
        ds[0].refined_labels
    copy = tmp_path / "copy"
    shutil.copytree(ds.root, copy)
    refined = s3d.open(copy).refine_labels()
    assert s3d.verify(refined).ok
    view = refined.views()[0].load()
    assert "refined_labels" not in view._loaded
    labels, moved = view.refined_labels, view.moved
    assert (labels.dtype, labels.shape, moved.dtype) == (view.labels.dtype, view.labels.shape, np.dtype(bool))
    assert np.array_equal(labels != view.labels, moved) and (view["refined_classes"] == view.classes)[~moved].all()
    assert any(image.moved.any() for image in refined)
    with pytest.raises(s3d.UsageError):
        refined.refine_labels()


def test_whole_data_sets_are_checked_compared_and_scored(ds: s3d.DataSet, tmp_path: Path) -> None:
    told: list[s3d.Task] = []
    report = ds.verify(progress=told.append)
    assert report.ok and report.fault_count == 0 and report.files > 100 and told
    comparison = ds.compare(ds.root)
    assert comparison.equal and "equal" in repr(comparison)
    predictions = tmp_path / "depth"
    predictions.mkdir()
    for panorama in ds.panoramas():
        shutil.copy(panorama.path("depth"), predictions)
    evaluation = ds.evaluate("depth", predictions)
    assert evaluation.score("mean", "AbsRel") == 0 and "AbsRel" in str(evaluation)
    assert evaluation.tables == ["area 1", "area 1, weighted by latitude"]
    against = ds.evaluate("depth", predictions, against=predictions).data["against"]
    assert against["differences"][0]["rows"][0]["scores"][0] == {"value": 0, "interval": [0, 0]}
    scores = tmp_path / "scores.json"
    scores.write_text(json.dumps(evaluation.data))
    page = ds.report(tmp_path / "page", scores=[scores], pano_width=64, thumbs=32, mesh_faces=2000)
    assert (page.parent / "data" / "scores_0.js").exists()
    with pytest.raises(s3d.UsageError, match="no score"):
        evaluation.score("mean", "IoU")
    with pytest.raises(s3d.UsageError, match="protocol"):
        s3d.evaluate("beauty", ds, predictions)
    next(predictions.iterdir()).unlink()
    with pytest.raises(s3d.Error):
        ds.evaluate("depth", predictions)
    statistics = ds.statistics()
    assert statistics.data["areas"][0]["regular_images"] == len(ds.views()) and "|" in str(statistics)


def test_a_page_and_packages_are_made(ds: s3d.DataSet, tmp_path: Path) -> None:
    poster = tmp_path / "poster.png"
    page = ds.report(tmp_path / "page", poster=poster, pano_width=64, thumbs=32, mesh_faces=2000)
    assert page.name == "index.html" and page.exists()
    # A PNG tells its width and height in its first chunk.
    png = poster.read_bytes()
    size = int.from_bytes(png[16:20], "big"), int.from_bytes(png[20:24], "big")
    assert png[1:4] == b"PNG" and size == (1600, 1000)
    with pytest.raises(s3d.UsageError):
        ds.report(tmp_path / "other", poster=poster)
    assert not (tmp_path / "other").exists()
    package = ds.pack("coco", tmp_path / "coco", images="views", stuff=[])
    assert package == tmp_path / "coco" and (package / "pack.json").exists()
    with pytest.raises(s3d.UsageError):
        ds.pack("coco", tmp_path / "coco")
    with pytest.raises(s3d.UsageError, match="zip"):
        ds.pack("zip", tmp_path / "zip")


def test_correspondences_are_the_same_places(ds: s3d.DataSet) -> None:
    views, panorama = ds.views(), ds.panoramas()[0]
    first = next(v for v in views if len(ds.correspondences(v, panorama)) > 500)
    found = ds.correspondences(first, panorama, 400)
    assert len(found) == 400 and found.label is not None
    a, b = found.pixels
    column, row = np.floor(a).astype(int).T
    assert (a % 1 == 0.5).all() and len(np.unique(row * 160 + column)) == 400
    assert np.ptp(column) > 80 and np.ptp(row) > 60

    # What the images of both say of the places; the files round to a centimetre.
    assert np.abs(first.xyz[row, column] - found.xyz).max() < 0.02
    assert (first.labels[row, column] == found.label).mean() > 0.99
    column, row = np.floor(b).astype(int).T
    apart = np.linalg.norm(panorama.xyz[row, column] - found.xyz, axis=1)
    assert np.median(apart) < 0.05
    assert (panorama.labels[row, column] == found.label).mean() > 0.9
    # The faces lie there.
    mesh = ds.mesh(first.area)
    corners = mesh.vertices[mesh.faces[found.face]].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.abs(((found.xyz - corners[:, 0]) * normals).sum(1)).max() < 1e-3

    again = ds.correspondences(first, panorama, 400)
    assert np.array_equal(again.xyz, found.xyz) and np.array_equal(again.pixels[1], b)
    alone = ds.correspondences(first, first, 50)
    assert np.allclose(alone.pixels[0], alone.pixels[1], atol=1e-4)
    assert len(ds.correspondences(first, panorama, 0)) == 0
    with pytest.raises(s3d.UsageError, match="count=-1"):
        ds.correspondences(first, panorama, -1)
