"""Views that are rendered while one trains: the same for any process, where cameras fit, and as exact as images."""

from __future__ import annotations

import multiprocessing
import pickle
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import s3d_py as s3d

from common import box

WORDS = ["rgb", "depth", "normal", "xyz", "face", "labels", "classes"]


@pytest.fixture(scope="module")
def ds(demo: Path) -> s3d.DataSet:
    return s3d.open(demo)


def _arrays(sample: dict[str, Any]) -> dict[str, npt.NDArray[Any]]:
    return {word: np.asarray(value) for word, value in sample.items()}


def _same(a: dict[str, Any], b: dict[str, Any]) -> bool:
    one, two = _arrays(a), _arrays(b)
    return one.keys() == two.keys() and all(np.array_equal(one[k], two[k], equal_nan=True) for k in one)


def test_samples_are_what_a_camera_sees(ds: s3d.DataSet) -> None:
    views = s3d.RenderedViews(ds, length=5, size=(96, 64), modalities=WORDS)
    assert len(views) == 5 and repr(views) == f"RenderedViews(5 of 96 × 64: {', '.join(WORDS)})"
    sample = _arrays(views[3])
    assert sample["rgb"].shape == (3, 64, 96) and sample["rgb"].dtype == np.uint8
    assert sample["K"].dtype == sample["T_world_cam"].dtype == np.float32 and sample["classes"].dtype == np.int64
    image = ds.scene().render(
        sample["K"].astype(float), sample["T_world_cam"].astype(float), (96, 64), modalities=["rgb", "depth", "face"]
    )
    # The matrices are rounded to 32 bits.
    same = image.face == sample["face"]
    assert same.mean() > 0.98
    assert np.nanmedian(np.abs(image.depth - sample["depth"])) < 1e-4
    votes = ds.votes()
    assert votes is not None
    seen = sample["face"] >= 0
    labels = np.where(seen, votes.label[sample["face"]], -1)
    assert np.array_equal(labels, sample["labels"])
    classes = np.where(labels > 0, ds.class_of_label[labels], -1)
    assert np.array_equal(classes, sample["classes"]) and (classes >= 0).mean() > 0.5


def _sample_in_another_process(views: s3d.RenderedViews, index: int, queue: Any) -> None:
    queue.put(_arrays(views[index]))


@pytest.mark.parametrize("method", ["spawn", "fork"])
def test_a_sample_depends_on_seed_epoch_and_index_alone(ds: s3d.DataSet, method: str, tmp_path: Path) -> None:
    room = s3d.Scene(box())
    box().save(tmp_path / "box.ply")
    for source in (ds, room, tmp_path / "box.ply"):
        views = s3d.RenderedViews(source, size=(32, 32), modalities=["rgb", "depth"], sampler="free_space")
        first, again = views[7], views[7]
        assert _same(first, again) and not _same(first, views[8])
        copy = pickle.loads(pickle.dumps(views))
        assert _same(copy[7], first)
        views.set_epoch(1)
        assert not _same(views[7], first)
        views.set_epoch(0)
        context: Any = multiprocessing.get_context(method)
        queue: Any = context.Queue()
        child = context.Process(target=_sample_in_another_process, args=(views, 7, queue))
        child.start()
        assert _same(queue.get(timeout=120), first)
        child.join()
    other = s3d.RenderedViews(ds, size=(32, 32), modalities=["rgb", "depth"], sampler="free_space", seed=1)
    assert not _same(other[7], s3d.RenderedViews(ds, size=(32, 32), sampler="free_space")[7])


def test_a_stream_has_each_index_once_over_all_ranks(ds: s3d.DataSet) -> None:
    views = s3d.RenderedViews(ds, size=(16, 16), modalities=["depth"])
    streams = [iter(views.stream(rank, 3)) for rank in range(3)]
    found = [next(stream) for _ in range(4) for stream in streams]
    assert [sample["index"] for sample in found] == list(range(12))
    assert _same(found[5], views[5])
    with pytest.raises(s3d.UsageError, match="rank=3"):
        views.stream(3, 3)


def test_torch_finds_its_own_classes(ds: s3d.DataSet, monkeypatch: pytest.MonkeyPatch) -> None:
    # A stand-in, for torch is large: its loaders tell streams by their class.
    classes: dict[str, Any] = {"Dataset": type("Dataset", (), {}), "IterableDataset": type("Iterable", (), {})}
    data = types.SimpleNamespace(**classes, get_worker_info=lambda: types.SimpleNamespace(id=1, num_workers=2))
    monkeypatch.setitem(sys.modules, "torch.utils.data", data)
    views = s3d.RenderedViews(ds, size=(16, 16), modalities=["depth"])
    for made, kind, base in [
        (views.stream(1, 3), s3d.RenderedStream, classes["IterableDataset"]),
        (ds.torch(["depth"]), s3d.TorchDataset, classes["Dataset"]),
    ]:
        copy = pickle.loads(pickle.dumps(made))
        assert all(isinstance(one, kind) and isinstance(one, base) for one in (made, copy))
    # The second worker of two, in the second rank of three.
    stream = iter(views.stream(1, 3))
    assert [next(stream)["index"] for _ in range(3)] == [3, 9, 15]


def test_paper_views_have_the_distributions_of_the_paper(ds: s3d.DataSet) -> None:
    places = [panorama.T_world_cam for panorama in ds.panoramas()]
    draw = s3d.Paper(places)
    scene = ds.scene()
    cameras = [draw(scene, np.random.default_rng([1, i])) for i in range(4000)]
    poses = np.array([camera.T_world_cam for camera in cameras])
    fov = np.array([camera.fov for camera in cameras])
    pitch = np.degrees(np.arcsin(poses[:, 2, 2]))
    yaw = np.arctan2(poses[:, 1, 2], poses[:, 0, 2])
    assert abs(pitch.mean()) < 1 and pitch.std() == pytest.approx(15, abs=0.7)
    assert np.histogram(yaw, 8, (-np.pi, np.pi))[0].min() > 400
    assert fov.max() <= 75 and fov.min() >= 10
    # |N(0, 30)| up to 65: half of it is below 19.
    assert np.median(75 - fov) == pytest.approx(19.4, abs=1.2)
    assert np.allclose(np.linalg.det(poses[:, :3, :3]), 1) and np.abs(poses[:, 2, 0]).max() < 1e-12
    standing = {tuple(np.round(pose[:3, 3], 6)) for pose in poses}
    assert standing == {tuple(np.round(place[:3, 3], 6)) for place in places}


def test_free_space_is_clear_of_walls_and_sees_enough(ds: s3d.DataSet) -> None:
    scene, draw = ds.scene(), s3d.FreeSpace(clear=0.3, seen=0.9)
    rng = np.random.default_rng(2)
    all_around = rng.normal(size=(4000, 3))
    all_around /= np.linalg.norm(all_around, axis=1, keepdims=True)
    places = []
    for i in range(40):
        camera = draw(scene, np.random.default_rng([3, i]))
        eye = camera.T_world_cam[:3, 3]
        around = scene.cast(eye, all_around)
        # Checked by a few rays: hardly anything is nearer than asked for.
        assert (around.t < 0.25).mean() < 0.02 and (around.face >= 0).mean() > 0.9
        K = s3d.intrinsics((64, 64), camera.fov)
        seen = scene.render(K, camera.T_world_cam, (64, 64), modalities=["face"]).face >= 0
        assert seen.mean() > 0.8
        places.append(eye)
    assert np.ptp(np.array(places), axis=0).min() > 1
    with pytest.raises(s3d.InputError, match="no free place"):
        s3d.FreeSpace(clear=50.0)(scene, rng)


def test_pairs_share_what_was_asked_for(ds: s3d.DataSet) -> None:
    views = s3d.RenderedViews(
        ds, size=(64, 64), modalities=["depth", "xyz"], sampler="free_space", pairs=s3d.Nearby((0.4, 0.7))
    )
    scene = ds.scene()
    for index in range(6):
        pair = views[index]
        assert 0.4 <= pair["overlap"] <= 0.7 and pair["index"] == index
        points = np.asarray(pair["a"]["xyz"]).reshape(3, -1).T.astype(float)
        pose, K = (np.asarray(pair["b"][word]).astype(float) for word in ("T_world_cam", "K"))
        local = (points - pose[:3, 3]) @ pose[:3, :3]
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = (local @ K.T)[:, :2] / local[:, 2:]
        inside = (local[:, 2] > 0) & ((pixels >= 0) & (pixels < 64)).all(1)
        t = scene.cast(pose[:3, 3], np.nan_to_num(points - pose[:3, 3])).t
        assert abs((inside & (t > 0.995)).sum() / (~np.isnan(points[:, 0])).sum() - pair["overlap"]) < 0.15


def test_a_walk_is_smooth_and_goes_through_doors(ds: s3d.DataSet) -> None:
    scene = ds.scene()
    cameras = s3d.walk(scene, 900, seed=1)
    eyes = np.array([camera.T_world_cam[:3, 3] for camera in cameras])
    ahead = np.array([camera.T_world_cam[:3, 2] for camera in cameras])
    steps = np.linalg.norm(np.diff(eyes, axis=0), axis=1)
    # A metre a second, 30 a second.
    assert steps.max() < 0.08 and steps.sum() > 20
    turns = np.degrees(np.arccos(np.clip((ahead[1:] * ahead[:-1]).sum(1), -1, 1)))
    assert np.quantile(turns, 0.95) < 6
    around = np.random.default_rng(0).normal(size=(60, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    for eye in eyes[::30]:
        assert np.nanmin(scene.cast(eye, around).t) > 0.1
    # Nothing is between one place and the next, and more than one room is seen.
    assert not (scene.cast(eyes[:-1], np.diff(eyes, axis=0)).t < 1).any()
    floors = scene.cast(eyes, np.tile([0.0, 0.0, -1.0], (len(eyes), 1))).face
    labels = ds.votes().label[floors]  # type: ignore[union-attr]
    assert len({ds.labels[label].room for label in np.unique(labels) if label > 0}) >= 2

    with pytest.raises(s3d.CancelledError):
        s3d.walk(scene, 100_000, progress=lambda task: False)
    with pytest.raises(s3d.UsageError, match="fov=0"):
        s3d.walk(scene, 9, fov=0)
    of_path = s3d.walk(ds.root / "scan" / "rgb.obj", 9, seed=1)
    assert np.allclose(of_path[5].T_world_cam[:3, 3], eyes[5], atol=1e-6)
    with pytest.raises(s3d.UsageError, match="each a Camera"):
        s3d.RenderedViews(ds, sampler=[eyes[0]])

    views = s3d.RenderedViews(ds, size=(32, 32), modalities=["depth"], sampler=cameras[:5])
    assert len(views) == 5 and np.array_equal(views[4]["T_world_cam"], cameras[4].T_world_cam.astype(np.float32))
    assert all(np.array_equal(a.T_world_cam, b.T_world_cam) for a, b in zip(cameras, s3d.walk(scene, 900, seed=1)))


def test_augmentations_change_what_they_say() -> None:
    room = box()

    def views(**how: float) -> dict[str, npt.NDArray[Any]]:
        augment = s3d.Augment(**how)
        made = s3d.RenderedViews(
            room, size=(64, 64), modalities=["rgb", "face"], sampler="free_space", augment=augment
        )
        return _arrays(made[2])

    plain = views()
    brighter = views(exposure=1.0)
    assert np.array_equal(plain["face"], brighter["face"]) and not np.array_equal(plain["rgb"], brighter["rgb"])
    rolled = views(roll=20.0)["T_world_cam"]
    assert np.allclose(rolled[:3, 2], plain["T_world_cam"][:3, 2]) and abs(rolled[2, 0]) > 0.01
    # Pixels of a lens are those of OpenCV's model: the ray of a pixel shows the face that it meets.
    for index in range(8):
        augment = s3d.Augment(distortion=0.3)
        made = s3d.RenderedViews(
            room, size=(64, 64), modalities=["face"], sampler="free_space", augment=augment
        )
        bent = _arrays(made[index])
        k, pose, k1 = bent["K"].astype(float), bent["T_world_cam"].astype(float), float(bent["k1"])
        assert abs(k1) > 1e-4 and (bent["face"] >= 0).all()
        r = np.linspace(0, 3, 30_001)
        r = r[: np.argmax(np.append(np.diff(r * (1 + k1 * r * r)) <= 0, True)) + 1]
        rows, columns = np.mgrid[2:64:6, 2:64:6]
        u, v = (columns.ravel() + 0.5 - k[0, 2]) / k[0, 0], (rows.ravel() + 0.5 - k[1, 2]) / k[1, 1]
        far = np.hypot(u, v)
        scale = np.interp(far, r * (1 + k1 * r * r), r) / far
        rays = np.stack([scale * u, scale * v, np.ones(len(u))], 1) @ pose[:3, :3].T
        hit = s3d.Scene(room).cast(pose[:3, 3], rays).face
        assert (hit == bent["face"][rows.ravel(), columns.ravel()]).mean() > 0.95


def test_wrong_wishes_are_told(ds: s3d.DataSet) -> None:
    room = box()
    wrong: list[tuple[Any, dict[str, Any], str]] = [
        (room, {"modalities": ["classes"]}, "modalities"),
        (room, {"labels": [1, 2]}, "one for each face"),
        (ds, {"labels": [1]}, "a data set has its own"),
        (room, {"area": 1}, "of a data set alone"),
        (room, {"sampler": "random"}, "sampler='random'"),
        (room, {"length": 0}, "length=0"),
        (room, {"size": (0, 4)}, "size=0"),
    ]
    for source, how, words in wrong:
        with pytest.raises(s3d.UsageError, match=words):
            s3d.RenderedViews(source, **how)
    with pytest.raises(IndexError):
        s3d.RenderedViews(room, length=3)[3]
    labels = s3d.RenderedViews(room, size=(32, 32), modalities=["labels"], labels=np.arange(14), sampler="free_space")
    assert set(np.unique(np.asarray(labels[0]["labels"]))) <= set(range(-1, 14))
